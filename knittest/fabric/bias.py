"""Cuts a strip on the bias out of a piece of yarn paths: turned by 45 deg, its length along y."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.fabric.strip import YarnPath

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CutPath(YarnPath):
    """Piece of a yarn that begins at control point ``first`` of the yarn ``of``."""

    of: YarnPath
    first: int

    @property
    def uncut(self) -> YarnPath:
        """The yarn before it was cut."""
        return self.of


def turned(points: Array) -> Array:
    """``points`` (n, 3) turned by 45 deg about z: the weft, along x, comes to lie on y = x, the warp on y = -x."""
    c = sqrt(0.5)
    found: Array = points @ np.array([[c, c, 0.0], [-c, c, 0.0], [0.0, 0.0, 1.0]])
    return found


def cells_under(length: float, width: float, pitches: tuple[float, float]) -> tuple[int, int]:
    """Wales and courses, of ``pitches`` [mm], of a piece that a strip at 45 deg can be cut out of."""
    across = (length + width) / sqrt(2.0)
    wales, courses = (ceil(across / pitch) + 2 for pitch in pitches)
    return wales, courses


def cut_on_the_bias(paths: Sequence[YarnPath], length: float, width: float, least: Mapping[str, int]) -> list[CutPath]:
    """Pieces of ``paths``, which lie about the origin, in a strip of ``length`` and ``width`` [mm] at 45 deg.

    Yarns are cut between two nodes; pieces of fewer elements than ``least`` of their system fall out.
    """
    found = []
    for path in paths:
        points = turned(path.points)
        inside = (np.abs(points[:, 0]) <= 0.5 * width) & (np.abs(points[:, 1]) <= 0.5 * length)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
        found += [
            CutPath(path.system, path.index, points[first:last], replace(path, points=points), int(first))
            for first, last in zip(ends[::2], ends[1::2], strict=True)
            if last - first - 1 >= least[path.system]
        ]
    return found
