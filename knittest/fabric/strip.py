"""Strips of yarn paths, cut out of the tiled relaxed cell along the yarns or at 45 deg to them.

The strip spans [0, n_wales W] x [0, n_courses C] from its lower-left corner, x across the wales, y along them, z to the
technical face, 0 in the middle of the thickness. On average the warp of wale w lies at x = (w + 1/2) W, the weft of
course c at y = (c + 1/2) C. Knitting yarns run along x. The structure begins with the first wale and course of its
repeat. All yarns are cut at the edges: knitting yarns in their needle arcs, warp and weft midway between two crossings.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, sqrt

import numpy as np

from knittest.base.arrays import Array
from knittest.config.structure import KNIT
from knittest.fabric.cell import Cell, Curve
from knittest.fabric.loop import arc_at, control_points, points_on, polyline_length

Place = Callable[[Array, Array, int, Sequence[float]], Array]


@dataclass(frozen=True)
class YarnPath:
    """Control points [mm], (n, 3), of one yarn of ``system``; ``index`` counts the system's yarns.

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
    """Beams of an inlay over one pitch: ``elements_per_wave`` in the longer pitch, as long ones (an even number, at
    least 4) in the shorter."""
    pitch = cell.spec.course if cell.spec.axis(system) else cell.spec.wale
    return max(2 * round(0.5 * elements_per_wave * pitch / max(cell.spec.wale, cell.spec.course)), 4)


def wave_scale(curve: Curve, n: int) -> float:
    """Factor on the wave of an inlay that gives the polygon of ``n`` control points the crimp of the ``curve``.

    The beams are straight between their nodes, so the polygon's length is what straightens under tension.
    """
    from scipy.optimize import brentq

    period = curve.period
    points = control_points(curve.points, period, n)
    closed = np.vstack([points, points[:1] + period])
    spacing = float(np.linalg.norm(period))
    wanted = curve.length / spacing - 1.0
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
    amplitude: Mapping[str, Array] | None = None,
) -> list[YarnPath]:
    """Yarn paths of ``n_wales`` x ``n_courses`` stitches: a row of loops a course, and the inlays of each layer.

    ``amplitude`` (n_yarns,) scales the waves of each system of inlays, over those whose polygon has the crimp of the
    cell; loops stay as they are. For ``elements_per_wave`` see :func:`wave_elements`.
    """
    paths = []
    for system in cell.spec.systems:
        pieces = elements_per_loop if system == KNIT else wave_elements(cell, system, elements_per_wave)
        axis, curves = cell.spec.axis(system), cell.of(system)
        n = pieces * cell.spec.repeat[axis]
        lines = [_yarn_of_pitches(cell, one, n, (n_wales, n_courses)[axis], control_points) for one in curves]
        scales = [1.0 if system == KNIT else wave_scale(one, n) for one in curves]
        for index, (k, moved) in enumerate(_yarns_of(cell, system, (n_wales, n_courses)[1 - axis])):
            points = lines[k]
            if system != KNIT:
                relative = 1.0 if amplitude is None else float(amplitude[system][index])
                points = _scale_wave(points, curves[k].period, scales[k] * relative)
            paths.append(YarnPath(system, index, points + moved))
    return paths


def centre_lines(cell: Cell, n_wales: int, n_courses: int, finer: int = 1) -> list[YarnPath]:
    """Yarns with points on their centre-lines instead of control points, ``finer`` times those relaxed."""
    paths, counts = [], (n_wales, n_courses)
    for system in cell.spec.systems:
        axis, curves = cell.spec.axis(system), cell.of(system)
        lines = [_yarn_of_pitches(cell, one, finer * len(one.points), counts[axis], points_on) for one in curves]
        yarns = _yarns_of(cell, system, counts[1 - axis])
        paths += [YarnPath(system, index, lines[k] + moved) for index, (k, moved) in enumerate(yarns)]
    return paths


def yarn_count(cell: Cell, system: str, pitches: int) -> int:
    """Yarns of ``system`` in the first ``pitches`` wales or courses across them."""
    return len(_yarns_of(cell, system, pitches))


def _yarns_of(cell: Cell, system: str, pitches: int) -> list[tuple[int, Array]]:
    """Number in the cell and offset (3,) [mm] of each yarn of ``system`` in the first ``pitches`` across it."""
    across, found = 1 - cell.spec.axis(system), []
    repeat, pitch = cell.spec.repeat[across], (cell.spec.wale, cell.spec.course)[across]
    places = {one.index: k for k, one in enumerate(cell.of(system))}
    for number in range(pitches):
        if (k := places.get(number % repeat)) is not None:
            offset = np.zeros(3)
            offset[across] = (number - number % repeat) * pitch
            found.append((k, offset))
    return found


def _yarn_of_pitches(cell: Cell, curve: Curve, n: int, pitches: int, place: Place) -> Array:
    """Yarn of ``curve`` over ``pitches`` wales or courses, of ``n`` points a period, both ends included: (m, 3)."""
    period, axis = curve.period, int(np.argmax(curve.period))
    repeat = cell.spec.repeat[axis]
    origin = np.array([0.0, -0.5 * cell.spec.course, 0.0])  # the strip's lower-left corner in the cell
    pitch = (cell.spec.wale, cell.spec.course)[axis]
    starts = [arc_at(curve.points, period, axis, origin[axis] + k * pitch, (k + 0.5) / repeat) for k in range(repeat)]
    points = place(curve.points, period, n, starts) - origin
    number = np.arange(n // repeat * pitches + 1)
    tiled = points[number % n] + (number // n)[:, None] * period
    tiled[:, axis] -= tiled[0, axis]  # a control point lies a little off the curve
    return tiled


def _scale_wave(points: Array, period: Array, scale: float) -> Array:
    """Scale the deviation of a yarn from its straight mean line; the last point is left out of the mean."""
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
