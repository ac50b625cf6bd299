"""Tiny models of shipped fabrics that call every kernel of a run, and the names of the kernels that runs need."""

from functools import cached_property

import numpy as np

from knittest.base.arrays import Array
from knittest.base.kinds import kinds
from knittest.config.run import Output, Run, Scale
from knittest.fabric.strip import YarnPath
from knittest.fabric.topology import YarnDraws
from knittest.kernels.beam import advance_beams
from knittest.kernels.explicit import SCRATCH, apply_outside_forces, contact_share, shell_share
from knittest.kernels.state import Drive, Tally
from knittest.kernels.threading import limit_threads
from knittest.kernels.tool_contact import tool_energies
from knittest.kernels.vec import PARTITIONS
from knittest.materials.laminate import laminate
from knittest.materials.yarn_section import sections, systems_of
from knittest.models.boundary import Boundary, Readings, new_tally
from knittest.models.explicit_model import ExplicitModel
from knittest.models.fabric_model import FabricModel
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import UPRIGHT, build_meso, yarn_contact
from knittest.models.periodic import PeriodicChain, build_periodic
from knittest.models.periodic_model import NUMBERS, PeriodicModel
from knittest.models.tool import constant, plane, ramp
from knittest.models.yarn_model import YarnModel
from knittest.solve.simulation import simulate
from knittest.solve.state import Rig

#: self-contact of shells, rigid tools, crossings that resist spin, elliptic sections, yarns with a soft shell
CONTACT, TOOLS, SPIN, OVAL, SOFT = "contact", "tools", "spin", "oval", "soft"
#: a periodic cell, several threads
PERIODIC, THREADS = "periodic", "threads"
#: kernels that ``knittest warmup`` compiles, by scale; the first run with spin friction or elliptic sections compiles
#: its own
ALL = {
    "meso": ("meso", "meso-tools", "meso-periodic", "meso-threads", "meso-tools-threads"),
    "macro": ("macro", "macro-tools", "macro-contact-tools", "macro-threads", "macro-tools-threads"),
}


def kernels_of(run: Run, threads: int = 1) -> tuple[str, ...]:
    """Kernels that ``run`` needs on ``threads``, those of a cell that its fabric settles in first."""
    needed = _needed_features(run)
    names = [_kernels_name(run, needed)]
    settles = run.fabric.has_yarns and (run.fabric.knitting.starts_relaxed or run.fabric.has_soft_yarns)
    if run.model.scale == "meso" and settles and PERIODIC not in needed:
        names.insert(0, _kernels_name(run, [n for n in needed if n != TOOLS] + [PERIODIC]))
    if threads > 1:
        names.append(_kernels_name(run, [*needed, THREADS]))
    return tuple(names)


def _needed_features(run: Run) -> list[str]:
    kind, meso, contact = kinds()[run.rig.kind], run.model.scale == "meso", run.fabric.contact
    wanted = {
        CONTACT: not meso and run.model.macro.self_contact,
        TOOLS: kind.tools,
        SPIN: meso and contact is not None and contact.patch is not None,
        OVAL: meso and any(one.yarn.section is not None for one in run.fabric.inlays),
        SOFT: meso and run.fabric.has_soft_yarns,
        PERIODIC: kind.periodic,
    }
    return [name for name, so in wanted.items() if so]


def _kernels_name(run: Run, needed: list[str]) -> str:
    return "-".join([run.model.scale, *needed])


def has_feature(kernels: str, what: str) -> bool:
    """Return whether ``kernels`` are compiled for one of :data:`CONTACT` to :data:`THREADS`."""
    return what in kernels.split("-")


