"""Static shells posed through the public interface against closed forms; see :mod:`cases.shell_static`."""

import pytest
from cases import shell_static as case


def test_rigid_rotation():
    """Round-off: some hundred operations of 1e-16."""
    assert case.rigid_rotation()[0].result < 1e-13


def test_membrane_patch():
    """Residual 1e-6 of the relaxation; the energy is stationary, so its error is the square."""
    moved, energy = case.membrane_patch()
    assert abs(moved.error) < 1e-6
    assert abs(energy.error) < 1e-9


def test_bending_patch():
    """Curvature 1e-5 / mm: the stretch by slopes adds at most 2e-4 to the energy, and to the deflection."""
    assert all(abs(row.error) < 2e-4 for row in case.bending_patch())


@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_cantilever(direction):
    """20 elements, off by 1 / (4 n^2) = 6e-4 of bending and 2e-5 of shear; the tip feels at most twice that."""
    for row in case.cantilever(direction):
        assert abs(row.error) < 2.0 / (4.0 * 20**2)
        assert row.order == pytest.approx(2.0, abs=0.15)


def test_twisted_strip():
    """Edge layer of width 1 / sqrt(K / T) on elements a third of it: (h / 0.52 mm)^2 / 12 = 9e-3 of its 26 %."""
    (row,) = case.twisted_strip(0.05)
    assert abs(row.error) < 2e-3
    assert row.order > 1.8


def test_twisted_strip_stretches_its_edges():
    """The helix term is a tenth; reference for small slopes, here 0.05, squared 2.5e-3."""
    (row,) = case.twisted_strip(0.2)
    assert abs(row.error) < 2.5e-3


def test_pinched_ring():
    """16 elements a quadrant: facets and one point of bending, each below (pi / 2 / 16)^2."""
    (row,) = case.pinched_ring()
    assert abs(row.error) < 9.6e-3
    assert row.order == pytest.approx(2.0, abs=0.15)


def test_layers():
    """A leaves D and D leaves A: ten times the residual of the relaxation."""
    tension, tension_stiff, sag, sag_stiff = case.layers()
    assert tension.result == pytest.approx(tension_stiff.result, rel=1e-9)
    assert sag.result == pytest.approx(sag_stiff.result, rel=1e-5)
    assert abs(tension.error) < 1e-9
    assert abs(sag.error) < 1e-5


@pytest.mark.parametrize("gamma", [0.2, 0.5, 0.8])
def test_picture_frame(gamma):
    """Tables of 1000 knots: relative error of the path (T / 1000)^2 / 12 of its second derivative, below 1e-6."""
    assert all(abs(row.error) < 1e-6 for row in case.picture_frame(gamma))
