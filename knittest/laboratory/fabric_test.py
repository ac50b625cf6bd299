"""Tests of shells or yarns that are integrated in time: the part that is the same in all of them."""

import time as clock
from collections.abc import Callable
from dataclasses import replace

from knittest.base.history import History, Quality
from knittest.laboratory.base import PreparedSpecimen, RunT, Test
from knittest.laboratory.quality_checks import Span, assess
from knittest.solve.simulation import simulate
from knittest.solve.state import SILENT, Observer, Rig, Simulation, SimulationCost


class TestRig(Rig):
    """A rig whose specimen has a length ``ring_length`` [mm] that waves travel."""

    __test__ = False  # nor one of pytest's
    ring_length: float

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along the specimen."""
        return self.ring_length / wave_speed


class FabricTest(Test[RunT]):
    """A test that mounts shells or yarns in a rig, simulates them, and evaluates the quality checks of every run."""

    ends_at_failure = False

    def prepare(self, run: RunT, specimen: int = 0, observer: Observer = SILENT) -> PreparedSpecimen:
        """Make the specimen of shells or of yarns, in its rig."""
        self.check_run(run)
        if run.model.scale == "macro":
            return self.mount_shells(run, specimen)
        start = clock.perf_counter()
        return replace(self.mount_yarns(run, specimen, observer), geometry_s=clock.perf_counter() - start)

    def mount_shells(self, run: RunT, specimen: int) -> PreparedSpecimen:
        """Make a macro specimen; a test with the scale macro overrides this."""
        raise NotImplementedError

    def mount_yarns(self, run: RunT, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make a meso specimen; a test with the scale meso overrides this."""
        raise NotImplementedError

    def solve(self, prepared: PreparedSpecimen, run: RunT, observer: Observer) -> tuple[History, SimulationCost]:
        """Simulate the test; raises :class:`TooFastError` by ``prepared.restarts`` where the test checks rows."""
        check = self.make_row_check(run, prepared)
        history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, observer, check)
        return self.finish(run, prepared, history), cost

    def make_row_check(self, run: RunT, prepared: PreparedSpecimen) -> Callable[[Simulation], None] | None:
        """Check of each row during the simulation: none by default."""
        return None

    def assess(self, run: RunT, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the quality checks of every run over the span of the test."""
        return assess(run, prepared, history, cost, self.span(history))

    def span(self, history: History) -> Span:
        """Return the part of the test that is checked: all of it by default."""
        return Span()
