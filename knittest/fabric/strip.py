"""Tiles the relaxed cell to a strip of yarn paths, on the control points of their centre-line splines.

The strip spans [0, n_wales W] x [0, n_courses C], x across the wales, y along them, z to the technical face. Warp w
lies at (w + 1/2) W, weft c at (c + 1/2) C; knitting yarns run along x, cut at the needle arcs.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from knittest.fabric.loop import polyline_length
from knittest.fabric.relax import Cell

Array = NDArray[np.float64]
System = Literal["warp", "weft", "knit"]


@dataclass(frozen=True)
class YarnPath:
    """Control points [mm], (n, 3), of one yarn; ``index`` counts the yarns of its system."""

    system: str
    index: int
    points: Array


def control_points(curve: Array, period: Array, n: int) -> Array:
    """``n`` control points of the periodic quadratic B-spline that follows ``curve`` (m, 3) over ``period`` [mm].

    Piece i is at (P[i-1] + 6 P[i] + P[i+1]) / 8 in its middle; these points are set on the curve, equally spaced by
    arc, by solving the circulant system for what deviates from a straight line. Control point 0 belongs to curve[0].
    """
    closed = np.vstack([curve, curve[:1] + period])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    share = np.arange(n) / n
    on_curve = np.column_stack([np.interp(share * arc[-1], arc, closed[:, k]) for k in range(3)])
    straight = share[:, None] * period
    weights = (6.0 + 2.0 * np.cos(2.0 * np.pi * np.arange(n) / n)) / 8.0
    deviation = np.fft.ifft(np.fft.fft(on_curve - straight, axis=0) / weights[:, None], axis=0).real
    return deviation + straight


def wave_scale(cell: Cell, system: str, n: int) -> float:
    """Factor on the wave of an inlay that gives the polygon of ``n`` control points a wave the crimp of the yarn.

    The beams are straight between their nodes, so the polygon's length is what straightens under tension.
    """
    from scipy.optimize import brentq

    period, curve = cell.periods[system], getattr(cell, system)
    points = control_points(curve, period, n)
    closed = np.vstack([points, points[:1] + period])
    spacing = float(np.linalg.norm(period))
    wanted = polyline_length(np.vstack([curve, curve[:1] + period])) / spacing - 1.0
    if wanted < 1e-9:
        return 1.0

    def excess(scale: float) -> float:
        return polyline_length(_scaled(closed, period, scale)) / spacing - 1.0 - wanted

    return float(brentq(excess, 0.5, 2.0))


def _scaled(points: Array, period: Array, scale: float) -> Array:
    """Scale the deviation of a yarn from its straight mean line; the last point repeats the first."""
    axis = period / np.linalg.norm(period)
    along = points @ axis
    mean = points[:-1].mean(axis=0)
    line = mean + (along - mean @ axis)[:, None] * axis
    return line + scale * (points - line)


def strip(
    cell: Cell,
    n_wales: int,
    n_courses: int,
    elements_per_loop: int,
    elements_per_wave: int,
    amplitude: Mapping[str, Array],
) -> list[YarnPath]:
    """Yarn paths of ``n_wales`` x ``n_courses`` cells; ``amplitude`` scales the wave of each warp and weft, (n,)."""
    wale, course = cell.spec.wale, cell.spec.course
    weft_height = float(cell.weft[:, 1].mean())
    origin = np.array([0.0, 0.5 * course - weft_height, 0.0])
    paths = []
    for c in range(n_courses):
        loops = _tile(cell.knit, cell.periods["knit"], elements_per_loop, n_wales, first=0.5)
        loops[:, 0] -= loops[0, 0]
        paths.append(YarnPath("knit", c, loops + origin + [0.0, c * course, 0.0]))
    for w in range(n_wales):
        warp = _inlay(cell, "warp", elements_per_wave, n_courses, 0.0, float(amplitude["warp"][w]))
        warp[:, 1] -= warp[0, 1]
        paths.append(YarnPath("warp", w, warp + [w * wale + 0.5 * wale - cell.warp[:, 0].mean(), 0.0, 0.0]))
    for c in range(n_courses):
        weft = _inlay(cell, "weft", elements_per_wave, n_wales, 0.5, float(amplitude["weft"][c]))
        weft[:, 0] -= weft[0, 0]
        paths.append(YarnPath("weft", c, weft + [0.0, (c + 0.5) * course - weft_height, 0.0]))
    return paths


def _inlay(cell: Cell, system: str, n: int, periods: int, first: float, scale: float) -> Array:
    """A warp or weft over ``periods`` waves; share ``first`` of its period lies midway between two crossings."""
    points = _tile(getattr(cell, system), cell.periods[system], n, periods, first)
    return _scaled(points, cell.periods[system], scale)


def _tile(curve: Array, period: Array, n: int, periods: int, first: float) -> Array:
    """Control points over ``periods`` periods, both ends included, starting at share ``first`` of a period."""
    points = control_points(curve, period, n)
    skip = round(first * n)
    number = np.arange(skip, skip + n * periods + 1)
    return points[number % n] + (number // n)[:, None] * period
