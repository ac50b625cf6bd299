"""Surfaces of triangles: their edges, orientation and volume."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Index = NDArray[np.int64]
#: most points that a surface is spread to
MOST_POINTS = 2_000_000
#: corners closer than this share of the surface's extent are one
SAME = 1e-8


@dataclass(frozen=True)
class TriangleMesh:
    """Surface with ``points`` (n, 3) [mm] and ``triangles`` (m, 3), which turn left seen from outside."""

    points: Array
    triangles: Index
    #: triangles left out because two of their corners were one
    dropped: int = 0

    @classmethod
    def joined(cls, parts: Sequence[Array], same: float = SAME) -> "TriangleMesh":
        """Join triangles given by their corners, (n, 3, 3) each, at common points; drops those without three corners.

        ``same``: share of the extent within which points are one.
        """
        corners = np.concatenate(parts)
        grain = same * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        _, first, number = np.unique(
            np.round(corners.reshape(-1, 3) / max(grain, 1e-300)).astype(np.int64),
            axis=0, return_index=True, return_inverse=True,
        )  # fmt: skip
        triangles = number.reshape(-1, 3)
        keep = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        return cls(corners.reshape(-1, 3)[first], triangles[keep], int((~keep).sum()))

    @property
    def corners(self) -> Array:
        """Corners of the triangles [mm], (m, 3, 3)."""
        found: Array = self.points[self.triangles]
        return found

    def spread(self, spacing: float) -> Array:
        """Points [mm], (n, 3), all over the surface: its corners, and between them a point every ``spacing`` [mm] at
        least, or as close as :data:`MOST_POINTS` allow.
        """
        corners = self.corners
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        close = max(spacing, float(np.sqrt(0.5 * (sides**2).sum() / MOST_POINTS)))
        parts = np.maximum(np.ceil(sides / close), 1.0).astype(int)
        found = [self.points]
        for n in np.unique(parts[parts > 1]):
            i, j = (steps.ravel() for steps in np.mgrid[: n + 1, : n + 1])
            shares = np.column_stack([i, j, n - i - j])[i + j <= n] / n
            found.append(np.einsum("kc,mcd->mkd", shares, corners[parts == n]).reshape(-1, 3))
        return np.concatenate(found)

    @property
    def normals(self) -> Array:
        """Outward normals times area [mm2], (m, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        found: Array = 0.5 * np.cross(b - a, c - a)
        return found

    @property
    def volume(self) -> float:
        """Volume inside [mm3]; negative if the triangles turn right seen from outside. Of closed surfaces only."""
        corners = self.corners - self.points.mean(axis=0)
        return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0)

    @property
    def edges(self) -> Index:
        """Edges in the direction of each triangle, (3 m, 2): rows k, m + k and 2 m + k are those of triangle k."""
        t = self.triangles
        return np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])

    def borders(self) -> Index:
        """Edges (k, 2) with no triangle on the other side, or with two on one side: none if closed."""
        edges, count = self.edges, len(self.points)
        forth, back = edges @ np.array([count, 1]), edges @ np.array([1, count])
        _, number, times = np.unique(forth, return_inverse=True, return_counts=True)
        found: Index = edges[~np.isin(forth, back) | (times[number] > 1)]
        return found

    def turned(self, which: NDArray[np.bool_] | None = None) -> "TriangleMesh":
        """Mesh with all triangles, or those of ``which`` (m,), turned inside out."""
        turn = np.ones(len(self.triangles), bool) if which is None else which
        return TriangleMesh(self.points, np.where(turn[:, None], self.triangles[:, ::-1], self.triangles))

    def rotated(self, degrees: Sequence[float]) -> "TriangleMesh":
        """Rotated about the origin by ``degrees`` (3,): about the x axis, then y, then z, which stay where they are."""
        return TriangleMesh(Rotation.from_euler("xyz", degrees, degrees=True).apply(self.points), self.triangles)

    def moved(self, by: Sequence[float], scale: float = 1.0) -> "TriangleMesh":
        """Scaled about the origin, then moved ``by`` (3,) [mm]."""
        return TriangleMesh(scale * self.points + np.asarray(by, float), self.triangles)
