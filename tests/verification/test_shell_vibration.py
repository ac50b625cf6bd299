"""Bending vibrations of a strip of shells: what their raised rotary inertia slows, against that of the plate."""

import numpy as np
import pytest
from scipy.linalg import eigh
from shell_cases import Solid, grid, linear_laminate

from knittest.models.macro import build_sheet

LENGTH, WIDTH, AREA_MASS, THICKNESS = 100.0, 10.0, 1e-3, 1.0
CARD = linear_laminate(100.0, 100.0, layer_offset=0.5, outer=np.array([10.0, 10.0]), transverse=np.array([25.0, 25.0]))
#: circular frequencies of a clamped-free beam are these over L^2 times sqrt(D / m') (Clough & Penzien, 1993)
ROOTS = (1.875104, 4.694091, 7.854757)


def frequencies(columns: int, rows: int, raised: bool) -> np.ndarray:
    """The first three [rad/ms] of bending of a cantilever over those of the beam, by the tangent of its shells.

    With the model's rotary inertia (``raised``), or that of the plate, t^2 / 12 of its mass.
    """
    position, conn = grid(columns, rows, LENGTH, WIDTH)
    model = build_sheet(position, conn, CARD, AREA_MASS, THICKNESS, (1.0, 0.0, 0.0))
    solid = Solid(position, model.shells, model.laminate)
    side = rows + 1
    bending = np.array([2, 4])  # z and the turn about y; the others stand
    index = np.array([(i, j) for i in range(side, solid.n) for j in bending])
    stiffness = np.empty((len(index), len(index)))
    for k, (i, j) in enumerate(index):
        forces = []
        for step in (1e-6, -1e-6):
            u = np.zeros((solid.n, 6))
            u[i, j] = step
            solid.place(u[:, :3], u[:, 3:])
            forces.append(np.hstack(solid.forces())[index[:, 0], index[:, 1]])
        stiffness[:, k] = (forces[1] - forces[0]) / 2e-6
    inertia = model.inertia if raised else model.mass * THICKNESS**2 / 12.0
    mass = np.where(index[:, 1] == 2, model.mass[index[:, 0]], inertia[index[:, 0]])
    values, shapes = eigh(0.5 * (stiffness + stiffness.T), np.diag(mass))
    along = np.array([np.abs(shapes[index[:, 1] == 2, k].sum()) for k in range(len(values))])
    even = values[along > 1e-3 * along.max()][:3]  # modes that do not sway across the strip
    density = CARD.outer[0] * 2.0 * CARD.layer_offset**2 / AREA_MASS
    exact = np.array([(root / LENGTH) ** 2 * density**0.5 for root in ROOTS])
    return np.sqrt(even) / exact


def test_the_plate_vibrates_as_a_beam():
    """Within 0.2 % at 20 x 2 with the inertia of the plate: the stiffness is right, the raised inertia alone slows."""
    assert frequencies(20, 2, raised=False) == pytest.approx(np.ones(3), abs=2e-3)


def test_raised_inertia_slows_higher_vibrations():
    """As docs/limits.md states: 1, 7, 14 % at 20 x 2, and less than a third of that on shells of half the size."""
    coarse, fine = (1.0 - frequencies(*mesh, raised=True) for mesh in ((20, 2), (40, 4)))
    assert coarse == pytest.approx([0.011, 0.066, 0.138], abs=2e-3)
    assert (fine < coarse / 3.0).all()


def test_raised_inertia_slows_as_rayleighs_beam():
    """f / sqrt(1 + (r k)^2), r the radius of gyration of a node and k the root over the length, within 3 %: a strip
    of half waves between hinges would follow it exactly.
    """
    position, conn = grid(20, 2, LENGTH, WIDTH)
    model = build_sheet(position, conn, CARD, AREA_MASS, THICKNESS, (1.0, 0.0, 0.0))
    gyration2 = float((model.inertia / model.mass).max())
    expected = [(1.0 + gyration2 * (root / LENGTH) ** 2) ** -0.5 for root in ROOTS]
    assert frequencies(20, 2, raised=True) == pytest.approx(expected, rel=0.03)
