"""Shells with Poisson coupling: strips contract, bent plates are saddles; what they say of their forces."""

import numpy as np
import pytest
from shell_cases import Solid, Y, grid, solve

from knittest.kernels.shell_state import build_shells
from knittest.pose import Body, linear_laminate

NU = 0.3
CARD = linear_laminate((100.0, 80.0), (4.0, 3.0), 20.0, 1.0, poisson=NU)  # warp along y


def plate() -> tuple[Solid, np.ndarray, np.ndarray]:
    """8 x 12 mm of 2 x 3 shells, its degrees of freedom that are not held in the middle of one side, no load."""
    points, conn = grid(2, 3, 8.0, 12.0)
    solid = Solid(points, build_shells(points, conn, Y), CARD)
    return solid, np.ones((len(points), 6), bool), np.zeros((len(points), 6))


def ends(points: np.ndarray) -> np.ndarray:
    """Share of the width 8 mm that each node at either end along y bears, with the sign of its end."""
    width = np.where(np.isin(points[:, 0], (0.0, 8.0)), 2.0, 4.0)
    return width * (np.isclose(points[:, 1], 12.0).astype(float) - np.isclose(points[:, 1], 0.0))


def test_a_pulled_strip_contracts():
    """e = N / (E t) along, - nu e across: exact, but for turns of the square of it."""
    solid, free, load = plate()
    load[:, 1] = 0.1 * ends(solid.start)
    middle = int(np.flatnonzero((solid.start[:, 0] == 4.0) & (solid.start[:, 1] == 0.0))[0])
    free[:, 2:] = False
    free[middle, :2] = free[middle - 4, 1] = False
    moved = solve(solid, free, np.zeros_like(load), load)
    strain = 0.1 / 100.0
    assert moved[:, 1] == pytest.approx(strain * solid.start[:, 1], abs=1e-8)
    assert moved[:, 0] == pytest.approx(-NU * strain * (solid.start[:, 0] - 4.0), abs=1e-8)


def test_a_bent_plate_is_a_saddle():
    """Moments M on two ends alone: w = M / D (y^2 - nu x^2) / 2 (Timoshenko & Woinowsky-Krieger 1959, 11), exact."""
    solid, free, load = plate()
    curvature = 1e-4
    load[:, 3] = 4.0 * curvature * ends(solid.start)
    x, y = solid.start[:, 0] - 4.0, solid.start[:, 1]
    middle = int(np.flatnonzero((x == 0.0) & (y == 0.0))[0])
    free[:, [0, 1, 5]] = False
    free[middle, 2:5] = False
    moved = solve(solid, free, np.zeros_like(load), load)
    shape = 0.5 * curvature * (y**2 - NU * x**2)
    assert moved[:, 2] == pytest.approx(shape, abs=2e-3 * shape.max())  # tangent to its plane at the held node


def test_forces_and_moments_of_free_contraction():
    """Strained by (e, - nu e) and bent by (k, - nu k): E t e and D k in the warp, nothing in the weft."""
    points, conn = grid(2, 3, 8.0, 12.0)
    body = Body.of_shells(points, conn, CARD, 1e-3, 1.0, warp=Y)
    strain, bend = 2e-3, 1e-4
    body.place(points * np.array([1.0 - NU * strain, 1.0 + strain, 1.0]))
    fields = body.fields()
    assert fields["force_warp"] == pytest.approx(100.0 * strain)
    assert fields["force_weft"] == pytest.approx(0.0, abs=1e-10)
    turn = np.column_stack([bend * points[:, 1], NU * bend * points[:, 0], np.zeros(len(points))])
    body.place(points, turn)
    fields = body.fields()
    assert np.abs(fields["moment_warp"]) == pytest.approx(4.0 * bend, rel=1e-5)
    assert fields["moment_weft"] == pytest.approx(0.0, abs=1e-8)
