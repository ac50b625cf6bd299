"""A rounded edge swept along an outline: stamp, die and holder by dimensions are such bodies."""

from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from math import acos, cos, pi, sin, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.tool_shapes import edge_distances
from knittest.models.tool import Tool, swept
from knittest.models.triangle_mesh import TriangleMesh
from knittest.tooling.outline import Outline
from knittest.tooling.solids import cap, wall

Array = NDArray[np.float64]

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
        """The tool for the kernel; its wall is touched up to ``height`` [mm] from the face."""
        beyond = max(self.offset + self.reach, height * tan(self.draft)) + MARGIN
        smallest = min(self.outline.concave_radius - self.offset, float(self.outline.radius.min()))
        low, high = self.outline.bounds
        low, high = low - beyond, high + beyond
        finest = float(np.sqrt(np.prod(high - low) / MOST_SAMPLES))
        spacing = max(min(SPACING, smallest / PER_RADIUS), finest)
        x, y = (np.arange(a, b + spacing, spacing) for a, b in zip(low, high, strict=True))
        plan = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        samples = self._across(self.outline.distance(plan.reshape(-1, 2))).reshape(plan.shape[:2])
        return swept((*low, self.face), spacing, samples, self.radius, self.draft, self.down)

    def solid(self, height: float, outer: Outline | None = None) -> TriangleMesh:
        """Closed mesh of the part up to ``height`` [mm] off the face; round an opening it ends at ``outer``."""
        profile = self._profile(height)
        plan, normal = self.outline.stations(LONGEST, max(self._across(profile[-1, 0]), 0.0))
        rings = [
            _at(plan + self._across(across) * normal, self.face + depth * (1.0 if self.down else -1.0))
            for across, depth in profile
        ]
        pairs = pairwise(rings)
        parts = [wall(a, b) if self.inside == self.down else wall(b, a) for a, b in pairs]
        ends = (float(rings[0][0, 2]), float(rings[-1][0, 2]))
        border = [] if outer is None else [_at(outer.stations(LONGEST)[0], end) for end in ends]
        for k, up in ((0, not self.down), (-1, self.down)):
            if np.ptp(rings[k][:, 0]) > LONGEST:  # a hemisphere's face is a point
                within = partial(self._body_at, edge=self._across(profile[k, 0]), outer=outer)
                parts.append(cap([rings[k], *border[k:][:1]], within, up))
        if border:
            parts.append(wall(*sorted(border, key=lambda ring: float(ring[0, 2]))))
        return TriangleMesh.joined(parts)

    def _across(self, plan: Any) -> Any:
        """Distance in plan from the sharp edge, negative over the face, from that of the outline; and the reverse."""
        return plan if self.inside else self.offset - plan

    def _body_at(self, points: Array, edge: float, outer: Outline | None) -> NDArray[np.bool_]:
        """Tell whether the body is at ``points`` (n, 2) of a height at which it ends at ``edge`` from the outline."""
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


def _at(plan: Array, height: float) -> Array:
    """Points in plan (n, 2) at a ``height``: (n, 3)."""
    return np.column_stack([plan, np.full(len(plan), height)])
