"""Triangles of closed meshes: walls between stacked outlines, and flat caps on them."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

Array = NDArray[np.float64]


def wall(lower: Array, upper: Array) -> Array:
    """Triangles between two rings of as many points, (n, 3) each; seen from outside ``upper`` is above a ring that
    turns left seen from above.
    """
    low, high = np.roll(lower, -1, axis=0), np.roll(upper, -1, axis=0)
    return np.concatenate([np.stack([lower, low, high], axis=1), np.stack([lower, high, upper], axis=1)])


def cap(rings: Sequence[Array], inside: Callable[[Array], NDArray[np.bool_]], up: bool) -> Array:
    """Flat triangles between ``rings`` (n, 3) of one height where ``inside`` of their centres (m, 2) is true.

    The edges of a ring become edges of triangles because nothing else lies as near to them as their ends (Delaunay).
    """
    points = np.concatenate(rings)
    triangles = Delaunay(points[:, :2]).simplices
    corners: Array = points[triangles]
    corners = corners[inside(corners[:, :, :2].mean(axis=1))]
    a, b, c = np.moveaxis(corners[:, :, :2], 1, 0)
    left = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0.0
    return np.where((left == up)[:, None, None], corners, corners[:, ::-1])
