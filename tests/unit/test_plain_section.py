"""Elliptic sections against an independent solver and geometry, in plain Python: distance, normal, curvature."""

from functools import partial
from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from contact_cases import derivative
from plain import plain
from scipy.optimize import minimize

from knittest.kernels.section import closest_sections, rounding, support

UP = np.array([0.0, 0.0, 1.0])
WIDE, NARROW, ROUND = (1.05, 0.4), (0.9, 0.46), (0.25, 0.25)


def section(half, axis=UP):
    """Section of the half axes ``half``, its height along ``axis``."""
    return tuple(axis), half[0] ** 2, half[1] ** 2 - half[0] ** 2


def ring(half, along, angle):
    """Point of an elliptic cylinder at ``angle``, from its axis ``along``, the height as upright as it can be."""
    tall = UP - (UP @ along) * along
    tall /= np.linalg.norm(tall)
    return half[0] * cos(angle) * np.cross(tall, along) + half[1] * sin(angle) * tall


def solved(r, u, v, first, second):
    """Distance of two elliptic cylinders, level and so long that their ends do not matter, by their nearest points."""
    along, other = u / np.linalg.norm(u), v / np.linalg.norm(v)

    def square(p):
        one = r + p[0] * along + ring(first, along, p[1])
        gap = one - p[2] * other - ring(second, other, p[3])
        return gap @ gap

    toward = np.arctan2(-r[2], -r @ np.cross(UP, along))
    back = np.arctan2(r[2], r @ np.cross(UP, other))
    starts = [[a, toward + b, c, back + d] for a, b, c, d in np.random.default_rng(0).normal(0.0, 0.4, (2, 4))]
    return sqrt(min(minimize(square, start, method="BFGS", options={"gtol": 1e-10}).fun for start in starts))


@pytest.mark.parametrize("angle", [0.0, 12.0, 70.0])
@pytest.mark.parametrize(("first", "second"), [(WIDE, NARROW), (ROUND, WIDE)])
def test_distance_is_that_of_the_surfaces(angle, first, second):
    """Yarns side by side and crossed, at many offsets, above, beside and aslant: as the nearest points of their
    surfaces, which a search over both finds. Side by side the ends of the segments are beyond each other.
    """
    rng, turn, seen = np.random.default_rng(7), np.deg2rad(angle), 0
    u, v = np.array([40.0, 0.0, 0.0]), 40.0 * np.array([cos(turn), sin(turn), 0.0])
    for lean in rng.uniform(0.05, pi - 0.05, 4):
        away = np.array([0.0, cos(lean), sin(lean)]) * rng.uniform(1.0, 1.4)
        r = away * sum(max(h) for h in (first, second)) - 0.5 * u + 0.5 * v
        _, _, n, depth = plain(closest_sections)(tuple(r), tuple(u), tuple(v), section(first), section(second), np.inf)
        if depth > -0.02:
            continue
        seen += 1
        assert -depth == pytest.approx(solved(r + 0.5 * u - 0.5 * v, u, v, first, second), abs=1e-6)
        assert np.linalg.norm(n) == pytest.approx(1.0)
    assert seen >= 2


@pytest.mark.parametrize("angle", [1.0, 30.0, 85.0])
@pytest.mark.parametrize("depth", [-0.05, 0.05])
def test_forces_along_the_normal_are_the_gradient_of_the_depth(angle, depth):
    """d(depth) = -n dr - s n du + t n dv, also past an end: a penalty on it makes no energy on a closed path."""
    rng, turn = np.random.default_rng(int(angle)), np.deg2rad(angle)
    pair = section(WIDE), section(NARROW)
    for _ in range(8):
        u = np.array([0.6, 0.0, 0.1 * rng.normal()])
        v = 0.5 * np.array([cos(turn), sin(turn), 0.2 * rng.normal()])
        r = np.array([*rng.normal(0.0, 0.35, 2), 0.9])
        for _ in range(30):  # moved along z to the depth that is wanted
            r[2] += plain(closest_sections)(tuple(r), tuple(u), tuple(v), *pair, np.inf)[3] - depth
        s, t, n, found = plain(closest_sections)(tuple(r), tuple(u), tuple(v), *pair, np.inf)
        assert found == pytest.approx(depth, abs=1e-6)
        at = np.array([r, u, v])
        for place, weight in ((0, -1.0), (1, -s), (2, t)):
            for axis in range(3):
                depths = partial(lambda a: plain(closest_sections)(*map(tuple, a), *pair, np.inf)[3], at)
                change = derivative(depths, at, (place, axis), 1e-6)
                assert change == pytest.approx(weight * n[axis], abs=2e-5)


@pytest.mark.parametrize("angle", np.linspace(0.0, 0.5 * pi, 7))
def test_support_of_an_ellipse(angle):
    """h n + q is the point of the ellipse whose normal is n; h + h'' = a^2 b^2 / h^3, its radius of curvature; a circle
    has no shift and no change.
    """
    n, across = (0.0, cos(angle), sin(angle)), (0.0, -sin(angle), cos(angle))
    h, shift = plain(support)(section(WIDE), n)
    point = h * np.array(n) + shift
    assert (point[1] / WIDE[0]) ** 2 + (point[2] / WIDE[1]) ** 2 == pytest.approx(1.0)
    gradient = np.array([0.0, point[1] / WIDE[0] ** 2, point[2] / WIDE[1] ** 2])
    assert gradient / np.linalg.norm(gradient) == pytest.approx(np.array(n), abs=1e-12)
    assert h + plain(rounding)(section(WIDE), n, across) == pytest.approx((WIDE[0] * WIDE[1]) ** 2 / h**3)
    assert plain(support)(section(ROUND), n) == (0.25, pytest.approx((0.0, 0.0, 0.0), abs=0.0))
    assert plain(rounding)(section(ROUND), n, across) == 0.0
