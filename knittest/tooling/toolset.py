"""Stamp, die and holder of a forming run, at the places where it starts."""

from collections.abc import Callable
from dataclasses import dataclass
from math import tan

import numpy as np
from numpy.typing import NDArray

from knittest.config.base import BoundsError
from knittest.config.tools import FLAT, Die, Holder, Opening, Stamp, check_fit, opening_offset
from knittest.errors import InputError
from knittest.models.boundary import Tool
from knittest.tooling.outline import rectangle
from knittest.tooling.shapes import stamp_edge, stamp_outline
from knittest.tooling.solids import Solid
from knittest.tooling.swept import SweptEdge

Array = NDArray[np.float64]

#: what the meshes show of bodies that have no end for the kernel [mm]: walls beyond the depth, thickness of the holder,
#: die and holder beyond the blank, radius of their corners
SPARE, PLATE, RIM, CORNER = 20.0, 10.0, 20.0, 10.0


@dataclass(frozen=True)
class RigidTool:
    """A tool at its start: ``tool`` for the kernel, closed mesh ``solid``, exact signed ``distance`` [mm] of points
    (n, 3).
    """

    tool: Tool
    solid: Solid
    distance: Callable[[Array], Array]


@dataclass(frozen=True)
class ToolSet:
    """The tools of a run; ``notes`` say what was mended in files."""

    stamp: RigidTool
    die: RigidTool
    holder: RigidTool | None
    notes: tuple[str, ...] = ()

    @property
    def by_name(self) -> dict[str, RigidTool]:
        """The tools there are, by name."""
        named = {"stamp": self.stamp, "die": self.die}
        return named if self.holder is None else {**named, "holder": self.holder}


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
    above, below = 0.5 * thickness, -0.5 * thickness
    outline = stamp_outline(stamp)
    punch = SweptEdge(outline, above, stamp_edge(stamp), inside=True, down=True, draft=stamp.draft)
    tall = depth + SPARE
    if tall * tan(stamp.draft) > outline.concave_radius - FLAT:
        wide = f"widens the stamp by {tall * tan(stamp.draft):.3g} mm at its top"
        raise InputError(f"rig.stamp.t.draft_angle: {wide}, which must leave its inner corners a radius")
    outer = rectangle(blank[0] + 2.0 * RIM, blank[1] + 2.0 * RIM, CORNER)

    def opened(opening: Opening, face: float, height: float, down: bool) -> RigidTool:
        offset = opening_offset(stamp, opening, depth)
        edge = SweptEdge(outline, face, opening.kernel("edge_radius"), inside=False, down=down, offset=offset)
        low, high = outline.bounds
        reach = 2.0 * (np.maximum(-low, high) + offset + edge.radius)
        if (reach > np.array(blank)).any():
            raise InputError(f"rig.stamp: the opening is {reach.max():.4g} mm wide; expected one within the blank")
        return RigidTool(edge.tool(height), edge.solid(max(height, edge.radius + 1.0), outer), edge.distance)

    return ToolSet(
        RigidTool(punch.tool(tall), punch.solid(max(tall, punch.radius + 1.0)), punch.distance),
        opened(die, below, tall, down=False),
        None if holder is None else opened(holder, above, PLATE, down=True),
    )
