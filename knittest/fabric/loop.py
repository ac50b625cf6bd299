"""Start curve of a knitted loop: harmonic in the loop angle, right topology, length set by its bulge. Periodic
centre-lines and their B-splines.

theta = 0 is the middle of the sinker arc, pi that of the needle arc; x across the wales, y along them, z to the
technical face. It has the topology of Choi & Lo (2003), Text. Res. J. 73, 739-748, whose half loop
x = a t^3 - 1.5 a t^2 + (a + w) t / 2, y = (c + 2 e)(1 - cos pi t) / 2, z = h (1 - cos 2 pi t) / 2 cannot, with its full
constraint set, be as short as the loops measured in variant 1 (14.78 against 14.4 mm); relaxation decides the shape.
"""

from dataclasses import dataclass

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError

# Periodic centre-lines: length, and the control points of the quadratic B-spline that follows one.
#
# The yarn contact lies on the spline whose control points are the nodes of the beams. With s in [0, 1], piece i is
# (P[i-1] + P[i]) / 2 + s (P[i] - P[i-1]) + s^2 / 2 (P[i-1] - 2 P[i] + P[i+1]), its middle is (P[i-1] + 6 P[i] + P[i+1])
# / 8 (de Boor, A Practical Guide to Splines, 1978).


def polyline_length(points: Array) -> float:
    """Length [mm] of a polyline (n, 3)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def arc_at(curve: Array, period: Array, axis: int, plane: float) -> float:
    """Arc length [mm] from curve[0] at which ``curve`` (m, 3) crosses coordinate ``axis`` = ``plane`` [mm].

    Of several crossings it takes the one nearest to the middle of the period; images of the plane are excluded.
    """
    line = np.vstack([curve - period, curve, curve + period, curve[:1] + 2.0 * period])
    arc = arc_length(line)
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
    arc = arc_length(closed)
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


def arc_length(line: Array) -> Array:
    """Arc length [mm], (n,), at the points of a polyline (n, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


#: the two cells whose start curves were studied (0.75 and 0.50 mm yarns, wale spacing 3.5714 mm), from dense to open:
#: course over wale spacing [-]; overlap H - C, zs, zn, zl, y_w [mm]
STUDIED_RATIO = (0.6829, 1.0)
STUDIED_SHAPE = np.array([[1.2317, -0.6414, -0.0317, 1.3655, 0.1238], [1.1161, -0.458, -0.1604, 1.1979, 0.0955]])
STUDIED_REACH = 0.625  # half the sum of the studied diameters [mm]
#: bulge over wale spacing: with less than the first the loops hardly interlace, with more than the last legs collide
BULGE = (0.2, 0.45)


@dataclass(frozen=True)
class Loop:
    """Harmonic loop [mm]: wale spacing, height, bulge, levels z of sinker arc, needle arc and legs, y of the weft."""

    wale: float
    height: float
    bulge: float
    sinker: float
    needle: float
    leg: float
    weft: float

    def points(self, theta: Array) -> Array:
        """Centre-line [mm], (n, 3), at loop angles ``theta`` (n,)."""
        second = 0.5 * (0.5 * (self.sinker + self.needle) - self.leg)
        x = self.wale * (theta - np.pi) / (2.0 * np.pi) + self.bulge * np.sin(2.0 * theta)
        y = -0.5 * self.height * np.cos(theta)
        z = self.leg + second + 0.5 * (self.sinker - self.needle) * np.cos(theta) + second * np.cos(2.0 * theta)
        return np.column_stack([x, y, z])

    def length(self) -> float:
        """Arc length of one loop [mm]."""
        return polyline_length(self.points(np.linspace(0.0, 2.0 * np.pi, 2001)))


def start_loop(wale: float, course: float, loop_length: float, reach: float) -> Loop:
    """Loop on ``wale`` x ``course`` spacing, of ``loop_length`` or, if that interlaces badly, longer; all [mm].

    ``reach`` is half the sum of both diameters [mm]. Shape parameters are interpolated between the two studied cells by
    course over wale spacing and scaled with ``reach``. Raises :class:`InputError` for a loop too long for its cell.
    """
    from scipy.optimize import brentq

    shape = [np.interp(course / wale, STUDIED_RATIO, column) for column in STUDIED_SHAPE.T]
    overlap, sinker, needle, leg, weft = (float(v) * reach / STUDIED_REACH for v in shape)

    def loop(bulge: float) -> Loop:
        return Loop(wale, course + overlap, bulge, sinker, needle, leg, weft)

    tight, wide = (loop(share * wale) for share in BULGE)
    if loop_length <= tight.length():
        return tight
    if loop_length >= wide.length():
        raise InputError(
            f"fabric.loop_length = {loop_length:g} mm is too long for {wale:.3f} x {course:.3f} mm spacing: "
            f"expected less than {wide.length():.2f} mm"
        )
    return loop(float(brentq(lambda b: loop(b).length() - loop_length, tight.bulge, wide.bulge, xtol=1e-12)))
