"""Hinge tables, their energies and the vectorisable arc sine, against numpy's interpolation and functions."""

import numpy as np
import pytest
from plain import plain

from knittest.kernels.laws import hinge_energy, hinge_force, hinge_table, odd_hinge_energy, odd_hinge_force
from knittest.kernels.shell import arcsine

STRAIN = np.array([0.0, 0.004, 0.009, 0.015, 0.02])
FORCE = np.array([0.0, 10.0, 60.0, 90.0, 180.0])


def total(law, strain: float) -> float:
    return sum(law(strain, knee, slope) for knee, slope in zip(*hinge_table(STRAIN, FORCE), strict=True))


def test_hinges_join_the_points():
    """A hinge sum is piecewise linear: it equals linear interpolation, and goes on with the last tangent."""
    for strain in np.linspace(0.0, 0.02, 101):
        assert total(plain(hinge_force), strain) == pytest.approx(np.interp(strain, STRAIN, FORCE), abs=1e-12)
    assert total(plain(hinge_force), 0.03) == pytest.approx(180.0 + 0.01 * 90.0 / 0.005)
    assert total(plain(hinge_force), -0.01) == 0.0


@pytest.mark.parametrize("strain", [-0.01, 0.003, 0.009, 0.0171, 0.03])
def test_energy_is_the_integral_of_the_force(strain):
    e = np.linspace(0.0, strain, 20001)
    area = np.trapezoid([total(plain(hinge_force), v) for v in e], e)
    assert total(plain(hinge_energy), strain) == pytest.approx(area, rel=1e-7, abs=1e-15)


@pytest.mark.parametrize("strain", [0.001, 0.006, 0.018])
def test_odd_law_mirrors(strain):
    assert total(plain(odd_hinge_force), strain) == pytest.approx(np.interp(strain, STRAIN, FORCE))
    assert total(plain(odd_hinge_force), -strain) == pytest.approx(-total(plain(odd_hinge_force), strain), rel=1e-14)
    assert total(plain(odd_hinge_energy), -strain) == pytest.approx(total(plain(hinge_energy), strain), rel=1e-14)


def test_arcsine_is_accurate_to_the_last_digits():
    """Within 3 units in the last place of numpy's, odd, and closed at +-1; beyond 1 it stays at pi / 2."""
    s = np.concatenate([np.linspace(-1.0, 1.0, 4001), 10.0 ** np.arange(-12.0, 0.0), [np.nextafter(0.5, 0.0), 0.5]])
    found = np.array([arcsine.py_func(v) for v in s])
    assert np.abs(found - np.arcsin(s)).max() <= 3.0 * np.spacing(0.5 * np.pi)
    assert np.array_equal(found, -np.array([arcsine.py_func(-v) for v in s]))
    assert found[s == 1.0] == pytest.approx(0.5 * np.pi, abs=1e-15)
    assert arcsine.py_func(1.0 + 1e-12) == pytest.approx(0.5 * np.pi, abs=1e-15)
