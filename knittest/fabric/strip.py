"""Strips of yarn paths, cut out of the tiled relaxed cell along the yarns or at 45 deg to them.

The strip spans [0, n_wales W] x [0, n_courses C] from its lower-left corner, x across the wales, y along them, z to the
technical face, 0 in the middle of the thickness. Warp w lies at x = (w + 1/2) W, weft c at y = (c + 1/2) C on average;
knitting yarns run along x. All yarns are cut at the edges: knitting yarns in their needle arcs, warp and weft midway
between two crossings.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from knittest.base.arrays import Array
from knittest.fabric.cell import Cell
from knittest.fabric.loop import arc_at, control_points, points_on, polyline_length

Place = Callable[[Array, Array, int, float], Array]


@dataclass(frozen=True)
class YarnPath:
    """Control points [mm], (n, 3), of one yarn of ``system`` warp, weft or knit; ``index`` counts the system's yarns.

    The beams join these points; the contact lies on their quadratic B-spline (:mod:`knittest.fabric.loop`).
    """

    system: str
    index: int
    points: Array

    @property
    def uncut_path(self) -> "YarnPath":
        """The yarn over whole pitches: itself, unless a piece was cut out of it."""
        return self


def wave_elements(cell: Cell, system: str, elements_per_wave: int) -> int:
    """Beams in one wave of warp or weft: ``elements_per_wave`` in the longer wave, as long ones (an even number, at
    least 4) in the shorter."""
    spacing = {s: float(np.linalg.norm(cell.periods[s])) for s in ("warp", "weft")}
    return max(2 * round(0.5 * elements_per_wave * spacing[system] / max(spacing.values())), 4)


def wave_scale(cell: Cell, system: str, n: int) -> float:
    """Factor on the wave of a warp or weft that gives the polygon of ``n`` control points the crimp of the curve.

    The beams are straight between their nodes, so the polygon's length is what straightens under tension.
    """
    from scipy.optimize import brentq

    period = cell.periods[system]
    points = control_points(getattr(cell, system), period, n)
    closed = np.vstack([points, points[:1] + period])
    spacing = float(np.linalg.norm(period))
    wanted = cell.crimp(system)
    if wanted < 1e-9:
        return 1.0

    def excess(scale: float) -> float:
        return polyline_length(_scale_wave(closed, period, scale)) / spacing - 1.0 - wanted

    return float(brentq(excess, 0.5, 2.0))


def strip(
    cell: Cell,
    n_wales: int,
    n_courses: int,
    elements_per_loop: int,
    elements_per_wave: int,
    amplitude: Mapping[str, Array],
) -> list[YarnPath]:
    """Yarn paths of ``n_wales`` x ``n_courses`` cells: one warp a wale, one weft and one row of loops a course.

    ``amplitude`` scales the wave of each warp (n_wales,) and weft (n_courses,); loops stay as they are. For
    ``elements_per_wave`` see :func:`wave_elements`.
    """
    across, along = cell.periods["weft"], cell.periods["warp"]
    pieces = {s: wave_elements(cell, s, elements_per_wave) for s in ("warp", "weft")}
    knit = _first_yarn(cell, "knit", elements_per_loop, n_wales, control_points)
    warp = _first_yarn(cell, "warp", pieces["warp"], n_courses, control_points)
    weft = _first_yarn(cell, "weft", pieces["weft"], n_wales, control_points)
    paths = [YarnPath("knit", c, knit + c * along) for c in range(n_courses)]
    for w in range(n_wales):
        paths.append(YarnPath("warp", w, _scale_wave(warp, along, float(amplitude["warp"][w])) + w * across))
    for c in range(n_courses):
        paths.append(YarnPath("weft", c, _scale_wave(weft, across, float(amplitude["weft"][c])) + c * along))
    return paths


def centre_lines(cell: Cell, n_wales: int, n_courses: int, finer: int = 1) -> list[YarnPath]:
    """Yarns with points on their centre-lines instead of control points, ``finer`` times those relaxed."""
    across, along = cell.periods["weft"], cell.periods["warp"]
    paths = []
    for system, periods, copies, step in (
        ("knit", n_wales, n_courses, along),
        ("warp", n_courses, n_wales, across),
        ("weft", n_wales, n_courses, along),
    ):
        line = _first_yarn(cell, system, finer * len(getattr(cell, system)), periods, points_on)
        paths += [YarnPath(system, k, line + k * step) for k in range(copies)]
    return paths


def _first_yarn(cell: Cell, system: str, n: int, periods: int, place: Place) -> Array:
    """First yarn of ``system`` over ``periods`` periods by ``place``, both ends included: (n * periods + 1, 3)."""
    curve, period = getattr(cell, system), cell.periods[system]
    axis = int(np.argmax(period))
    origin = np.array([0.0, -0.5 * cell.spec.course, 0.0])  # the strip's lower-left corner in the cell
    points = place(curve, period, n, arc_at(curve, period, axis, origin[axis])) - origin
    number = np.arange(n * periods + 1)
    tiled = points[number % n] + (number // n)[:, None] * period
    tiled[:, axis] -= tiled[0, axis]  # a control point lies a little off the curve
    return tiled


def _scale_wave(points: Array, period: Array, scale: float) -> Array:
    """Scale the deviation of a yarn from its straight mean line; the last point repeats the first."""
    axis = period / np.linalg.norm(period)
    along = points @ axis
    mean = points[:-1].mean(axis=0)
    line = mean + (along - mean @ axis)[:, None] * axis
    return line + scale * (points - line)


@dataclass(frozen=True)
class CutPath(YarnPath):
    """Piece of a yarn that begins at control point ``first`` of the yarn ``of``."""

    of: YarnPath
    first: int

    @property
    def uncut_path(self) -> YarnPath:
        """The yarn before it was cut."""
        return self.of


def rotate_to_bias(points: Array) -> Array:
    """``points`` (n, 3) turned by 45 deg about z: the weft, along x, comes to lie on y = x, the warp on y = -x."""
    c = sqrt(0.5)
    return points @ np.array([[c, c, 0.0], [-c, c, 0.0], [0.0, 0.0, 1.0]])


def cells_for_bias_strip(length: float, width: float, pitches: tuple[float, float]) -> tuple[int, int]:
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
        points = rotate_to_bias(path.points)
        inside = (np.abs(points[:, 0]) <= 0.5 * width) & (np.abs(points[:, 1]) <= 0.5 * length)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
        found += [
            CutPath(path.system, path.index, _place_ends(points, first, last), replace(path, points=points), int(first))
            for first, last in zip(ends[::2], ends[1::2], strict=True)
            if last - first - 1 >= least[path.system]
        ]
    return found


def _place_ends(points: Array, first: int, last: int) -> Array:
    """Control ``points`` (n, 3) from ``first`` to before ``last``, with both ends placed."""
    found = points[first:last].copy()
    if first > 0 and last > first + 2:
        found[0] = _end_point(points[first - 1 : first + 3][::-1])
    if last < len(points) and last > first + 2:
        found[-1] = _end_point(points[last - 3 : last + 1])
    return found


def _end_point(points: Array) -> Array:
    """Last control point of a yarn that is cut behind the third of four ``points`` (4, 3).

    Behind the middle of the last element the centre-line goes on along the parabola of the piece before. It would end
    an eighth of the third difference of ``points`` beside the line of the uncut yarn. Moving the control point by a
    ninth of that difference mends the end and displaces the middle of the element. Half of it leaves the smallest
    deviation.
    """
    return points[2] + np.diff(points, 3, axis=0)[0] / 18.0
