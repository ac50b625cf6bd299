"""Tiles the relaxed cell to a strip of yarn paths, on the control points of their centre-line splines.

The strip spans [0, n_wales W] x [0, n_courses C] from its lower-left corner, x across the wales, y along them, z to the
technical face, 0 in the middle of the thickness. Warp w lies at x = (w + 1/2) W, weft c at y = (c + 1/2) C on average;
knitting yarns run along x. All yarns are cut at the edges: knitting yarns in their needle arcs, warp and weft midway
between two crossings.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.fabric.cell import Cell
from knittest.fabric.spline import arc_at, control_points, polyline_length

Array = NDArray[np.float64]


@dataclass(frozen=True)
class YarnPath:
    """Control points [mm], (n, 3), of one yarn of ``system`` warp, weft or knit; ``index`` counts the system's yarns.

    The beams join these points; the contact lies on their quadratic B-spline (:mod:`knittest.fabric.spline`).
    """

    system: str
    index: int
    points: Array


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
    wale, course = cell.spec.wale, cell.spec.course
    knit = _cut(cell, "knit", 0.0, elements_per_loop, n_wales)
    warp = _cut(cell, "warp", -0.5 * course, wave_elements(cell, "warp", elements_per_wave), n_courses)
    weft = _cut(cell, "weft", 0.0, wave_elements(cell, "weft", elements_per_wave), n_wales)
    across, along = np.array([wale, 0.0, 0.0]), np.array([0.0, course, 0.0])
    paths = [YarnPath("knit", c, knit + (c + 0.5) * along) for c in range(n_courses)]
    for w in range(n_wales):
        points = _scaled(warp, along, float(amplitude["warp"][w]))
        paths.append(YarnPath("warp", w, points + w * across + 0.5 * along))
    for c in range(n_courses):
        points = _scaled(weft, across, float(amplitude["weft"][c]))
        paths.append(YarnPath("weft", c, points + (c + 0.5) * along))
    return paths


def _cut(cell: Cell, system: str, plane: float, n: int, periods: int) -> Array:
    """Control points over ``periods`` periods, both ends included, from the ``plane`` [mm] across the yarn on."""
    curve, period = getattr(cell, system), cell.periods[system]
    axis = int(np.argmax(period))
    points = control_points(curve, period, n, arc_at(curve, period, axis, plane))
    number = np.arange(n * periods + 1)
    tiled = points[number % n] + (number // n)[:, None] * period
    tiled[:, axis] += plane - tiled[0, axis]  # a control point lies a little off the curve
    return tiled


def _scaled(points: Array, period: Array, scale: float) -> Array:
    """Scale the deviation of a yarn from its straight mean line; the last point repeats the first."""
    axis = period / np.linalg.norm(period)
    along = points @ axis
    mean = points[:-1].mean(axis=0)
    line = mean + (along - mean @ axis)[:, None] * axis
    return line + scale * (points - line)
