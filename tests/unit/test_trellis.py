"""Eq. 1 of Pham et al. (2019) and its inverse against the diagonal of a rhombus."""

import numpy as np
import pytest

from knittest.materials.trellis import crosshead, frame_angle


@pytest.mark.parametrize("side", [50.0, 216.0])
@pytest.mark.parametrize("degrees", [0.0, 1.0, 30.0, 60.0, 90.0])
def test_the_crosshead_lengthens_the_diagonal_of_the_rhombus(degrees, side):
    """Two sides that meet at the upper hinge lie at +-(90 deg - angle) / 2 to the pulled diagonal."""
    half = np.deg2rad(90.0 - degrees) / 2.0
    one, other = (side * np.array([np.sin(sign * half), np.cos(half)]) for sign in (1.0, -1.0))
    travel = float(np.linalg.norm(one + other)) - side * np.sqrt(2.0)
    assert crosshead(np.deg2rad(degrees), side) == pytest.approx(travel, rel=1e-12, abs=1e-10)
    assert frame_angle(travel, side) == pytest.approx(np.deg2rad(degrees), abs=1e-6)
