"""Time integration: order, energy, bits; each case with its source is in ``cases/time_steps.py``."""

import pytest
from cases import time_steps


def test_bar_and_mass_follow_central_differences_exactly() -> None:
    """Second order to the closed form, rounding to what central differences give."""
    row, discrete = time_steps.oscillator()
    assert row.order == pytest.approx(2.0, abs=0.1)
    assert abs(discrete.error) < 1e-11


def test_large_motion_under_a_load_is_second_order_in_time() -> None:
    (row,) = time_steps.second_order()
    assert row.order == pytest.approx(2.0, abs=0.1)
    assert abs(row.error) < 1e-4


def test_energy_is_bounded_and_does_not_drift() -> None:
    """The error falls with dt^2; a hundredth of it is left when each half of 60 periods is averaged."""
    spread, drift = time_steps.energy_drift()
    assert spread.error < 5e-4
    assert spread.order == pytest.approx(2.0, abs=0.3)
    assert drift.error < 0.02 * spread.error


def test_one_and_two_threads_give_the_same_bits() -> None:
    (row,) = time_steps.same_bits()
    assert row.result == 0.0
