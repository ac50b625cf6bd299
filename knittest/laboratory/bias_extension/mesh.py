"""Shells of a strip on the bias: squares whose sides lie along the yarns, three kites in each triangle at an edge.

So the lines between the zones of the test are sides of shells, and pin-jointed yarns strain none of them.
"""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: corners of a diamond and of the triangles at the four edges about its place, in half diagonals
_SOUTH, _EAST, _NORTH, _WEST = (0, -1), (1, 0), (0, 1), (-1, 0)


def diamonds(length: float, width: float, size: float) -> tuple[int, int]:
    """Number of diamonds along and across; each is divided into four shells of about ``size`` [mm]."""
    diagonal = 2.0 * sqrt(2.0) * size
    across = max(round(width / diagonal), 2)
    return max(round(length * across / width), 2), across


def bias_mesh(length: float, width: float, size: float) -> tuple[Array, Index]:
    """Nodes (n, 3) [mm] of a strip about the origin, its length along y, and shells of about ``size`` (n_el, 4)."""
    along, across = diamonds(length, width, size)
    quads: list[list[tuple[float, float]]] = []
    for j in range(2 * along + 1):
        for i in range(1 - j % 2, 2 * across + 1, 2):
            quads += _shells(i, j, 2 * across, 2 * along)
    corners = np.array(quads)
    places, conn = np.unique(np.round(corners.reshape(-1, 2) * 12.0).astype(np.int64), axis=0, return_inverse=True)
    position = np.zeros((len(places), 3))
    position[:, 0] = width * (places[:, 0] / (24.0 * across) - 0.5)
    position[:, 1] = length * (places[:, 1] / (24.0 * along) - 0.5)
    return position, conn.reshape(-1, 4).astype(np.int64)


def _shells(i: int, j: int, right: int, top: int) -> list[list[tuple[float, float]]]:
    """Quadrilaterals of the diamond about (i, j), or of the half of it that lies in the strip."""
    corners = [(i + x, j + y) for x, y in (_SOUTH, _EAST, _NORTH, _WEST)]
    inside = [c for c in corners if 0 <= c[0] <= right and 0 <= c[1] <= top]
    if len(inside) < 3:
        return []
    if len(inside) == 3:  # in the order of a turn to the left
        first = next(k for k, c in enumerate(corners) if c not in inside)
        inside = [corners[(first + k) % 4] for k in (1, 2, 3)]
    centre = (sum(c[0] for c in inside) / len(inside), sum(c[1] for c in inside) / len(inside))
    found = []
    for k, corner in enumerate(inside):
        before, after = inside[k - 1], inside[(k + 1) % len(inside)]
        found.append([_between(before, corner), corner, _between(corner, after), centre])
    return found


def _between(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    return 0.5 * (one[0] + other[0]), 0.5 * (one[1] + other[1])
