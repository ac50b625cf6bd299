"""Shapes of rigid tools; see :mod:`cases.tool_shapes`."""

import pytest
from cases import tool_shapes as case


def test_sampled_sphere():
    """Interpolation error h^2 / (4 r) at most, r >= 2.5 mm; of the normal h / 2 sqrt(sum |f,ij|^2) ~ h / r."""
    distance, normal = case.sampled_sphere()
    assert distance.result < 0.1**2 / (4.0 * 2.5)
    assert distance.order == pytest.approx(2.0, abs=0.2)
    assert normal.result < 0.1 / 2.5
    assert normal.order == pytest.approx(1.0, abs=0.2)


def test_contact_forces_are_the_gradient_of_an_energy():
    """Central differences of 1e-6 mm: rounding of the energy, 1e-16 / 1e-6, times some hundred."""
    assert all(abs(row.error) < 1e-8 for row in case.contact_gradients())


def test_rounded_edge():
    """The normal turns no faster than on the circle; steps of 1e-3 mm leave (ds / r)^2 / 24."""
    turn, whole, distance = case.rounded_edge()
    assert abs(turn.error) < 1e-6
    assert abs(whole.error) < 1e-6
    assert distance.error == pytest.approx(0.0, abs=1e-12)
