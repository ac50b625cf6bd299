"""Sheets against rigid tools, posed through the public interface; see :mod:`cases.shell_tools`."""

import pytest
from cases import shell_tools as case


def test_strip_between_plates():
    """Steady within the swing that the start of the pull leaves, v sqrt(k m) = 0.1 x sqrt(5 x 0.4) = 0.14 N, damped."""
    pull, below = case.strip_between_plates()
    assert abs(pull.error) < 5e-3
    assert abs(below.error) < 1e-6


def test_stick_slip():
    """Step 0.05 of the critical: the stick spring gives way by k dt^2 / (0.2 m) = 1 % of a swing of 0.4 N.

    The period follows the forces.
    """
    high, low, period = case.stick_slip()
    assert high.result == pytest.approx(high.reference, abs=0.01 * 0.4 * 2)
    assert low.result == pytest.approx(low.reference, abs=0.01 * 0.4 * 2)
    assert abs(period.error) < 0.02


def test_incline_threshold():
    """Bracketed to 1e-3."""
    (row,) = case.incline_threshold()
    assert abs(row.error) < 1e-3


def test_incline_slide():
    """The sheet bounces by a share of its weight as it begins to slide: 1e-3 of a mean over 80 ms."""
    (row,) = case.incline_slide()
    assert abs(row.error) < 1e-3


def test_restitution():
    """The damping force lags by dt / 2: first order in dt w, here 0.04 x 2 z."""
    (row,) = case.restitution()
    assert abs(row.error) < 0.04 * 2.0 * 0.05
    assert row.order == pytest.approx(1.0, abs=0.2)


def test_oblique_impact():
    """Momentum to round-off; energy to that of a contact spring over its steps, w^2 dt^2 / 24 = 0.4 / 24."""
    *momentum, energy = case.oblique_impact()
    assert all(row.result == pytest.approx(row.reference, abs=1e-12) for row in momentum)
    assert abs(energy.error) < 0.4 / 24.0


def test_strip_round_a_cylinder():
    """Nodes are apart by 3.75 degrees: their forces are 2 T sin(a / 2) an arc, a^2 / 24 = 1.8e-4; as much for depth."""
    pressure, force = case.wrapped_cylinder()
    assert abs(pressure.error) < 5e-4
    assert pressure.order == pytest.approx(2.0, abs=0.2)
    assert abs(force.error) < 1e-5
