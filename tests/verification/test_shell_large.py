"""Curved shells that bend far and snap through, on meshes no finer than the tables'; see :mod:`cases.shell_large`."""

import pytest
from cases import shell_large as case


def test_pull_out():
    """Within 5 % on the mesh of the table: it bends, then stretches."""
    assert all(abs(row.error) < 0.05 for row in case.pull_out())


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_semicylinder(share):
    """Within 5 % on 32 x 32, while it snaps and after; with turns about y free at its sides 10 %, and as a hinge."""
    assert abs(case.semicylinder(share, 32)[0].error) < 0.05


@pytest.mark.parametrize("thickness", case.LIMITS)
def test_hinged_roof(thickness):
    """Limit load within 2 % on 8 x 8 a quarter: 40 % too low where corners may spin about their normals."""
    assert abs(case.hinged_roof(thickness, 8)[0].error) < 0.02
