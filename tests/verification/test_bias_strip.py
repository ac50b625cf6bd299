"""Bias extension of shells against the pin-jointed net: hourglass control must not lock what the yarns leave free."""

import numpy as np
import pytest
from cases.bias_strip import elongation, pulled, pulled_along_yarns, strip_force


def test_the_net_is_that_of_the_literature():
    """30 deg in the middle of 200 x 100 mm at 22.47 mm, 6.45 N at 20 deg with S = 0.1 N/mm; small angles shear by
    gamma = 2 elongation / (L - W).
    """
    assert elongation(30.0, 100.0) == pytest.approx(22.474, abs=1e-3)
    assert elongation(0.01, 100.0) == pytest.approx(50.0 * np.deg2rad(0.01), rel=1e-3)
    assert strip_force(20.0) == pytest.approx(6.455, abs=1e-3)


@pytest.mark.parametrize("size", [10.0, 5.0])
@pytest.mark.parametrize("angle", [20.0, 30.0])
def test_squares_along_the_pull(size, angle):
    """Yarns 10^4 times as stiff as shear: angle and force of the net within 3 %, of which their stretch takes 2."""
    found = pulled(size, 1e4, angle)
    assert found.angle == pytest.approx(angle, rel=0.03)
    assert found.force == pytest.approx(strip_force(angle), rel=0.03)
    assert found.hourglass < 0.05


@pytest.mark.parametrize("ratio", [1e3, 1e2])
def test_yarns_that_stretch(ratio):
    """No net, as a tenth and a quarter of the angle goes into stretch: within 3 % of squares of 2.5 mm."""
    fine = pulled(2.5, ratio, 30.0)
    for size in (10.0, 5.0):
        found = pulled(size, ratio, 30.0)
        assert found.angle == pytest.approx(fine.angle, rel=0.03), size
        assert found.force == pytest.approx(fine.force, rel=0.03), size
        assert found.hourglass < 0.05, size


@pytest.mark.parametrize("size", [10.0, 5.0])
def test_squares_along_the_yarns(size):
    """The net of the same squares, whose jagged edges take some of its area."""
    found, force = pulled_along_yarns(size, 1e4, 30.0)
    assert found.angle == pytest.approx(30.0, rel=0.03)
    assert found.force == pytest.approx(force, rel=0.03)
    assert found.hourglass < 0.05


def test_uneven_squares_along_the_yarns():
    """Sides that lean by some 8 deg against yarns that go past them: as the even ones within 3 %."""
    found, force = pulled_along_yarns(10.0, 1e4, 30.0, shaken=1.5)
    assert found.angle == pytest.approx(30.0, rel=0.03)
    assert found.force == pytest.approx(force, rel=0.03)
    assert found.hourglass < 0.05
