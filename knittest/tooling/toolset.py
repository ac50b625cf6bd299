"""Stamp, die and holder of a forming run, at the places where it starts."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from math import tan

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.config.base import BoundsError
from knittest.config.tools import FLAT, Die, Holder, Opening, Stamp, StlTool, check_fit, opening_offset
from knittest.models.surface import TriangleMesh, distances, read_stl
from knittest.models.tool import Tool
from knittest.tooling.outline import SweptEdge, rectangle, stamp_outline
from knittest.tooling.stl_tool import CELLS, HeightMap, Placement, sampled_distance, stl_body, stl_tool

Array = NDArray[np.float64]

#: size of the meshes of bodies that are endless for the kernel [mm]: walls beyond the depth, thickness of the holder,
#: die and holder beyond the blank, radius of their corners
SPARE, PLATE, RIM, CORNER = 20.0, 10.0, 20.0, 10.0
#: distance of points at which the gap of bodies from files is measured [mm]: a large triangle may cross another body
#: with no corner in it
BETWEEN = 3.0
#: numbers of cubes along x, y and z as one number: a tool is at most 1e5 cubes long
CUBES = np.array([1, 10**6, 10**12])


@dataclass(frozen=True)
class RigidTool:
    """A tool at its start: closed mesh ``solid``; ``make`` samples it for the kernel.

    ``exact`` is the signed distance [mm] of points (n, 3) of a tool by dimensions. A tool from a file has ``stl``,
    ``place`` and ``mesh``, as it was read, instead; ``notes`` say what was mended in the file.
    """

    solid: TriangleMesh
    make: Callable[[], Tool]
    exact: Callable[[Array], Array] | None = None
    stl: StlTool | None = None
    place: Placement | None = None
    mesh: TriangleMesh | None = None
    notes: tuple[str, ...] = ()

    @cached_property
    def tool(self) -> Tool:
        """Tool for the kernel."""
        return self.make()

    def distance(self, points: Array) -> Array:
        """Signed distance [mm] of ``points`` (n, 3): exact for a tool by dimensions, sampled for one from a file."""
        return sampled_distance(self.tool, points) if self.exact is None else self.exact(points)

    def exact_distance(self, points: Array) -> Array:
        """Signed distance [mm] of a few ``points`` (n, 3); for a tool from a file, from its triangles."""
        found = self.distance(points)
        if self.stl is None:
            return found
        near = distances(self.solid.corners, points, np.abs(found) + 2.0 * self.stl.spacing)
        return np.copysign(np.where(np.isfinite(near), near, np.abs(found)), found)

    @cached_property
    def gap_points(self) -> Array:
        """Points of its surface [mm], (n, 3), at which gaps are measured."""
        if self.exact is not None:
            return self.solid.points
        points = self.solid.spread(BETWEEN)  # long triangles have many more than one in a cube of half the distance
        _, first = np.unique(np.floor(points / (0.5 * BETWEEN)).astype(np.int64) @ CUBES, return_index=True)
        return points[first]

    def height_map(self, blank: tuple[float, float], *, below: bool = False, cells: int = CELLS) -> HeightMap:
        """Height map over the ``blank`` of its upper side, or of its lower side with heights counted downwards."""
        known: dict[tuple[object, ...], HeightMap] = self.__dict__.setdefault("_known_maps", {})
        if (blank, below, cells) not in known:
            known[blank, below, cells] = HeightMap.of(self.solid, blank, below=below, cells=cells)
        return known[blank, below, cells]

    def with_fields(self, **fields: object) -> "RigidTool":
        """Tool from the same file with other ``fields`` of its :class:`StlTool`."""
        assert self.stl is not None and self.place is not None
        stl = self.stl.model_copy(update=fields)
        return from_file(stl, self.place, self.mesh if stl.path == self.stl.path else None)


@dataclass(frozen=True)
class ToolSet:
    """Tools of a run."""

    stamp: RigidTool
    die: RigidTool
    holder: RigidTool | None

    @property
    def by_name(self) -> dict[str, RigidTool]:
        """Existing tools by name."""
        named = {"stamp": self.stamp, "die": self.die}
        return named if self.holder is None else {**named, "holder": self.holder}

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on what was mended in files."""
        return tuple(f"{name}: {note}" for name, tool in self.by_name.items() for note in tool.notes)


def build_tools(
    stamp: Stamp, die: Die, holder: Holder | None, depth: float, thickness: float, blank: tuple[float, float]
) -> ToolSet:
    """Build tools for a centred ``blank`` (lengths along x and y) of ``thickness``, formed to ``depth`` [mm].

    The middle of the fabric is at z = 0, the die's face at -thickness / 2, the holder's face and the lowest point of
    the stamp at thickness / 2. Raises :class:`InputError` for dimensions or files that do not make tools.
    """
    try:
        check_fit(stamp, die, holder, depth)
    except BoundsError as error:
        raise InputError(f"rig.{error}") from None
    above, tall = 0.5 * thickness, depth + SPARE

    def opened(opening: Opening, face: float, height: float, down: bool) -> RigidTool:
        if opening.stl is not None:
            return from_file(opening.stl, Placement(face, 1.0 if down else -1.0, tall, blank))
        offset = opening_offset(stamp, opening, depth)
        edge = SweptEdge(stamp_outline(stamp), face, opening.edge_radius_mm, inside=False, down=down, offset=offset)
        low, high = edge.outline.bounds
        wide = 2.0 * (np.maximum(-low, high) + edge.offset + edge.radius)
        if (wide > np.array(blank)).any():
            raise InputError(f"rig.stamp: its opening is {wide.max():.4g} mm wide; expected less than the blank")
        outer = rectangle(blank[0] + 2.0 * RIM, blank[1] + 2.0 * RIM, CORNER)
        return RigidTool(edge.solid(max(height, edge.radius + 1.0), outer), partial(edge.tool, height), edge.distance)

    if stamp.stl is not None:
        punch = from_file(stamp.stl, Placement(above, 1.0, tall, blank))
    else:
        punch = _punch(stamp, above, tall)
    plate = None if holder is None else opened(holder, above, PLATE, down=True)
    return ToolSet(punch, opened(die, -above, tall, down=False), plate)


def _punch(stamp: Stamp, face: float, tall: float) -> RigidTool:
    outline = stamp_outline(stamp)
    if tall * tan(stamp.draft) > outline.concave_radius - FLAT:
        raise InputError(
            f"rig.stamp.t.draft_angle: widens the stamp by {tall * tan(stamp.draft):.3g} mm at its top; expected less "
            f"than the radius of its inner corners, {outline.concave_radius:.3g} mm"
        )
    radius = stamp.t.edge_radius_mm if stamp.kind == "t" else stamp.hemisphere.radius_mm  # a hemisphere is all edge
    edge = SweptEdge(outline, face, radius, inside=True, down=True, draft=stamp.draft)
    return RigidTool(edge.solid(max(tall, edge.radius + 1.0)), partial(edge.tool, tall), edge.distance)


def from_file(stl: StlTool, place: Placement, mesh: TriangleMesh | None = None) -> RigidTool:
    """Tool from a file at its ``place``; ``mesh`` of the file, if known. Raises :class:`InputError`."""
    mesh = read_stl(data_dir() / stl.path) if mesh is None else mesh
    body, notes = stl_body(stl, place, mesh)
    return RigidTool(body, partial(stl_tool, stl, body, place), stl=stl, place=place, mesh=mesh, notes=tuple(notes))
