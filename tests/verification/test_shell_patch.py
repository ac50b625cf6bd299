"""Patch tests on the irregular mesh of MacNeal & Harder (1985): constant strain states are met exactly."""

import numpy as np
import pytest
from shell_cases import PATCH, PATCH_CONN, Solid, X, grid, linear_laminate, solve

from knittest.kernels.shell_output import shell_fields
from knittest.kernels.shell_state import build_shells

INNER = np.arange(4, 8)


def patch(**changes) -> Solid:
    return Solid(PATCH, build_shells(PATCH, PATCH_CONN, X), linear_laminate(**changes))


def mapped(gradient: np.ndarray) -> np.ndarray:
    """Displacements and turns about the normal (n, 6) of x -> F x, the turns those of R in F = R U."""
    exact = np.zeros((len(PATCH), 6))
    exact[:, :3] = PATCH @ gradient.T - PATCH
    exact[:, 5] = np.arctan2(gradient[1, 0] - gradient[0, 1], gradient[0, 0] + gradient[1, 1])
    return exact


def test_compressed_membrane_patch():
    """Weft at -0.5 %: inner nodes are at rest on x -> F x, though 3 N/mm over a shear stiffness of 0.5 N/mm would kink
    such a sheet.
    """
    solid, exact = patch(), mapped(np.array([[1.01, 0.006, 0.0], [0.02, 0.995, 0.0], [0.0, 0.0, 1.0]]))
    solid.place(exact[:, :3], exact[:, 3:])
    force, moment = solid.forces()
    assert max(np.abs(force[INNER]).max(), np.abs(moment[INNER]).max()) < 1e-11
    assert np.abs(force).max() > 10.0


def test_membrane_patch():
    """Boundary on x -> F x: inner nodes follow and turn with F, strains and forces are those of F (round-off of the
    Newton steps). Corners turned by R of F = R U all round take no energy of drilling.
    """
    gradient = np.array([[1.01, 0.006, 0.0], [0.02, 0.9995, 0.0], [0.0, 0.0, 1.0]])
    exact = mapped(gradient)
    start = exact.copy()
    start[INNER] = 0.0
    solid = patch()
    free = np.zeros((len(PATCH), 6), bool)
    free[np.ix_(INNER, (0, 1, 5))] = True
    found = solve(solid, free, start, np.zeros_like(start))
    assert np.abs(found - exact).max() < 1e-8
    warp, weft = gradient[:, 0], gradient[:, 1]
    strain_a, strain_b = np.linalg.norm(warp) - 1.0, np.linalg.norm(weft) - 1.0
    angle = np.arcsin(warp @ weft / ((1.0 + strain_a) * (1.0 + strain_b)))
    expected = [strain_a, strain_b, angle, 900.0 * strain_a, 600.0 * strain_b]
    fields = shell_fields(len(PATCH_CONN), solid.nodes, solid.shells, solid.laminate)
    assert fields == pytest.approx(np.repeat(np.array(expected)[:, None], 5, axis=1), rel=1e-7)
    area = 24.0 * 12.0
    energy = area * 0.5 * (900.0 * strain_a**2 + 600.0 * strain_b**2 + 0.5 * angle**2)
    assert solid.energy() == pytest.approx(energy, rel=1e-9)


def test_no_hidden_mechanism():
    """A free square of 3 x 3 shells has exactly the rigid motions at zero stiffness."""
    position, conn = grid(3, 3, 15.0, 15.0)
    solid = Solid(position, build_shells(position, conn, X), linear_laminate())
    stiffness = solid.tangent()
    assert np.abs(stiffness - stiffness.T).max() < 1e-6 * np.abs(stiffness).max()
    values = np.sort(np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T)))
    assert np.abs(values[:6]).max() < 1e-5
    assert values[6] > 1e-4
