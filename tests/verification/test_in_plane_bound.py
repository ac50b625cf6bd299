"""Row sums of the stiffness of bending in the plane, in plain Python: their formula, and that it is a bound.

A stencil and a fibre store c (k - k0)^2 / 2, so the stiffness between two members is c (dk dk' + (k - k0) d2k).
"""

import numpy as np
import pytest
from plain import plain
from shell_cases import grid

from knittest.kernels.in_plane import BLOCK, WEIGHTS, add_bounds, curvature
from knittest.kernels.shell_state import build_shells
from knittest.models.in_plane import bend_bound, bend_bound_now, build_bends


def vectors(weight: np.ndarray, place: np.ndarray, family: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Fibre a, the other fibre b and the second derivative of a: sums of ``weight`` (members, 4) times ``place``."""
    fibres = weight.T @ place
    return fibres[family], fibres[1 - family], fibres[2 + family]


def bounds(weight: np.ndarray, place: np.ndarray, family: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Bounds of dk (members,) [1/mm^2] and of d2k (members, members) [1/mm^3], and the curvature k [1/mm]."""
    a, b, second = vectors(weight, place, family)
    part, length = b - (a @ b) / (a @ a) * a, np.linalg.norm(a)
    m, normal = part / np.linalg.norm(part), np.cross(a, b) / np.linalg.norm(np.cross(a, b))
    own, other, u = (np.abs(weight[:, row]) for row in (family, 1 - family, 2 + family))
    about = (other + abs(a @ b) / (a @ a) * own) / np.linalg.norm(part)
    towards = own / length
    v = about + towards
    first = u + about * abs(second @ normal) + towards * abs(second @ a) / length
    return first, np.outer(u, v) + np.outer(v, u) + 3.0 * np.linalg.norm(second) * np.outer(v, v), float(second @ m)


@pytest.fixture
def bends():
    """Yarns at a slant in 5 x 4 uneven shells, each stencil with its natural curvature; every fourth one is broken."""
    points, cells = grid(5, 4, 10.0, 8.0)
    rng = np.random.default_rng(4)
    points[:, :2] += rng.uniform(-0.2, 0.2, (len(points), 2))
    made = build_bends(points, cells, build_shells(points, cells, np.array([0.9, 0.5, 0.0])), np.array([4.2, 1.7]))
    made.natural[:] = rng.normal(0.0, 2.0, made.natural.shape)
    made.alive[np.flatnonzero(made.alive)[::4]] = 0.0
    return made, points + rng.normal(0.0, 0.4, points.shape)


def test_row_sums_are_those_of_the_bounds_of_each_pair_of_members(bends):
    made, place = bends
    weight, expected = made.weight.reshape(-1, WEIGHTS, BLOCK), np.zeros(len(place))
    assert made.alive.sum() > 2
    for s in np.flatnonzero(made.alive):
        block, lane = divmod(int(s), BLOCK)
        rows = slice(made.first[block], made.first[block + 1])
        members, own = made.member[rows, lane], weight[rows, :, lane]
        for family in (0, 1):
            first, second, k = bounds(own, place[members], family)
            pairs = np.outer(first, first) + abs(k - made.natural[family, s]) * second
            np.add.at(expected, members, made.stiffness[family, s] * pairs.sum(axis=1))
    found = np.zeros(len(place))
    plain(add_bounds)(place.T.copy(), made, found)
    assert found == pytest.approx(expected, rel=1e-12) and expected.max() > 0.0


def test_no_derivative_of_the_curvature_is_above_its_bound():
    """Four members with any weights, by central differences; some states reach 98 and 40 % of the bounds."""
    rng, h, nearest = np.random.default_rng(7), 1e-4, np.zeros(2)
    for number in range(400):
        family, weight, place = number % 2, rng.normal(size=(4, WEIGHTS)), rng.normal(size=(4, 3))
        weight *= rng.uniform(size=weight.shape) < 0.6  # members of one fibre alone, as on meshes along the yarns
        a, b, second = vectors(weight, place, family)
        if (
            np.linalg.norm(np.cross(a, b)) < 0.3 * np.linalg.norm(a) * np.linalg.norm(b)
            or min(a @ a, b @ b, second @ second) < 0.3
        ):
            continue  # sheared by more than 72 degrees, where differences lose their digits
        first, both, k = bounds(weight, place, family)

        def at(*moves: tuple[int, float], weight=weight, place=place, family=family) -> float:
            moved = place.copy()
            for one, by in moves:
                moved[one // 3, one % 3] += by
            return plain(curvature)(*(tuple(v) for v in vectors(weight, moved, family)))

        assert at() == pytest.approx(k)
        slope = np.array([at((i, h)) - at((i, -h)) for i in range(12)]) / (2.0 * h)
        bent = np.array([
            [at((i, h), (j, h)) - at((i, h), (j, -h)) - at((i, -h), (j, h)) + at((i, -h), (j, -h)) for j in range(12)]
            for i in range(12)
        ]) / (4.0 * h * h)  # fmt: skip
        found = np.linalg.norm(slope.reshape(4, 3), axis=1)
        pairs = np.linalg.norm(bent.reshape(4, 3, 4, 3), ord=2, axis=(1, 3))
        assert (found <= first + 1e-6).all() and (pairs <= both + 1e-5 * both.max()).all()
        nearest = np.maximum(nearest, [found.sum() / first.sum(), pairs.sum() / both.sum()])
    assert (nearest > [0.98, 0.4]).all(), nearest


def test_the_bound_is_the_largest_row_over_its_mass_and_names_its_node(bends):
    """Nodes without mass are held, as at rest."""
    made, place = bends
    rows, mass = np.zeros(len(place)), np.linspace(1.0, 3.0, len(place))
    plain(add_bounds)(place.T.copy(), made, rows)
    held = int((rows / mass).argmax())
    mass[held] = 0.0
    over = np.where(mass > 0.0, rows / np.where(mass > 0.0, mass, 1.0), 0.0)
    assert bend_bound_now(made, place.T.copy(), mass) == (pytest.approx(over.max()), over.argmax())
    assert np.isfinite(bend_bound(made, mass)) and bend_bound(made, 2.0 * mass) == pytest.approx(
        0.5 * bend_bound(made, mass)
    )


def test_at_rest_in_a_plane_both_bounds_are_the_same():
    """Warps at a slant, wefts the stiffer ones: the bound at rest counts both."""
    points, cells = grid(4, 4, 8.0, 8.0)
    made = build_bends(points, cells, build_shells(points, cells, np.array([0.9, 0.5, 0.0])), np.array([1.7, 4.2]))
    mass = np.full(len(points), 3.3e-3)
    assert bend_bound_now(made, points.T.copy(), mass)[0] == pytest.approx(bend_bound(made, mass))
