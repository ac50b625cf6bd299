"""Stamp, die and holder of a forming run, at the places where it starts."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import tan

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.base import BoundsError
from knittest.config.tools import FLAT, Die, Holder, Opening, Stamp, StlTool, check_fit, opening_offset
from knittest.models.tool import Tool
from knittest.models.triangle_mesh import TriangleMesh
from knittest.tooling.from_stl import Placement, sampled_distance, stl_body, stl_tool
from knittest.tooling.outline import rectangle
from knittest.tooling.shapes import stamp_edge, stamp_outline
from knittest.tooling.swept import SweptEdge

Array = NDArray[np.float64]

#: what the meshes show of bodies that have no end for the kernel [mm]: walls beyond the depth, thickness of the holder,
#: die and holder beyond the blank, radius of their corners
SPARE, PLATE, RIM, CORNER = 20.0, 10.0, 20.0, 10.0
#: distance of the points at which bodies from files are asked for the gap between them [mm]: a large triangle may run
#: through another body with no corner in it
BETWEEN = 3.0


@dataclass(frozen=True)
class RigidTool:
    """A tool at its start: ``tool`` for the kernel, closed mesh ``solid``, signed ``distance`` [mm] of points (n, 3),
    exact for a tool by dimensions, sampled for one from a file; ``notes`` say what was mended in that.
    """

    tool: Tool
    solid: TriangleMesh
    distance: Callable[[Array], Array]
    notes: tuple[str, ...] = ()

    @property
    def asked(self) -> Array:
        """Points of its surface [mm], (n, 3), that stand for it where a gap is asked for."""
        return self.solid.spread(BETWEEN) if self.tool.samples.size else self.solid.points


@dataclass(frozen=True)
class ToolSet:
    """The tools of a run; ``gap`` [mm] is the narrowest between stamp and die at full depth."""

    stamp: RigidTool
    die: RigidTool
    holder: RigidTool | None
    gap: float

    @property
    def by_name(self) -> dict[str, RigidTool]:
        """The tools there are, by name."""
        named = {"stamp": self.stamp, "die": self.die}
        return named if self.holder is None else {**named, "holder": self.holder}

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on what was mended in files."""
        return tuple(f"{name}: {note}" for name, tool in self.by_name.items() for note in tool.notes)


def build_tools(
    stamp: Stamp, die: Die, holder: Holder | None, depth: float, thickness: float, blank: tuple[float, float]
) -> ToolSet:
    """Tools on a ``blank`` (lengths along x and y) of ``thickness``, centred on the origin, drawn ``depth`` deep [mm].

    The fabric's middle is at z = 0: the die's face lies at -thickness / 2, the holder's at thickness / 2, and the
    stamp's lowest point too. Raises :class:`InputError` for dimensions or files that do not make tools.
    """
    try:
        check_fit(stamp, die, holder, depth)
    except BoundsError as error:
        raise InputError(f"rig.{error}") from None
    above, tall = 0.5 * thickness, depth + SPARE

    def opened(opening: Opening, face: float, height: float, down: bool) -> RigidTool:
        if opening.stl is not None:
            return _from_file(opening.stl, Placement(face, 1.0 if down else -1.0, tall, blank))
        edge = SweptEdge(
            stamp_outline(stamp), face, opening.edge_radius_mm, inside=False, down=down,
            offset=opening_offset(stamp, opening, depth),
        )  # fmt: skip
        return _opening(edge, height, blank)

    punch = (
        _from_file(stamp.stl, Placement(above, 1.0, tall, blank))
        if stamp.stl is not None
        else _punch(stamp, above, tall)
    )
    block = opened(die, -above, tall, down=False)
    plate = None if holder is None else opened(holder, above, PLATE, down=True)
    gap = _narrowest(punch, block, depth)
    if gap <= 0.0:
        raise InputError(f"rig.die: stamp and die run {-gap:.3g} mm into each other at a depth of {depth:g} mm")
    return ToolSet(punch, block, plate, gap)


def _punch(stamp: Stamp, face: float, tall: float) -> RigidTool:
    outline = stamp_outline(stamp)
    if tall * tan(stamp.draft) > outline.concave_radius - FLAT:
        wide = f"widens the stamp by {tall * tan(stamp.draft):.3g} mm at its top"
        raise InputError(f"rig.stamp.t.draft_angle: {wide}, which must leave its inner corners a radius")
    edge = SweptEdge(outline, face, stamp_edge(stamp), inside=True, down=True, draft=stamp.draft)
    return RigidTool(edge.tool(tall), edge.solid(max(tall, edge.radius + 1.0)), edge.distance)


def _opening(edge: SweptEdge, height: float, blank: tuple[float, float]) -> RigidTool:
    low, high = edge.outline.bounds
    wide = 2.0 * (np.maximum(-low, high) + edge.offset + edge.radius)
    if (wide > np.array(blank)).any():
        raise InputError(f"rig.stamp: its opening is {wide.max():.4g} mm wide; expected one within the blank")
    outer = rectangle(blank[0] + 2.0 * RIM, blank[1] + 2.0 * RIM, CORNER)
    return RigidTool(edge.tool(height), edge.solid(max(height, edge.radius + 1.0), outer), edge.distance)


def _from_file(stl: StlTool, place: Placement) -> RigidTool:
    body, notes = stl_body(stl, place)
    tool = stl_tool(stl, body, place)
    return RigidTool(tool, body, partial(sampled_distance, tool), tuple(notes))


def _narrowest(stamp: RigidTool, die: RigidTool, depth: float) -> float:
    """Narrowest gap [mm] between ``stamp``, moved down by ``depth``, and ``die``, on either's surface."""
    down = np.array([0.0, 0.0, depth])
    return float(min(die.distance(stamp.asked - down).min(), stamp.distance(die.asked + down).min()))
