"""Tiny models of shipped fabrics that call every kernel of a run, at once or by stages that compile side by side."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from knittest.config.run import Output, Run, Scale
from knittest.fabric.strip import YarnPath
from knittest.fabric.variability import YarnDraws
from knittest.kernels.beam_blocks import advance_beams
from knittest.kernels.drive_state import Drive
from knittest.kernels.explicit import SCRATCH, contact_share, outside, shell_share
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Array, Tally
from knittest.kernels.threading import limited
from knittest.kernels.tool_contact import tool_energies
from knittest.materials.laminate import laminate
from knittest.models.boundary import Boundary
from knittest.models.explicit_model import ExplicitModel
from knittest.models.fabric_model import FabricModel
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import build_meso
from knittest.models.readings import Readings, new_tally
from knittest.models.table import ramp
from knittest.models.tool import plane
from knittest.models.yarn_model import YarnModel
from knittest.solve.simulate import simulate

#: kernels of the macro scale with self-contact, and what the names of those of several threads end with
MACRO_CONTACT, THREADS = "macro-contact", "-threads"


class _Moved(NamedTuple):
    """Step size, drive, tally and work space of the tiny model."""

    dt: float
    drive: Drive
    tally: Tally
    scratch: Array


class Exercise:
    """A tiny model of ``kernels``, to be used once as a whole or by the stages of its compilation."""

    def __init__(self, kernels: str) -> None:
        self.threads = 2 if kernels.endswith(THREADS) else 1
        self.run = _run_of(kernels.removesuffix(THREADS))
        self.model = _crossing_yarns(self.run) if self.run.model.scale == "meso" else _small_strip(self.run)

    def whole(self) -> None:
        """Simulate everything that a run calls."""
        brief = self.run.solver.model_copy(update={"target_step": None})
        with limited(self.threads):
            simulate(self.model, _Tug(), brief, Output(samples=20, frames=1))

    def sweeps(self) -> None:
        """Call what evaluates contacts and beams, or shells."""
        model, (dt, _, tally, scratch) = self.model, self._moved
        if isinstance(model, YarnModel):
            contacts, alive = model.tracker.contacts, model.beams.alive
            contact_share(0, 0, dt, model.nodes, contacts, alive, model.law, tally, scratch[0])
            advance_beams(0, 0, 0, 0.0, dt, model.nodes, model.beams, scratch[0])
        if isinstance(model, FabricModel):
            shell_share(0, 0.0, model.nodes, model.shells, model.laminate, model.bends, tally, scratch[0])

    def tools(self) -> None:
        """Call what tools and loads do to nodes."""
        model, (dt, drive, tally, scratch) = self.model, self._moved
        outside(0, dt, model.nodes, model.parts, drive.tables, drive.loads, drive.tools, drive.touch, tally, scratch[0])

    def between(self) -> None:
        """Call what a run does between steps: search, energies, fields, guards."""
        model, (dt, drive, _, _) = self.model, self._moved
        model.prepare()
        tool_energies(model.nodes, drive.tools, drive.touch, model.n_nodes)
        model.stored()
        model.fields()
        model.diagnose(dt)

    def step(self) -> None:
        """Call the whole step, which links what the others compiled."""
        dt, drive, tally, scratch = self._moved
        with limited(self.threads):
            self.model.step(0, 0.0, dt, drive, tally, scratch)

    @cached_property
    def _moved(self) -> _Moved:
        dt = self.run.solver.safety * self.model.critical_step
        boundary = Boundary(self.model, dt)
        _Tug().constrain(boundary)
        return _Moved(dt, boundary.drive(), new_tally(boundary), np.zeros((PARTITIONS, SCRATCH)))


def _run_of(kernels: str) -> Run:
    from knittest.config.loading import resolve

    line = ["fabric.macro.shear.kind=linear", "fabric.macro.shear.stiffness=0.05"]  # no curve to be read
    contact = ["model.macro.self_contact=true"] if kernels == MACRO_CONTACT else []
    scale: Scale = "meso" if kernels == "meso" else "macro"
    return resolve(variant="1", scale=scale, sets=[*line, *contact])


class _Tug:
    """Pulls a little over a plane."""

    duration = 0.02
    coordinate, force = "strain_pct", "force_n"
    marks: tuple[float, ...] = ()
    averaged_from = np.inf

    def constrain(self, boundary: Boundary) -> None:
        along = boundary.model.position()[:, 1]
        boundary.grip(np.flatnonzero(along <= along.min() + 1e-6), "y")
        boundary.grip(np.flatnonzero(along >= along.max() - 1e-6), "y", ramp(1e-3, 0.01))
        boundary.load([0], "z", 0.0)
        boundary.add_tool(plane((0.0, 0.0, -10.0), (0.0, 0.0, 1.0)))

    def ring_time(self, wave_speed: float) -> float:
        return 10.0 / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        return {"strain_pct": time, "force_n": float(readings.reaction[1])}

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        return False


def _crossing_yarns(run: Run) -> ExplicitModel:
    along = np.arange(-5.0, 5.01, 0.5)
    heights = [run.fabric.reinforcing.section_mm(direction)[1] for direction in ("warp", "weft")]
    zero, above = np.zeros_like(along), np.full_like(along, 0.5 * sum(heights))
    paths = [
        YarnPath("warp", 0, np.column_stack([zero, along, zero])),
        YarnPath("weft", 0, np.column_stack([along, zero, above])),
    ]
    one = YarnDraws(np.full(1, 0.1), np.zeros(1), np.ones(1), np.full(1, 0.5))
    return build_meso(run, paths, {"warp": one, "weft": one, "knit": one})


def _small_strip(run: Run) -> ExplicitModel:
    line = (np.array([0.0, 100.0]), np.array([0.0, 2e4]))
    card = laminate(run.fabric, {"warp": line, "weft": line})
    contact = self_contact(run.fabric, run.model.macro, run.solver.safety)
    return build_strip(run.fabric, card, "warp", StripShape(5.0, 5.0, 5.0, 5.0), contact)
