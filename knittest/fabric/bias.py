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

    Yarns are cut between two nodes; pieces of fewer elements than ``least`` of their system fall out. Ends of pieces
    are placed so that the centre-line keeps to that of the yarn (:func:`_end`).
    """
    found = []
    for path in paths:
        points = turned(path.points)
        inside = (np.abs(points[:, 0]) <= 0.5 * width) & (np.abs(points[:, 1]) <= 0.5 * length)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
        found += [
            CutPath(path.system, path.index, _with_ends(points, first, last), replace(path, points=points), int(first))
            for first, last in zip(ends[::2], ends[1::2], strict=True)
            if last - first - 1 >= least[path.system]
        ]
    return found


def _with_ends(points: Array, first: int, last: int) -> Array:
    """Control ``points`` (n, 3) from ``first`` to before ``last``, with both ends placed."""
    found = points[first:last].copy()
    if first > 0 and last > first + 2:
        found[0] = _end(points[first - 1 : first + 3][::-1])
    if last < len(points) and last > first + 2:
        found[-1] = _end(points[last - 3 : last + 1])
    return found


def _end(points: Array) -> Array:
    """Last control point of a yarn that is cut behind the third of four ``points`` (4, 3).

    Behind the middle of the last element the centre-line goes on along the parabola of the piece before. It would end
    an eighth of the third difference of ``points`` beside the line of the uncut yarn. Moving the control point by a
    ninth of that difference mends the end and displaces the middle of the element. Half of it leaves the smallest
    deviation.
    """
    end: Array = points[2] + np.diff(points, 3, axis=0)[0] / 18.0
    return end