#: inlays of elliptic sections
ELLIPSES = [
    f"fabric.reinforcing.section.{value}"
    for value in (
        "shape=ellipse", "fibre_density=1.53", "packing.warp=0.9", "packing.weft=0.9", "width_to_height.warp=1.5",
        "width_to_height.weft=1.5",
    )
]  # fmt: skip
#: loops of yarns with a soft shell
SOFT_SHELL = [
    f"fabric.knitting.{value}"
    for value in (
        "soft_shell.outer_diameter=1", "soft_shell.rigidity=0.001", "soft_shell.exponent=2", "degree_of_set=0",
    )
]  # fmt: skip
#: pairs of yarn systems that cross
CROSSINGS = ("inlay_inlay", "inlay_loop", "loop_loop")


class TinyModel:
    """A tiny model of ``kernels``, to be used once as a whole or by the stages of its compilation."""

    def __init__(self, kernels: str) -> None:
        self.threads = 2 if has_feature(kernels, THREADS) else 1
        self.run, self.rig = _small_run(kernels), _PullRig(has_feature(kernels, TOOLS))
        if self.run.model.scale == "macro":
            self.model = _small_strip(self.run)
        else:
            self.model = _small_cell(self.run) if has_feature(kernels, PERIODIC) else _crossing_yarns(self.run)

    def run_all(self) -> None:
        """Simulate everything that a run calls."""
        brief = self.run.solver.model_copy(update={"target_step": None})
        with limit_threads(self.threads):
            simulate(self.model, self.rig, brief, Output(samples=20, frames=1))

    def elements(self) -> None:
        """Call what evaluates contacts, or shells."""
        model, (dt, _, tally, scratch) = self.model, self._step_arguments
        if isinstance(model, YarnModel):
            contacts, alive = model.tracker.contacts, model.beams.alive
            oval = True if model.group.excess.size else None
            contact_share(0, 0, dt, model.nodes, contacts, alive, model.law, model.law.spin, oval, tally, scratch[0])
        if isinstance(model, FabricModel):
            shell_share(0, 0.0, model.nodes, model.shells, model.laminate, model.bends, tally, scratch[0])

    def nodes(self) -> None:
        """Call what beams, tools and loads do to nodes."""
        model, (dt, drive, tally, scratch) = self.model, self._step_arguments
        if isinstance(model, YarnModel):
            advance_beams(0, 0, 0, 0.0, dt, model.nodes, model.beams, scratch[0])
        actions = model.kernel_drive(drive)
        apply_outside_forces(0, dt, model.nodes, model.parts, actions[0], *actions[2:], tally, scratch[0])

    def run_between_steps(self) -> None:
        """Call what a run does between steps: search, energies, fields, guards."""
        model, (dt, drive, _, _) = self.model, self._step_arguments
        model.prepare()
        tool_energies(model.nodes, drive.tools, drive.touch, model.n_nodes)
        model.stored_energies()
        model.fields()
        model.diagnose(dt)
        model.stable_step()

    def step(self) -> None:
        """Call the whole step, which links what the others compiled."""
        dt, drive, tally, scratch = self._step_arguments
        with limit_threads(self.threads):
            self.model.step(0, 0.0, dt, drive, tally, scratch)

    @cached_property
    def _step_arguments(self) -> tuple[float, Drive, Tally, Array]:
        """Step size, drive, tally and work space of the tiny model."""
        dt = self.run.solver.safety * self.model.critical_step
        boundary = Boundary(self.model, dt)
        self.rig.constrain(boundary)
        return dt, boundary.drive(), new_tally(boundary), np.zeros((PARTITIONS, SCRATCH))


def _small_run(kernels: str) -> Run:
    from knittest.config.loading import resolve

    line = ["fabric.macro.shear.kind=linear", "fabric.macro.shear.stiffness=0.05"]  # no curve to be read
    contact = ["model.macro.self_contact=true"] if has_feature(kernels, CONTACT) else []
    patches = [f"fabric.contact.patch.radius.{kind}=0.3" for kind in CROSSINGS] if has_feature(kernels, SPIN) else []
    ovals = ELLIPSES if has_feature(kernels, OVAL) else []
    if has_feature(kernels, SOFT):
        return resolve(variant="jersey", scale="meso", sets=SOFT_SHELL)
    scale: Scale = "meso" if has_feature(kernels, "meso") else "macro"
    return resolve(variant="1", scale=scale, sets=[*line, *contact, *patches, *ovals])


