"""The wire: its model, what pulls it, and its results."""

from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import History, Quality
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.quality_checks import Span, assess
from knittest.models.boundary import ALL, Boundary, Readings
from knittest.models.chains import Chain, build_chains
from knittest.models.sections import section
from knittest.models.tool import ramp
from knittest.solve.simulation import simulate
from knittest.solve.state import SILENT, Observer, SimulationCost
from knittest_wire.config import WireRun

RADIUS, LINEAR_DENSITY = 0.5, 1e-3  # mm, g/mm


class Grips:
    """Holds one end of a wire along x and pulls the other."""

    coordinate, force = "strain_pct", "force_n"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from, locks, locked_share = 0.0, np.inf, False, np.inf

    def __init__(self, run: WireRun) -> None:
        self.length, speed, rise = run.rig.length, run.solver.speed, run.solver.ramp  # mm, mm/ms, ms
        self.pull = ramp(rise, speed)
        self.duration = 0.5 * rise + 0.01 * run.rig.max_strain * self.length / speed

    def constrain(self, boundary: Boundary) -> None:
        """Grip both ends."""
        boundary.grip(np.array([0]), ALL[0])
        boundary.grip(np.array([boundary.model.n_nodes - 1]), ALL[0], self.pull)

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] of a wave along the wire."""
        return self.length / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Strain and mean force of both grips."""
        force = 0.5 * float(readings.reaction[1] - readings.reaction[0])
        return {"strain_pct": 100.0 * self.pull.integral(time) / self.length, "force_n": force}

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """Go on to the largest strain."""
        return False


class WireTest:
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False

    def prepare(self, run: WireRun, specimen: int = 0, observer: Observer = SILENT) -> PreparedSpecimen:
        """A chain of beams along x, as many as in a loop; raises :class:`InputError` for shells."""
        if run.model.scale != "meso":
            raise InputError("model.scale = macro: a wire is made of beams: use --scale meso")
        points = np.zeros((run.model.meso.elements_per_loop + 1, 3))
        points[:, 0] = np.linspace(0.0, run.rig.length, len(points))
        card = section(run.rig.stiffness, 0.01 * run.rig.stiffness, RADIUS, LINEAR_DENSITY)
        model = build_chains([Chain(points, card)], ("wire",))
        facts = {"length_mm": run.rig.length, "area_mm2": 2.0 * RADIUS * run.rig.length}
        return PreparedSpecimen(model, Grips(run), facts=facts)

    def solve(self, prepared: PreparedSpecimen, run: WireRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Pull."""
        return simulate(prepared.model, prepared.rig, run.solver, run.output, observer)

    def results(self, run: WireRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Force at the end, and the slope of the curve: EA."""
        strain, force = history.curve["strain_pct"], history.curve["force_n"]
        return {"end_force_n": float(force[-1]), "stiffness_n": float(100.0 * force[-1] / strain[-1])}

    def assess(self, run: WireRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Judge by the gates of every run."""
        return assess(run, prepared, history, cost, self.span(history))

    def span(self, history: History) -> Any:
        """The whole pull."""
        return Span()
