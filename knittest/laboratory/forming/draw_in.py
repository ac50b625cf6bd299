"""Draw-in: how far the edge of the blank has moved inwards."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: a node of a sheet belongs to an edge that it is as near to [mm]
EDGE = 1e-6
#: share of a side about its middle over which the draw-in of the side is a mean
MIDDLE = 0.1
#: sides by the yarns that end there, with the axis across them and the direction outwards
SIDES = {"weft_low": (0, -1.0), "warp_low": (1, -1.0), "weft_high": (0, 1.0), "warp_high": (1, 1.0)}


@dataclass(frozen=True)
class DrawIn:
    """Points along the edges of the blank: ``start`` and ``now`` (n, 2) [mm], ``side`` (n,) as an index of
    :data:`SIDES`, ``drawn`` (n,), the way inwards, normal to the side, and ``rise`` (n,) upwards [mm].
    """

    start: Array
    now: Array
    side: Index
    drawn: Array
    rise: Array

    def middle(self, side: str) -> float:
        """Mean draw-in of the middle of a side [mm]."""
        here = self.side == list(SIDES).index(side)
        along = self.start[here, 1 - SIDES[side][0]]
        near = np.abs(along) <= max(MIDDLE * np.abs(along).max(), np.abs(along).min())
        return float(self.drawn[here][near].mean())

    def table(self) -> dict[str, Array]:
        """Columns of draw-in.csv."""
        return {
            "side": np.array(list(SIDES))[self.side],
            "start_x_mm": self.start[:, 0],
            "start_y_mm": self.start[:, 1],
            "x_mm": self.now[:, 0],
            "y_mm": self.now[:, 1],
            "draw_in_mm": self.drawn,
        }


def draw_in(mesh: Mesh, first: Frame, last: Frame) -> DrawIn:
    """The four edges, round the blank, between two frames."""
    rows = []
    for k, (name, (axis, sign)) in enumerate(SIDES.items()):
        edge = _edge(mesh, first.position, name)
        order = edge[np.argsort(first.position[edge, 1 - axis] * (1.0 if k in (1, 2) else -1.0))]
        start, now = first.position[order], last.position[order]
        drawn, rise = sign * (start[:, axis] - now[:, axis]), now[:, 2] - start[:, 2]
        rows.append((start[:, :2], now[:, :2], np.full(len(order), k), drawn, rise))
    return DrawIn(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _edge(mesh: Mesh, position: Array, side: str) -> Index:
    """Nodes of a side: the outermost of a sheet; the ends of the yarns that are cut there."""
    axis, sign = SIDES[side]
    if mesh.kind == "shells":
        out = sign * position[:, axis]
        return np.flatnonzero(out > out.max() - EDGE)
    system = mesh.part == mesh.part_names.index(side.split("_")[0])
    cells = [mesh.cells[mesh.yarn == yarn] for yarn in np.unique(mesh.yarn[system])]
    ends = np.array([(yarn[0, 0], yarn[-1, 1]) for yarn in cells])
    return np.asarray(np.take_along_axis(ends, np.argmax(sign * position[ends, axis], axis=1)[:, None], axis=1)[:, 0])
