"""The limits of shells and tools that ``docs/limits.md`` states, so that its numbers stay true."""

import pytest
from cases import shell_limits as case


@pytest.mark.parametrize("shape", ["rectangles", "parallelograms", "trapezoids"])
def test_irregular_bending(shape):
    """Two rows of 12: 1 / (4 n^2) of one-point bending, and as much again for sides that lean by 0.4."""
    (row,) = case.irregular_cantilever(shape)
    assert abs(row.error) < 2.0 / (4.0 * 12**2)


def test_single_row_is_soft():
    """The directors' hourglass pattern relieves transverse shear at the ends of a single row, but not of two."""
    (row,) = case.irregular_cantilever("rectangles", 24, 1)
    assert 0.015 < row.error < 0.03


def test_turns_about_the_normal_are_held_by_the_fibres():
    """Pure twist to what a mesh of 8 x 8 gives whether they are held or not; 19 % too soft when nothing holds them."""
    errors = [case.free_drilling(held)[0].error for held in (True, False)]
    assert all(abs(error) < 3e-3 for error in errors)
    assert errors[0] == pytest.approx(errors[1], abs=1e-3)


def test_penetration():
    """p dt^2 / (0.4 m'), to the tolerance of the relaxation."""
    (row,) = case.penetration()
    assert abs(row.error) < 1e-6


def test_friction_has_no_lever():
    pull, moment = case.friction_lever()
    assert abs(pull.error) < 5e-3
    assert moment.result < 0.1 * moment.reference


def test_bending_in_the_plane_needs_rows():
    """1 / rows^2 of the stiffness against bending is missing, but for 5 % of it: factors 1 / (1 - 0.95 / rows^2)."""
    errors = [case.hourglass(n)[0].error for n in (2, 4)]
    bending = 2.84e-3 / 2.94e-3
    assert errors[0] == pytest.approx(bending * (1.0 / (1.0 - 0.95 / 4.0) - 1.0), rel=0.1)
    assert errors[1] == pytest.approx(bending * (1.0 / (1.0 - 0.95 / 16.0) - 1.0), rel=0.1)


def test_normal_jumps_deep_in_a_plate():
    assert case.deep_corner()[0].result == pytest.approx(2.0**0.5)
