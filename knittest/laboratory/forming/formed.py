"""Source of the results of forming: the mid-surface of the blank over its tools."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, History, Mesh
from knittest.tooling.toolset import ToolSet

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: fabric is to follow a tool where this slopes by less [deg]; between the tools it spans freely
FOLLOWS = 30.0
#: step of the finite difference that gives a tool's slope [mm]
STEP = 0.01


@dataclass(frozen=True)
class Formed:
    """Points of the mid-surface, (n, 3) [mm]: ``start`` flat and ``now``; ``height`` above the tool that they should
    follow [mm], (n,), nan between the tools, and whether that is the ``die``, (n,).
    """

    start: Array
    now: Array
    height: Array
    on_die: NDArray[np.bool_]

    @property
    def on_flange(self) -> Array:
        """Heights above the die [mm] of what should lie on it."""
        found: Array = self.height[np.isfinite(self.height) & self.on_die]
        return found

    @property
    def under_stamp(self) -> Array:
        """Distances from the stamp of what should follow it [mm]; the die's floor limits them."""
        found: Array = self.height[np.isfinite(self.height) & ~self.on_die]
        return found


def surface_nodes(mesh: Mesh) -> Index:
    """Nodes of the mid-surface: all of a sheet; those of the reinforcing yarns, which carry the fabric."""
    cells = mesh.cells
    if mesh.kind == "beams":
        cells = cells[np.isin(mesh.part, [mesh.part_names.index(name) for name in ("warp", "weft")])]
    return np.unique(cells)


def formed(history: History, frame: Frame, tools: ToolSet, thickness: float, travel: float) -> Formed:
    """The mid-surface in ``frame``, the stamp ``travel`` [mm] down from its start on the blank of ``thickness`` [mm].

    A point keeps the distance from the middle of the flat blank that it had at the start, as weft has from warp.
    """
    nodes = surface_nodes(history.mesh)
    start, now = history.frames[0].position[nodes], frame.position[nodes]
    half, offset, up = 0.5 * thickness, start[:, 2], np.array([0.0, 0.0, STEP])
    steep = np.cos(np.deg2rad(FOLLOWS))
    below, above = now, now + np.array([0.0, 0.0, travel])
    die, stamp = tools.die.distance(below), tools.stamp.distance(above)
    on_die = tools.die.distance(below + up) - die > STEP * steep
    on_stamp = stamp - tools.stamp.distance(above + up) > STEP * steep
    height = np.where(on_die, die - half - offset, np.inf)
    height = np.where(on_stamp & (stamp < die), stamp - half + offset, height)
    return Formed(start, now, np.where(np.isfinite(height), height, np.nan), on_die & ~(on_stamp & (stamp < die)))
