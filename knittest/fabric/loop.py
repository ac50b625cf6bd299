"""Start curves of knitted loops: harmonic in the loop angle, right topology, length set by their bulge. Periodic
centre-lines and their B-splines.

theta = 0 is the middle of the sinker arc, pi that of the needle arc; x across the wales, y along them, z to the
technical face. It has the topology of Choi & Lo (2003), Text. Res. J. 73, 739-748, whose half loop
x = a t^3 - 1.5 a t^2 + (a + w) t / 2, y = (c + 2 e)(1 - cos pi t) / 2, z = h (1 - cos 2 pi t) / 2 cannot, with its full
constraint set, be as short as the loops measured in variant 1 (14.78 against 14.4 mm); relaxation decides the shape.
"""

from collections.abc import Sequence
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


def arc_at(curve: Array, period: Array, axis: int, plane: float, near: float = 0.5) -> float:
    """Arc length [mm] from curve[0] at which ``curve`` (m, 3) crosses coordinate ``axis`` = ``plane`` [mm].

    Of several crossings it takes the one nearest to the share ``near`` of the period; images of the plane are excluded.
    """
    line = np.vstack([curve - period, curve, curve + period, curve[:1] + 2.0 * period])
    arc = arc_length(line)
    side = line[:, axis] - plane
    before = np.flatnonzero((side[:-1] < 0.0) != (side[1:] < 0.0))
    share = side[before] / (side[before] - side[before + 1])
    length = arc[-1] / 3.0
    at = arc[before] + share * np.diff(arc)[before] - length
    return float(at[np.argmin(np.abs(at - near * length))])


