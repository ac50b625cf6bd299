"""A frame of yarns whose kinetic energy is above its limit begins again at a lower speed, also after a resume."""

from collections.abc import Callable

import numpy as np
import pytest

from knittest.base.history import Specimen
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.laboratory.halved_setting import halve_setting
from knittest.laboratory.restart import SPEED, with_result_speed
from knittest.runs.specimen import run_specimen
from knittest.solve.state import Observer, Snapshot

FAST, LIMIT = 2.5, 0.3


class Stopped(Exception):
    """The run is stopped."""


class Keeper(Observer):
    """Stops the run at ``until`` [ms] of its second try, and goes on from where it stopped."""

    def __init__(self, until: float) -> None:
        self.until, self.share, self.kept = until, 1.0, None
        self.begun: list[float] = []

    def speed_share(self) -> float:
        return self.share

    def restarts(self, share: float, reason: str) -> None:
        self.share, self.kept = share, None
        self.begun.append(share)

    def resume_from(self) -> Snapshot | None:
        return self.kept

    def visit(self, take: Callable[[], Snapshot]) -> None:
        if self.begun and self.kept is None and take().time > self.until:
            self.kept = take()
            raise Stopped


def small_frame(*sets: str) -> Run:
    small = ["rig.side=15", "rig.max_angle=20", f"solver.speed={FAST}", "output.samples=100"]
    sets = [*small, f"solver.max_kinetic_ratio={LIMIT}", *sets]
    return resolve(variant="1", scale="meso", preset="quick", test="picture-frame", sets=sets)


@pytest.fixture(scope="module")
def whole() -> Specimen:
    return run_specimen(small_frame())


def test_it_passes_at_the_lower_speed_and_says_so(whole: Specimen) -> None:
    speed = whole.results[SPEED]
    assert speed < FAST
    assert 100.0 * whole.quality.ke_over_ie_max < LIMIT
    assert any(text.startswith(f"run at {speed:.3g} m/s") for text in whole.quality.warnings)
    stated = run_specimen(small_frame(f"solver.speed={speed!r}"))
    assert np.array_equal(stated.history.curve["shear_force_n"], whole.history.curve["shear_force_n"])
    assert not any(text.startswith("run at") for text in stated.quality.warnings)


def test_it_goes_on_to_the_same_bits(whole: Specimen) -> None:
    keeper, stops, found = Keeper(until=4.0), 0, None
    while found is None:
        try:
            found = run_specimen(small_frame(), observer=keeper)
        except Stopped:
            stops += 1
    assert stops == len(keeper.begun) == 2  # each lower speed is stopped once, and gone on with at the same speed
    assert np.array_equal(found.history.curve["shear_force_n"], whole.history.curve["shear_force_n"])
    assert found.results[SPEED] == whole.results[SPEED]


def test_the_speed_that_is_halved_is_the_lower_one(whole: Specimen) -> None:
    assert (
        halve_setting(with_result_speed(small_frame(), whole.results)).half.solver.speed == 0.5 * whole.results[SPEED]
    )


def test_the_speed_has_a_lower_bound() -> None:
    """A run that no speed lets pass ends and is refused."""
    found = run_specimen(small_frame("solver.max_kinetic_ratio=1e-4"))
    assert found.results[SPEED] == pytest.approx(0.1 * FAST)
    assert any("kinetic energy" in text for text in found.quality.failures)
