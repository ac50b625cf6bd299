"""Periodic centre-lines: length, and the control points of the quadratic B-spline that follows one.

The yarn contact lies on the spline whose control points are the nodes of the beams. With s in [0, 1], piece i is
(P[i-1] + P[i]) / 2 + s (P[i] - P[i-1]) + s^2 / 2 (P[i-1] - 2 P[i] + P[i+1]), its middle is
(P[i-1] + 6 P[i] + P[i+1]) / 8 (de Boor, A Practical Guide to Splines, 1978).
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def polyline_length(points: Array) -> float:
    """Length [mm] of a polyline (n, 3)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def arc_at(curve: Array, period: Array, axis: int, plane: float) -> float:
    """Arc length [mm] from curve[0] at which ``curve`` (m, 3) crosses coordinate ``axis`` = ``plane`` [mm].

    Of several crossings it takes the one nearest to the middle of the period; images of the plane are excluded.
    """
    line = np.vstack([curve - period, curve, curve + period, curve[:1] + 2.0 * period])
    arc = _arc(line)
    side = line[:, axis] - plane
    before = np.flatnonzero((side[:-1] < 0.0) != (side[1:] < 0.0))
    share = side[before] / (side[before] - side[before + 1])
    length = arc[-1] / 3.0
    at = arc[before] + share * np.diff(arc)[before] - length
    return float(at[np.argmin(np.abs(at - 0.5 * length))])


def points_on(curve: Array, period: Array, n: int, start: float = 0.0) -> Array:
    """``n`` points [mm], (n, 3), on ``curve`` over one ``period``, equally spaced by arc from ``start`` [mm] on.

    Between its points (m, 3) the curve is a periodic cubic spline.
    """
    from scipy.interpolate import CubicSpline

    closed = np.vstack([curve, curve[:1] + period])
    arc = _arc(closed)
    smooth = CubicSpline(arc, closed - arc[:, None] / arc[-1] * period, bc_type="periodic")
    at = start + arc[-1] * np.arange(n) / n
    return np.asarray(smooth(at) + at[:, None] / arc[-1] * period)


def control_points(curve: Array, period: Array, n: int, start: float = 0.0) -> Array:
    """``n`` control points [mm], (n, 3), of the periodic quadratic B-spline that follows ``curve`` over ``period``.

    The middles of the pieces are :func:`points_on` the curve; the circulant system is solved for the deviation from the
    straight line, which is periodic.
    """
    straight = np.arange(n)[:, None] / n * period
    deviation = points_on(curve, period, n, start) - straight
    weights = (6.0 + 2.0 * np.cos(2.0 * np.pi * np.arange(n) / n)) / 8.0
    solved = np.fft.ifft(np.fft.fft(deviation, axis=0) / weights[:, None], axis=0).real
    return np.asarray(solved + straight)


def spline_points(control: Array, per_piece: int) -> Array:
    """Points [mm], ((n - 2) * per_piece, 3), on the B-spline of a chain of ``control`` points (n, 3)."""
    s = (np.arange(per_piece) / per_piece)[None, :, None]
    before, here, after = control[:-2, None], control[1:-1, None], control[2:, None]
    points = 0.5 * (before + here) + s * (here - before) + 0.5 * s**2 * (before - 2.0 * here + after)
    return points.reshape(-1, 3)


def _arc(line: Array) -> Array:
    """Arc length [mm], (n,), at the points of a polyline (n, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
