"""Closed triangle meshes from rings: stacked outlines joined by walls and closed by flat caps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

Array = NDArray[np.float64]
Index = NDArray[np.int64]
#: points closer than this are one [mm]
SAME = 1e-6


@dataclass(frozen=True)
class Solid:
    """Closed surface: ``points`` (n, 3) [mm] and ``triangles`` (m, 3), which turn left seen from outside."""

    points: Array
    triangles: Index

    @classmethod
    def of(cls, parts: Sequence[Array]) -> "Solid":
        """Join triangles given by their corners, (n, 3, 3) each, at their common points."""
        corners = np.concatenate(parts)
        points, number = np.unique(
            np.round(corners.reshape(-1, 3) / SAME).astype(np.int64), axis=0, return_inverse=True
        )
        triangles = number.reshape(-1, 3)
        keep = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        return cls(SAME * points.astype(float), triangles[keep])

    @property
    def corners(self) -> Array:
        """Corners of the triangles [mm], (m, 3, 3)."""
        found: Array = self.points[self.triangles]
        return found

    @property
    def volume(self) -> float:
        """Volume inside [mm3]."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    @property
    def open_edges(self) -> int:
        """Number of edges whose two triangles do not run along them in opposite directions: 0 for a closed surface."""
        edges = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        forth, back = (edges @ np.array([len(self.points), 1])), (edges[:, ::-1] @ np.array([len(self.points), 1]))
        return int(np.setxor1d(forth, back).size + len(forth) - np.unique(forth).size)


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
