"""Tiles the relaxed cell to a strip of yarn paths, on the control points of their centre-line splines.

The strip spans [0, n_wales W] x [0, n_courses C] from its lower-left corner, x across the wales, y along them, z to the
technical face, 0 in the middle of the thickness. Warp w lies at x = (w + 1/2) W, weft c at y = (c + 1/2) C on average;
knitting yarns run along x. All yarns are cut at the edges: knitting yarns in their needle arcs, warp and weft midway
between two crossings.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.fabric.cell import Cell
from knittest.fabric.spline import arc_at, control_points, points_on, polyline_length

Array = NDArray[np.float64]
Place = Callable[[Array, Array, int, float], Array]


@dataclass(frozen=True)
class YarnPath:
    """Control points [mm], (n, 3), of one yarn of ``system`` warp, weft or knit; ``index`` counts the system's yarns.

    The beams join these points; the contact lies on their quadratic B-spline (:mod:`knittest.fabric.spline`).
    """

    system: str
    index: int
    points: Array

    @property
    def uncut(self) -> "YarnPath":
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
        return polyline_length(_scaled(closed, period, scale)) / spacing - 1.0 - wanted

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
    knit = _cut(cell, "knit", elements_per_loop, n_wales, control_points)
    warp = _cut(cell, "warp", pieces["warp"], n_courses, control_points)
    weft = _cut(cell, "weft", pieces["weft"], n_wales, control_points)
    paths = [YarnPath("knit", c, knit + c * along) for c in range(n_courses)]
    for w in range(n_wales):
        paths.append(YarnPath("warp", w, _scaled(warp, along, float(amplitude["warp"][w])) + w * across))
    for c in range(n_courses):
        paths.append(YarnPath("weft", c, _scaled(weft, across, float(amplitude["weft"][c])) + c * along))
    return paths


def centre_lines(cell: Cell, n_wales: int, n_courses: int, finer: int = 1) -> list[YarnPath]:
    """The same yarns with points on their centre-lines instead of control points, ``finer`` times those relaxed."""
    across, along = cell.periods["weft"], cell.periods["warp"]
    paths = []
    for system, periods, copies, step in (
        ("knit", n_wales, n_courses, along),
        ("warp", n_courses, n_wales, across),
        ("weft", n_wales, n_courses, along),
    ):
        line = _cut(cell, system, finer * len(getattr(cell, system)), periods, points_on)
        paths += [YarnPath(system, k, line + k * step) for k in range(copies)]
    return paths


def _cut(cell: Cell, system: str, n: int, periods: int, place: Place) -> Array:
    """First yarn of ``system`` over ``periods`` periods by ``place``, both ends included: (n * periods + 1, 3)."""
    curve, period = getattr(cell, system), cell.periods[system]
    axis = int(np.argmax(period))
    origin = np.array([0.0, -0.5 * cell.spec.course, 0.0])  # the strip's lower-left corner in the cell
    points = place(curve, period, n, arc_at(curve, period, axis, origin[axis])) - origin
    number = np.arange(n * periods + 1)
    tiled = points[number % n] + (number // n)[:, None] * period
    tiled[:, axis] -= tiled[0, axis]  # a control point lies a little off the curve
    return tiled


def _scaled(points: Array, period: Array, scale: float) -> Array:
    """Scale the deviation of a yarn from its straight mean line; the last point repeats the first."""
    axis = period / np.linalg.norm(period)
    along = points @ axis
    mean = points[:-1].mean(axis=0)
    line = mean + (along - mean @ axis)[:, None] * axis
    return line + scale * (points - line)