def points_on(curve: Array, period: Array, n: int, starts: Sequence[float] = (0.0,)) -> Array:
    """``n`` points [mm], (n, 3), on ``curve`` over one ``period``.

    Equal shares of them lie between ``starts`` [mm], arc lengths in rising order, each equally spaced by arc.

    Between its points (m, 3) the curve is a periodic cubic spline.
    """
    from scipy.interpolate import CubicSpline

    closed = np.vstack([curve, curve[:1] + period])
    arc = arc_length(closed)
    smooth = CubicSpline(arc, closed - arc[:, None] / arc[-1] * period, bc_type="periodic")
    at = starts[0] + arc[-1] * np.arange(n) / n
    if len(starts) > 1:
        share, ends = np.arange(n // len(starts)) * len(starts) / n, np.append(starts[1:], starts[0] + arc[-1])
        at = np.concatenate([a + share * (b - a) for a, b in zip(starts, ends, strict=True)])
    return np.asarray(smooth(at) + at[:, None] / arc[-1] * period)


def control_points(curve: Array, period: Array, n: int, starts: Sequence[float] = (0.0,)) -> Array:
    """``n`` control points [mm], (n, 3), of the periodic quadratic B-spline that follows ``curve`` over ``period``.

    The middles of the pieces are :func:`points_on` the curve; the circulant system is solved for the deviation from the
    straight line, which is periodic.
    """
    straight = np.arange(n)[:, None] / n * period
    deviation = points_on(curve, period, n, starts) - straight
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


# Loops of any stitches. In the plan they are harmonic as above; their heights follow from the sides of the stitches.
#
# Loop (i, j) is pulled through the head of loop (i, j - 1): a knit stitch towards the face, a purl stitch towards the
# back. From the sinker to the needle arc, half a loop crosses the foot and the head of the course before and the foot
# and the head of the course after. With the side s of the stitch and t of the stitch above, it lies on the sides -s,
# +s, +t, -t of the layers there. A monotone cubic joins these heights. Where knit and purl wales are neighbours, the
# sinker arc passes between the layers, behind the warps: the foot lies only a yarn behind the leg that it crosses.

#: overlap H - C over the course spacing: of loops without inlays, and of others
OPEN_OVERLAP, OVERLAP, DENSE_OVERLAP, DENSE_RATIO = 0.45, 0.31, 0.5, 0.317
#: bulge over wale spacing of loops of any stitches
STITCH_BULGE = (0.22, 0.40)
#: points of a loop in which crossings are sought, and which its curve has; side of a loop that nothing parts, in radii
SOUGHT, POINTS, UNPARTED = 240, 2000, 1.05


@dataclass(frozen=True)
class StitchLoops:
    """Courses of loops of any stitches [mm]: spacings, height H, half the height of what the loops enclose, radius.

    ``sides`` (n_courses, n_wales) are those of the stitches: 1 face, -1 back; ``warps`` lie between the wales.
    """

    wale: float
    course: float
    height: float
    side: float
    radius: float
    sides: Array
    warps: bool

    @classmethod
    def of(cls, wale: float, course: float, layers: float, radius: float, sides: Array, warps: bool) -> "StitchLoops":
        """Loops of yarns of ``radius`` around ``layers`` of this height [mm] (0 without inlays)."""
        dense = float(np.clip((1.0 - course / wale) / DENSE_RATIO, 0.0, 1.0))
        overlap = OPEN_OVERLAP if not layers else OVERLAP + (DENSE_OVERLAP - OVERLAP) * dense
        side = 0.5 * layers + radius if layers else UNPARTED * radius
        return cls(wale, course, (1.0 + overlap) * course, side, radius, sides, warps)

    def _plan(self, theta: Array, bulge: float) -> Array:
        x = self.wale * (theta - np.pi) / (2.0 * np.pi) + bulge * np.sin(2.0 * theta)
        return np.column_stack([x, -0.5 * self.height * np.cos(theta)])

    def _crossing_angles(self, bulge: float) -> tuple[list[float], list[float]]:
        """Angles in (0, pi) at which half a loop crosses the course before and the course after, in the plan."""
        step = 2.0 * np.pi / SOUGHT
        theta = np.asarray(step * np.arange(-SOUGHT, 2 * SOUGHT + 1), np.float64)
        line = self._plan(theta, bulge)
        half = np.flatnonzero((theta > 0.0) & (theta < np.pi))
        p, r = line[half][:, None], (line[half + 1] - line[half])[:, None]
        found = []
        for shift in (-self.course, self.course):
            q, s = (line[:-1] + np.array([0.0, shift]))[None], np.diff(line, axis=0)[None]
            cross = r[..., 0] * s[..., 1] - r[..., 1] * s[..., 0]
            between, safe = q - p, np.where(np.abs(cross) < 1e-14, np.nan, cross)
            t = (between[..., 0] * s[..., 1] - between[..., 1] * s[..., 0]) / safe
            u = (between[..., 0] * r[..., 1] - between[..., 1] * r[..., 0]) / safe
            here = np.argwhere((t >= 0.0) & (t < 1.0) & (u >= 0.0) & (u < 1.0))
            found.append(sorted(float(theta[half[i]] + step * t[i, j]) for i, j in here))
        return found[0], found[1]

    def curves(self, bulge: float) -> list[Array]:
        """Centre-lines (n, 3) of the courses over one repeat, from sinker arc to sinker arc."""
        from scipy.interpolate import PchipInterpolator

        before, after = self._crossing_angles(bulge)
        if len(before) != 2 or len(after) != 2:
            raise InputError(
                f"loops of {self.wale:.3f} x {self.course:.3f} mm spacing do not interlace in the plan; expected wale "
                "and course spacings nearer to each other"
            )
        half = [*before, *after]
        courses, wales = self.sides.shape
        theta = np.linspace(0.0, 2.0 * np.pi * wales, POINTS * wales + 1)
        found = []
        for course in range(courses):
            angles: list[float] = []
            heights: list[float] = []
            row, above = self.sides[course], self.sides[(course + 1) % courses]
            for wale in range(-1, wales + 1):
                s, t = float(row[wale % wales]), float(above[wale % wales])
                left, right = (self._foot(s, float(row[(wale + k) % wales])) for k in (-1, 1))
                base = 2.0 * np.pi * wale
                if self.warps and row[(wale - 1) % wales] != row[wale % wales]:
                    angles.append(base)
                    heights.append(-self.side)
                angles += [base + v for v in half] + [base + 2.0 * np.pi - v for v in reversed(half)]
                heights += [self.side * v for v in (left, s, t, -t, -t, t, s, right)]
            line = self._plan(theta, bulge)
            found.append(np.column_stack([line, PchipInterpolator(angles, heights)(theta)]))
        return found

    def _foot(self, s: float, neighbour: float) -> float:
        """Height over the side of the foot of a stitch of side ``s`` towards its ``neighbour``."""
        return -s if neighbour == s else s * (1.0 - 2.0 * UNPARTED * self.radius / self.side)

    def of_length(self, loop_length: float) -> list[Array]:
        """Centre-lines of loops of ``loop_length`` [mm] on average or, where they would interlace badly, near it."""
        from scipy.optimize import brentq

        def excess(bulge: float) -> float:
            curves = self.curves(bulge)
            return sum(polyline_length(c) for c in curves) / self.sides.size - loop_length

        low, high = (share * self.wale for share in STITCH_BULGE)
        while high > low and [len(found) for found in self._crossing_angles(high)] != [2, 2]:
            high -= 0.01 * self.wale
        if excess(low) >= 0.0:
            return self.curves(low)
        return self.curves(high if excess(high) <= 0.0 else float(brentq(excess, low, high, xtol=1e-6)))