class _PullRig(Rig):
    """Pulls a little, over a plane if ``tools``."""

    def __init__(self, tools: bool) -> None:
        self.tools = tools

    duration = 0.02
    coordinate, force = "strain_pct", "force_n"

    def constrain(self, boundary: Boundary) -> None:
        along = boundary.model.position()[:, 1]
        boundary.grip(np.flatnonzero(along <= along.min() + 1e-6), "y")
        boundary.grip(np.flatnonzero(along >= along.max() - 1e-6), "y", ramp(1e-3, 0.01))
        boundary.load([0], "z", 0.0)
        if self.tools:
            boundary.add_tool(plane((0.0, 0.0, -10.0), (0.0, 0.0, 1.0)))
        if isinstance(boundary.model, PeriodicModel):
            for number in NUMBERS:
                boundary.model.drive(boundary, number, constant(0.0))

    def ring_time(self, wave_speed: float) -> float:
        return 10.0 / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        return {"strain_pct": time, "force_n": float(readings.reaction[1])}

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        return False


def _crossing_yarns(run: Run) -> ExplicitModel:
    along = np.arange(-5.0, 5.01, 0.5)
    heights = [one.section_mm[1] for one in run.fabric.inlays]
    zero, above = np.zeros_like(along), np.full_like(along, 0.5 * (sum(heights) or 0.5))
    if not heights:
        ways = (np.column_stack([zero, along, zero]), np.column_stack([along, zero, above]))
        one = YarnDraws(np.full(1, 0.1), np.zeros(1), np.ones(1), np.full(1, 0.5))
        return build_meso(run, [YarnPath("knit", 0, points) for points in ways], {"knit": one})
    paths = [
        YarnPath("warp", 0, np.column_stack([zero, along, zero])),
        YarnPath("weft", 0, np.column_stack([along, zero, above])),
        YarnPath("knit", 0, np.column_stack([along, zero, 10.0 * above])),
    ]
    one = YarnDraws(np.full(1, 0.1), np.zeros(1), np.ones(1), np.full(1, 0.5))
    return build_meso(run, paths, {"warp": one, "weft": one, "knit": one})


def _small_cell(run: Run) -> ExplicitModel:
    along, cards = np.arange(0.0, 8.0, 0.5), sections(run.fabric)
    zero = np.zeros_like(along)
    above = zero + sum(card.radius for card in cards[:2])
    ways = (np.column_stack([zero, along, zero]), np.column_stack([along, zero, above]))
    if len(cards) == 1:
        chains = [PeriodicChain(points, cards[0], 0, along=1 - k) for k, points in enumerate(ways)]
        return build_periodic(chains, 8.0 * np.eye(2, 3), systems_of(run.fabric), yarn_contact(run))
    chains = [
        PeriodicChain(points, cards[part], part, normal=UPRIGHT, along=1 - part) for part, points in enumerate(ways)
    ]
    third = np.column_stack([along, zero, 10.0 * above])
    chains.append(PeriodicChain(third, cards[2], 2, normal=UPRIGHT, along=0))
    return build_periodic(chains, 8.0 * np.eye(2, 3), systems_of(run.fabric), yarn_contact(run))


def _small_strip(run: Run) -> ExplicitModel:
    line = (np.array([0.0, 100.0]), np.array([0.0, 2e4]))
    card = laminate(run.fabric, {"warp": line, "weft": line})
    contact = self_contact(run.fabric, run.model.macro, run.solver.safety)
    return build_strip(run.fabric, card, "warp", StripShape(5.0, 5.0, 5.0, 5.0), contact)
