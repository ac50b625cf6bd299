"""Hourglass control of the membrane against what a fully integrated element stores: plain Python, no compiling."""

import numpy as np
import pytest
from shell_cases import X, linear_laminate
from test_plain_shell import PlainSolid

from knittest.kernels.shell_state import ALONG_A, ALONG_B, LEAN_A, LEAN_B, build_shells
from knittest.materials.laminate import HOURGLASS_SHEAR, hourglass_of_shear
from knittest.models import sections
from knittest.models.in_plane import element_rows, highest_stiffness

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
ONE = np.array([[0, 1, 2, 3]])
PATTERN = np.array([1.0, -1.0, 1.0, -1.0])
GAUSS = 0.5 / 3.0**0.5


def at(angle: float) -> np.ndarray:
    """Direction at ``angle`` [deg] in the plane."""
    return np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle)), 0.0])


def shares(corners: np.ndarray, angle: float) -> np.ndarray:
    """Shape factors of a shell whose warp lies at ``angle`` [deg]: stretch of warp, weft, shear by warp, weft."""
    row = element_rows(build_shells(corners, ONE, at(angle)), 1)
    return np.array([row(r)[0] for r in (ALONG_A, ALONG_B, LEAN_A, LEAN_B)])


def integrated(corners: np.ndarray, angle: float) -> np.ndarray:
    """The same without shares of leaning fibres: 12 times the integral of the squared strain by four points, of a unit
    of the pattern along the fibre.
    """
    side, up = corners[1] - corners[0], corners[3] - corners[0]
    inverse, area = np.linalg.inv(np.column_stack([side[:2], up[:2]])), np.linalg.norm(np.cross(side, up))
    fibres = inverse @ np.column_stack([at(angle), at(angle + 90.0)])[:2]
    total = np.zeros(4)
    for xi in (-GAUSS, GAUSS):
        for eta in (-GAUSS, GAUSS):
            warp, weft = np.array([eta, xi]) @ fibres  # of u = p xi eta, along the fibres
            total += 3.0 * area * np.array([warp, weft, weft, warp]) ** 2
    return total


@pytest.mark.parametrize("size", [(3.0, 3.0), (2.0, 5.0)])
def test_fibres_along_the_sides_are_those_of_the_full_element(size):
    """(p . a)^2 b / (24 a) E: sides that stretch against each other, as in bending in the plane. Shear has no part."""
    corners = SQUARE * [*size, 1.0]
    for angle in (0.0, 90.0):
        assert shares(corners, angle)[:2] == pytest.approx(integrated(corners, angle)[:2])
        assert shares(corners, angle)[2:] == pytest.approx(0.0, abs=1e-9)
    assert shares(corners, 0.0)[0] == pytest.approx(size[1] / size[0])


@pytest.mark.parametrize("size", [(3.0, 3.0), (2.0, 5.0), (1.0, 4.0)])
def test_fibres_at_45_degrees_are_held_by_shear_alone(size):
    """In squares and rectangles: their stretch would vary along them."""
    corners = SQUARE * [*size, 1.0]
    assert shares(corners, 45.0)[:2] == pytest.approx(0.0, abs=1e-12)
    assert shares(corners, 45.0)[2:] == pytest.approx(integrated(corners, 45.0)[2:])


def test_leaning_fibres_fade_out():
    """By 1 / e at half a degree of a square, and shear takes what is left; warp and weft do the same."""
    for angle in (0.0, 0.25, 0.5, 2.0, 20.0, 45.0, 90.5):
        along = np.exp(-((0.5 * np.sin(2.0 * np.deg2rad(angle)) / np.deg2rad(0.5)) ** 2))
        assert shares(3.0 * SQUARE, angle) == pytest.approx([along, along, 1.0 - along, 1.0 - along])


def test_a_sheared_shell_follows_its_leaning_side():
    """Warp along one side of a parallelogram: the weft leans against the other by its slant."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1.5, 1, 0], [0.5, 1, 0]])
    found, full = shares(corners, 0.0), integrated(corners, 0.0)
    assert found[0] == pytest.approx(full[0])
    assert found[1] < 0.3 * full[1]
    assert found[2] == pytest.approx(0.0, abs=1e-12)


def energy_of(pattern: np.ndarray, warp: np.ndarray, size: float = 1.0, **changes) -> float:
    """Energy [mJ] of a square with its corners moved by a quarter of the hourglass ``pattern`` (3,) [mm]."""
    solid = PlainSolid(size * SQUARE, build_shells(size * SQUARE, ONE, warp), linear_laminate(**changes))
    solid.place(np.outer(0.25 * PATTERN, pattern))
    return solid.energy()


@pytest.mark.parametrize("size", [1.0, 4.0])
def test_energy_of_sides_that_stretch(size):
    """Warp sides longer and shorter by p / 2: k p^2 / 2 with the stiffness of the warp, whatever the size and weft."""
    card = {"hourglass_fibre": np.array([3.0, 8.0]), "hourglass_shear": 0.25}
    p = 1e-3
    assert energy_of(p * X, X, size, **card) == pytest.approx(1.5 * p**2, rel=1e-6)
    assert energy_of(p * at(90.0), X, size, **card) == pytest.approx(4.0 * p**2, rel=1e-6)
    assert energy_of(p * X, at(90.0), size, **card) == pytest.approx(4.0 * p**2, rel=1e-6)


def test_diagonals_of_a_net_shift_for_the_price_of_shear():
    """Yarns along the diagonals, each free to move past the other: k p^2 / 2 of the shear, however stiff the yarns."""
    for fibre in (3.0, 3e5):
        card = {"hourglass_fibre": np.full(2, fibre), "hourglass_shear": 0.25}
        assert energy_of(np.array([1e-3, 0.0, 0.0]), at(45.0), 2.0, **card) == pytest.approx(0.125e-6, rel=1e-6)


def test_control_of_leaning_fibres_follows_shear():
    """Six times the full element's shear, at most the share of the fibres that holds elsewhere; none without either."""
    stretch = np.array([900.0, 700.0])
    assert hourglass_of_shear(0.05, stretch, 0.1) == pytest.approx(HOURGLASS_SHEAR * 0.1 / 12.0)
    assert hourglass_of_shear(0.05, stretch, 300.0) == pytest.approx(0.05 * 800.0 / 12.0)
    assert hourglass_of_shear(0.0, stretch, 0.1) == hourglass_of_shear(0.05, stretch, 0.0) == 0.0
    card = sections.linear_laminate((900.0, 700.0), (1.0, 1.0), 0.1, 1.0)
    assert card.hourglass_shear == pytest.approx(0.05)
    assert card.hourglass_fibre == pytest.approx(0.05 * stretch / 12.0)


@pytest.mark.parametrize("angle", [0.0, 45.0, 17.0])
def test_the_bound_of_the_step_holds_the_pattern(angle):
    """Along one fibre the pattern is as stiff as 4 k of it, and fibres that shear closes add: the bound is of both."""
    card = linear_laminate(
        1e-6, 1e-6, hourglass_fibre=np.array([3.0, 5.0]), hourglass_shear=2.0, outer=np.zeros(2),
        shear_slope=np.zeros(1), transverse=np.zeros(2), hourglass_transverse=0.0, drilling=0.0,
    )  # fmt: skip
    shells = build_shells(2.0 * SQUARE, ONE, at(angle))
    share = shares(2.0 * SQUARE, angle)
    both = float(share[:2] @ card.hourglass_fibre + 2.0 * share[2:].sum())
    assert highest_stiffness(card, 2.0 * SQUARE, ONE, shells)[0][0] == pytest.approx(4.0 * both, rel=1e-3)
