"""Forming tools from dimensions: outlines in plan, rounded edges swept along them, closed meshes of triangles."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from math import acos, cos, pi, sin, tan
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import Delaunay

from knittest.config.tools import Stamp
from knittest.kernels.tool_shapes import edge_distances
from knittest.models.surface import TriangleMesh
from knittest.models.tool import Tool, swept_edge_tool

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
            passed = np.flatnonzero(_is_in_arc(off, start, span))
            _keep_nearer(found, passed, np.sign(span) * (np.hypot(off[passed, 0], off[passed, 1]) - radius))
        for begin, end in self._lines():
            x, y = end - begin
            length = max(float(np.linalg.norm(end - begin)), 1e-9)
            from_endless_line = np.abs((p[:, 0] - begin[0]) * y - (p[:, 1] - begin[1]) * x) / length
            near = np.flatnonzero(from_endless_line <= np.abs(found) + SLACK)
            _keep_nearer(found, near, _distance_from_line(p[near], begin, end))
        return found

    def stations(self, longest: float, reach: float = 0.0) -> tuple[Array, Array]:
        """Points and outward normals (n, 2), at most ``longest`` [mm] apart, also on an outline offset by ``reach``."""
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
        path = np.vstack(points)
        distinct = np.linalg.norm(path - np.roll(path, 1, axis=0), axis=1) > 1e-9
        return path[distinct], np.vstack(normals)[distinct]

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


def _is_in_arc(off: Array, start: float, span: float) -> NDArray[np.bool_]:
    """Return whether rays of an arc from ``start`` over ``span`` [rad] meet points ``off`` (n, 2) from its centre."""
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


def _distance_from_line(p: Array, begin: Array, end: Array) -> Array:
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


def stamp_outline(stamp: Stamp) -> Outline:
    """Sharp outline of the bottom of a stamp by dimensions; the box round it is centred on the origin."""
    if stamp.kind != "t":
        return circle(stamp.hemisphere.radius_mm)
    t = stamp.t
    bar, stem = 0.5 * t.bar_length_mm, 0.5 * t.stem_width_mm
    top = 0.5 * (t.bar_width_mm + t.stem_length_mm)
    side = top - t.bar_width_mm
    corners = [
        (stem, -top), (stem, side), (bar, side), (bar, top), (-bar, top), (-bar, side), (-stem, side), (-stem, -top),
    ]  # fmt: skip
    outer, inner = t.outer_corner_radius_mm, t.inner_corner_radius_mm
    return rounded_polygon(corners, [outer, inner, outer, outer, outer, outer, inner, outer])


def wall(lower: Array, upper: Array) -> Array:
    """Triangles between two rings (n, 3) that turn left seen from above; ``upper`` is above seen from outside."""
    low, high = np.roll(lower, -1, axis=0), np.roll(upper, -1, axis=0)
    return np.concatenate([np.stack([lower, low, high], axis=1), np.stack([lower, high, upper], axis=1)])


def cap(rings: Sequence[Array], inside: Callable[[Array], NDArray[np.bool_]], up: bool) -> Array:
    """Flat triangles between ``rings`` (n, 3) of one height where ``inside`` of their centres (m, 2) is true.

    The edges of a ring become edges of triangles because nothing else lies as near to them as their ends (Delaunay).
    """
    points = np.concatenate(rings)
    triangles = Delaunay(points[:, :2]).simplices
    corners: Array = points[triangles]
    corners = corners[inside(corners[:, :, :2].mean(axis=1))]
    a, b, c = np.moveaxis(corners[:, :, :2], 1, 0)
    left = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0.0
    return np.where((left == up)[:, None, None], corners, corners[:, ::-1])


#: sides of the meshes: length along the outline, and deepest chord under a rounded edge [mm]
LONGEST, SAG = 1.5, 0.02
#: grid of distances in plan: at most this [mm], and the number of samples over the smallest radius; most samples
SPACING, PER_RADIUS, MOST_SAMPLES = 0.5, 16.0, 1e6
#: samples beyond the rounded edge on every side [mm]
MARGIN = 5.0


@dataclass(frozen=True)
class SweptEdge:
    """A body with a flat face at height ``face`` [mm] that ends in a wall round ``outline``.

    ``inside``: the body lies inside of the outline and its face looks down (a stamp); else it lies outside, an opening
    in a block (face up) or, ``down``, in a plate on the fabric. ``offset`` of the opening from the outline, outwards,
    ``radius`` of the edge [mm], ``draft`` of the wall [rad].
    """

    outline: Outline
    face: float
    radius: float
    inside: bool
    down: bool
    offset: float = 0.0
    draft: float = 0.0

    @property
    def reach(self) -> float:
        """Reach of the rounded edge over the face from the sharp one [mm]."""
        return self.radius * (1.0 - sin(self.draft)) / cos(self.draft)

    def distance(self, points: Array) -> Array:
        """Exact signed distance [mm] of ``points`` (n, 3), (n,), negative in the body, which has no end off its face.

        It is the distance in the plane of height and distance in plan; exact up to where the outline's own distance
        has its ridges, far from the surface.
        """
        across = self._across(self.outline.distance(points))
        height = (points[:, 2] - self.face) * (-1.0 if self.down else 1.0)
        found = np.empty(len(points))
        edge_distances(across, np.ascontiguousarray(height), self.radius, sin(self.draft), cos(self.draft), found)
        return found

    def tool(self, height: float) -> Tool:
        """Tool for the kernel; its wall reaches up to ``height`` [mm] from the face."""
        beyond = max(self.offset + self.reach, height * tan(self.draft)) + MARGIN
        smallest = min(self.outline.concave_radius - self.offset, float(self.outline.radius.min()))
        low, high = self.outline.bounds
        low, high = low - beyond, high + beyond
        finest = float(np.sqrt(np.prod(high - low) / MOST_SAMPLES))
        spacing = max(min(SPACING, smallest / PER_RADIUS), finest)
        x, y = (np.arange(a, b + spacing, spacing) for a, b in zip(low, high, strict=True))
        plan = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        samples = self._across(self.outline.distance(plan.reshape(-1, 2))).reshape(plan.shape[:2])
        return swept_edge_tool((*low, self.face), spacing, samples, self.radius, self.draft, self.down)

    def solid(self, height: float, outer: Outline | None = None) -> TriangleMesh:
        """Closed mesh of the part up to ``height`` [mm] off the face; round an opening it ends at ``outer``."""
        profile = self._profile(height)
        plan, normal = self.outline.stations(LONGEST, max(self._across(profile[-1, 0]), 0.0))
        rings = [
            _lift(plan + self._across(across) * normal, self.face + depth * (1.0 if self.down else -1.0))
            for across, depth in profile
        ]
        pairs = pairwise(rings)
        parts = [wall(a, b) if self.inside == self.down else wall(b, a) for a, b in pairs]
        ends = (float(rings[0][0, 2]), float(rings[-1][0, 2]))
        border = [] if outer is None else [_lift(outer.stations(LONGEST)[0], end) for end in ends]
        for k, up in ((0, not self.down), (-1, self.down)):
            if np.ptp(rings[k][:, 0]) > LONGEST:  # a hemisphere's face is a point
                within = partial(self._is_body, edge=self._across(profile[k, 0]), outer=outer)
                parts.append(cap([rings[k], *border[k:][:1]], within, up))
        if border:
            parts.append(wall(*sorted(border, key=lambda ring: float(ring[0, 2]))))
        return TriangleMesh.from_corners(parts)

    def _across(self, plan: Any) -> Any:
        """Distance in plan from the sharp edge, negative over the face, from that of the outline; and the reverse."""
        return plan if self.inside else self.offset - plan

    def _is_body(self, points: Array, edge: float, outer: Outline | None) -> NDArray[np.bool_]:
        """Return whether ``points`` (n, 2) are in the body where it ends at ``edge`` from the outline."""
        distance = self.outline.distance(points)
        if outer is None:
            return distance < edge
        return (distance > edge) & (outer.distance(points) < 0.0)

    def _profile(self, height: float) -> Array:
        """Distance in plan from the sharp edge and depth off the face [mm], (n, 2), from the face to the wall's end."""
        span = 0.5 * pi - self.draft
        count = max(int(np.ceil(span / (2.0 * acos(1.0 - min(SAG / self.radius, 0.5))))), 4)
        turn = np.linspace(0.0, span, count + 1)
        edge = np.column_stack([self.radius * np.sin(turn) - self.reach, self.radius * (1.0 - np.cos(turn))])
        return np.vstack([edge, [height * tan(self.draft), height]])


def _lift(plan: Array, height: float) -> Array:
    """Points in plan (n, 2) at a ``height``: (n, 3)."""
    return np.column_stack([plan, np.full(len(plan), height)])
