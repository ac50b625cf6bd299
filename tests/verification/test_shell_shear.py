"""Trellis shear: the law S(gamma) is work-conjugate to the shear angle, F dd = S L^2 dgamma."""

import numpy as np
import pytest
from shell_cases import Solid, X, grid, linear_laminate

from knittest.kernels.shell_state import build_shells

SIDE = 200.0


def frame(laminate, n: int = 4) -> Solid:
    position, conn = grid(n, n, SIDE, SIDE)
    return Solid(position, build_shells(position, conn, X), laminate)


def trellis(position: np.ndarray, gamma: float) -> np.ndarray:
    """Sides of constant length at the angle pi/2 - gamma, closing towards the diagonal x = y."""
    c, s = np.cos(0.5 * gamma), np.sin(0.5 * gamma)
    return position @ np.array([[c, s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def crosshead_force(solid: Solid, gamma: float) -> float:
    """Force [N] of the crosshead along the diagonal, from the nodal forces by virtual work with dd/dgamma."""
    solid.place(trellis(solid.start, gamma) - solid.start)
    force, _ = solid.forces()
    h = 1e-6
    path = (trellis(solid.start, gamma + h) - trellis(solid.start, gamma - h)) / (2.0 * h)
    power = -float((force * path).sum())
    # d = sqrt(2) L (...): Eq. 1 of Pham et al. (2019), gamma = pi/2 - 2 acos((sqrt(2) L + d) / (2 L))
    return power / (SIDE * np.sin(0.25 * np.pi - 0.5 * gamma))


def table(gamma: float) -> float:
    """S [N/mm] of the tabulated law below, odd."""
    return float(np.sign(gamma) * np.interp(abs(gamma), [0.0, 0.3, 0.6, 1.2], [0.0, 0.06, 0.18, 0.9]))


TABULATED = {"shear_knee": np.array([0.0, 0.3, 0.6]), "shear_slope": np.array([0.2, 0.2, 0.8])}


@pytest.mark.parametrize("gamma", [-0.8, -0.2, 0.01, 0.35, 0.7, 1.1])
@pytest.mark.parametrize("law", ["linear", "table"])
def test_frame_force(gamma, law):
    """F = S L / sin(pi/4 - gamma/2) with inextensible fibres, exact to round-off."""
    solid = frame(linear_laminate(**(TABULATED if law == "table" else {})))
    stress = 0.5 * gamma if law == "linear" else table(gamma)
    expected = stress * SIDE / np.sin(0.25 * np.pi - 0.5 * gamma)
    assert crosshead_force(solid, gamma) == pytest.approx(expected, rel=1e-7)


def test_energy_is_the_work_of_the_crosshead():
    """The energy stored up to gamma is L^2 times the area under S(gamma)."""
    solid = frame(linear_laminate(**TABULATED))
    for gamma in (0.25, 0.5, 1.0):
        g = np.linspace(0.0, gamma, 20001)
        area = np.trapezoid([table(v) for v in g], g)
        solid.place(trellis(solid.start, gamma) - solid.start)
        assert solid.energy() == pytest.approx(SIDE**2 * area, rel=1e-6)


def test_simple_shear_stretches_the_fibre_that_turns():
    """x -> x + k y: the warp keeps its length, the weft becomes sqrt(1 + k^2) long, tan(gamma) = k."""
    solid = frame(linear_laminate(drilling=0.0))  # nodes keep their turns
    k = 0.3
    solid.place(solid.start[:, [1]] * [[k, 0.0, 0.0]])
    strain, angle = np.sqrt(1.0 + k**2) - 1.0, np.arctan(k)
    energy = SIDE**2 * (0.5 * 600.0 * strain**2 + 0.25 * angle**2)
    assert solid.energy() == pytest.approx(energy, rel=1e-10)
