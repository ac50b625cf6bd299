"""Cantilevers of shells against beam theory; without Poisson coupling D is the beam's stiffness per width."""

import numpy as np
import pytest
from shell_cases import Solid, X, Y, grid, linear_laminate, solve

from knittest.kernels.shell_state import build_shells

LENGTH, WIDTH = 100.0, 10.0
#: D of the linear laminate in warp and weft [N mm]
D = {"warp": 2.0 * 2.0 * 1.1**2, "weft": 2.0 * 1.5 * 1.1**2}


def cantilever(n: int, direction: str, load: float, steps: int = 1, **changes) -> tuple[np.ndarray, Solid]:
    """Strip along x under an end force ``load`` [N] in z: displacements and rotations (nodes, 6)."""
    position, conn = grid(n, 1, LENGTH, WIDTH)
    solid = Solid(position, build_shells(position, conn, X if direction == "warp" else Y), linear_laminate(**changes))
    free = np.zeros((solid.n, 6), bool)
    free[2:, [0, 2, 4]] = True
    force = np.zeros((solid.n, 6))
    force[-2:, 2] = 0.5 * load
    return solve(solid, free, np.zeros((solid.n, 6)), force, steps), solid


def test_elastica_under_end_force():
    """P L^2 / (D b) = 2 and 5: tip at w/L = 0.49346 and 0.71379, u/L = 0.16064 and 0.38763 (Mattiasson, 1981).

    Transverse shear is stiffened out of the way; the rest is the O(1 / (4 n^2)) of 20 elements.
    """
    for alpha, w, u in ((2.0, 0.49346, 0.16064), (5.0, 0.71379, 0.38763)):
        load = alpha * D["warp"] * WIDTH / LENGTH**2
        found, _ = cantilever(20, "warp", load, steps=5, transverse=np.array([400.0, 400.0]))
        assert found[-1, 2] / LENGTH == pytest.approx(w, rel=2e-3)
        assert -found[-1, 0] / LENGTH == pytest.approx(u, rel=4e-3)


def test_roll_up_by_end_moment():
    """End moment M = 2 pi D b / L bends the strip into a full circle: the tip returns to the root."""
    n = 24
    position, conn = grid(n, 1, LENGTH, WIDTH)
    solid = Solid(position, build_shells(position, conn, X), linear_laminate())
    radius = LENGTH / (2.0 * np.pi)
    angle = position[:, 0] / radius
    chord = radius * 2.0 * np.pi / n / (2.0 * np.sin(np.pi / n))  # polygon with the sides of the elements
    shift = np.zeros_like(position)
    shift[:, 0] = chord * np.sin(angle) - position[:, 0]
    shift[:, 2] = chord * (1.0 - np.cos(angle))
    turn = np.zeros_like(position)
    turn[:, 1] = -angle
    solid.place(shift, turn)
    force, moment = solid.forces()
    assert np.abs(force).max() < 1e-10
    assert np.abs(moment[2:-2]).max() < 1e-10
    # directors of an element of the polygon differ by the chord of 2 pi / n
    bend = 2.0 * np.sin(np.pi / n) / (LENGTH / n)
    assert moment[-2:, 1].sum() == pytest.approx(D["warp"] * WIDTH * bend * np.cos(np.pi / n), rel=1e-9)
    assert bend * np.cos(np.pi / n) == pytest.approx(1.0 / radius, rel=2.0 * np.pi**2 / (3.0 * n**2) * 1.1)
