"""A stamp that accelerates: forces as at constant speed in less time, and bitwise the same run when resumed."""

from collections.abc import Callable

import numpy as np
import pytest

from knittest.base.history import Specimen
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.runs.specimen import run_specimen
from knittest.solve.state import Observer, Snapshot

SMALL = [
    "rig.stamp.kind=hemisphere", "rig.stamp.hemisphere.radius=20", "rig.blank_length=100", "rig.blank_width=100",
    "rig.depth=16", "rig.blank_holder_force=40", "model.macro.element_size=10", "solver.speed=0.3", "solver.ramp=8",
    "output.frames=3", "output.samples=200",
]  # fmt: skip
UNTIL = (20.0, 36.0)


class Stopped(Exception):
    """The run was stopped."""


class Keeper(Observer):
    """Stops the run after ``until`` [ms], and resumes it from there."""

    def __init__(self, until: float) -> None:
        self.until, self.kept = until, None

    def resume_from(self) -> Snapshot | None:
        return self.kept

    def visit(self, take: Callable[[], Snapshot]) -> None:
        if self.kept is None and take().time > self.until:
            self.kept = take()
            raise Stopped


def small(speedup: float) -> Run:
    sets = [*SMALL, f"rig.stamp_speedup={speedup}"]
    return resolve(variant="1", scale="macro", test="forming", preset="quick", sets=sets)


@pytest.fixture(scope="module")
def fast() -> Specimen:
    return run_specimen(small(3.0))


def test_it_takes_less_time_and_ends_at_the_same_depth_and_force(fast: Specimen) -> None:
    """Draw-in within 2 %. A hundred elements make forces uneven: within 4 % of the largest, their mean within 1 %."""
    slow = run_specimen(small(1.0))
    one, other = fast.history.curve, slow.history.curve
    assert fast.cost.steps < 0.85 * slow.cost.steps
    assert one["stamp_travel_mm"][-1] == pytest.approx(16.0, abs=1e-6)
    at = np.linspace(2.0, 15.5, 28)
    smooth = [
        np.array([c["stamp_force_n"][np.abs(c["stamp_travel_mm"] - x) < 0.4].mean() for x in at]) for c in (one, other)
    ]
    assert np.abs(smooth[0] - smooth[1]).max() < 0.04 * smooth[1].max()
    assert abs((smooth[0] - smooth[1]).mean()) < 0.01 * smooth[1].max()
    assert fast.results["draw_in_max_mm"] == pytest.approx(slow.results["draw_in_max_mm"], rel=0.02)
    assert fast.quality.energy_error_max < 0.02


@pytest.mark.parametrize("until", UNTIL)
def test_a_resumed_run_is_bitwise_that_without_a_stop(fast: Specimen, until: float) -> None:
    keeper = Keeper(until)
    with pytest.raises(Stopped):
        run_specimen(small(3.0), observer=keeper)
    resumed = run_specimen(small(3.0), observer=keeper)
    assert resumed.results == fast.results
    for name, column in fast.history.curve.items():
        np.testing.assert_array_equal(resumed.history.curve[name], column)
    for name, column in fast.history.energies.items():
        np.testing.assert_array_equal(resumed.history.energies[name], column)
