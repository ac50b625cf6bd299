"""Closed outlines in plan of straight lines and arcs that join without corners."""

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

#: overlap of an arc [rad] or line [mm] with its neighbours, so that rounding leaves no gap between them
SLACK = 1e-9


@dataclass(frozen=True)
class Outline:
    """Arcs round ``centre`` (n, 2) from the direction ``start`` (n,) over the signed angle ``span`` (n,) [rad], in the
    order of the path, with straight lines between them; ``radius`` (n,) [mm]. The inside lies on the left.

    Where the path turns right the outline is concave; ``span`` is negative there.
    """

    centre: Array
    radius: Array
    start: Array
    span: Array

    def distance(self, points: ArrayLike) -> Array:
        """Signed distance in plan [mm] of ``points`` (n, 2 or more), (n,), negative inside.

        Exact: that of the nearest line or arc. An arc counts where its rays pass, a line for all else.
        """
        p = np.asarray(points, float)[:, :2]
        found = np.full(len(p), np.inf)
        for centre, radius, start, span in zip(self.centre, self.radius, self.start, self.span, strict=True):
            off = p - centre
            passed = np.flatnonzero(_passed(off, start, span))
            _keep_nearer(found, passed, np.sign(span) * (np.hypot(off[passed, 0], off[passed, 1]) - radius))
        for begin, end in self._lines():
            near = np.flatnonzero(_from_endless_line(p, begin, end) <= np.abs(found) + SLACK)
            _keep_nearer(found, near, _from_line(p[near], begin, end))
        return found

    def stations(self, longest: float, reach: float = 0.0) -> tuple[Array, Array]:
        """Points (n, 2) on the outline at most ``longest`` [mm] apart, also where it is moved outwards by ``reach``,
        and outward normals (n, 2).
        """
        points, normals = [], []
        lines = self._lines()
        for k in range(len(self.radius)):
            bend = np.sign(self.span[k])
            arc = abs(self.span[k]) * max(self.radius[k], self.radius[k] + bend * reach)
            angle = self.start[k] + np.linspace(0.0, self.span[k], max(int(np.ceil(arc / longest)), 2) + 1)
            ray = np.column_stack([np.cos(angle), np.sin(angle)])
            points.append(self.centre[k] + self.radius[k] * ray)
            normals.append(bend * ray)
            if lines:
                begin, end = lines[k]
                count = max(int(np.ceil(np.linalg.norm(end - begin) / longest)), 1)
                share = np.arange(1, count)[:, None] / count
                points.append(begin + share * (end - begin))
                normals.append(np.repeat(normals[-1][-1:], count - 1, axis=0))
        return _distinct(np.vstack(points), np.vstack(normals))

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner (2,) [mm] of a box round it."""
        return (self.centre - self.radius[:, None]).min(axis=0), (self.centre + self.radius[:, None]).max(axis=0)

    @property
    def concave_radius(self) -> float:
        """Smallest radius of its concave arcs [mm]; infinite without any."""
        return float(self.radius[self.span < 0.0].min(initial=np.inf))

    @property
    def area(self) -> float:
        """Area inside [mm2]: of the polygon through the ends of the arcs, and what lies between arcs and chords."""
        first, last = self._ends()
        path = np.stack([first, last], axis=1).reshape(-1, 2)
        ahead = np.roll(path, -1, axis=0)
        polygon = 0.5 * float(np.sum(path[:, 0] * ahead[:, 1] - path[:, 1] * ahead[:, 0]))
        return polygon + 0.5 * float(np.sum(self.radius**2 * (self.span - np.sin(self.span))))

    def _ends(self) -> tuple[Array, Array]:
        def at(angle: Array) -> Array:
            return self.centre + self.radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])

        return at(self.start), at(self.start + self.span)

    def _lines(self) -> list[tuple[Array, Array]]:
        """Begin and end of the straight line after each arc; none for a full circle."""
        first, last = self._ends()
        return [] if len(self.radius) == 1 else list(zip(last, np.roll(first, -1, axis=0), strict=True))


def circle(radius: float) -> Outline:
    """Circle of ``radius`` [mm] about the origin."""
    return Outline(np.zeros((1, 2)), np.array([radius]), np.zeros(1), np.array([2.0 * pi]))


def rounded_polygon(corners: ArrayLike, radii: ArrayLike) -> Outline:
    """Polygon with ``corners`` (n, 2) [mm] in left turns round its inside, each rounded by its radius > 0 (n,) [mm]."""
    corner = np.asarray(corners, float)
    radius = np.asarray(radii, float)
    ahead = np.roll(corner, -1, axis=0) - corner
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    before = np.roll(ahead, 1, axis=0)
    cross = before[:, 0] * ahead[:, 1] - before[:, 1] * ahead[:, 0]
    turn = np.arctan2(cross, np.sum(before * ahead, axis=1))
    begin = corner - (radius * np.tan(0.5 * np.abs(turn)))[:, None] * before
    left = np.sign(turn)[:, None] * np.column_stack([-before[:, 1], before[:, 0]])
    return Outline(begin + radius[:, None] * left, radius, np.arctan2(-left[:, 1], -left[:, 0]), turn)


def rectangle(length_x: float, length_y: float, radius: float) -> Outline:
    """Rectangle about the origin with rounded corners [mm]."""
    x, y = 0.5 * length_x, 0.5 * length_y
    return rounded_polygon([(-x, -y), (x, -y), (x, y), (-x, y)], np.full(4, radius))


def _passed(off: Array, start: float, span: float) -> NDArray[np.bool_]:
    """Tell whether the rays of an arc from direction ``start`` over ``span`` [rad] pass ``off`` (n, 2) its centre."""
    if abs(span) >= 2.0 * pi:
        return np.ones(len(off), bool)
    bend, end, x, y = np.sign(span), start + span, off[:, 0], off[:, 1]
    slack = -SLACK * (np.abs(x) + np.abs(y))
    behind_start = bend * (cos(start) * y - sin(start) * x) >= slack
    before_end = bend * (x * sin(end) - y * cos(end)) >= slack
    return behind_start & before_end if abs(span) <= pi else behind_start | before_end


def _keep_nearer(found: Array, index: NDArray[np.intp], candidate: Array) -> None:
    """Put into ``found`` at ``index`` each signed distance of ``candidate`` that is smaller."""
    nearer = np.abs(candidate) < np.abs(found[index])
    found[index[nearer]] = candidate[nearer]


def _from_endless_line(p: Array, begin: Array, end: Array) -> Array:
    """Distance of ``p`` (n, 2) from the line through a piece of it: at most that from the piece."""
    along = end - begin
    length = max(float(np.linalg.norm(along)), 1e-9)
    return np.abs((p[:, 0] - begin[0]) * along[1] - (p[:, 1] - begin[1]) * along[0]) / length


def _from_line(p: Array, begin: Array, end: Array) -> Array:
    """Distance of ``p`` (n, 2) from a piece of straight line, negative on its left; infinite for one without length."""
    along = end - begin
    length = float(np.linalg.norm(along))
    if length < 1e-9:
        return np.full(len(p), np.inf)
    along = along / length
    off = p - begin
    share = np.clip(off @ along, 0.0, length)
    rest = off - share[:, None] * along
    side = off[:, 0] * along[1] - off[:, 1] * along[0]
    return np.where(side >= 0.0, 1.0, -1.0) * np.hypot(rest[:, 0], rest[:, 1])


def _distinct(points: Array, normals: Array) -> tuple[Array, Array]:
    """Points and normals without those that repeat the one before, round the end."""
    gap = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
    return points[gap > 1e-9], normals[gap > 1e-9]
