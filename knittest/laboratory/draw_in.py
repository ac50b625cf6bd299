"""Draw-in: how far the edge of the blank has moved inwards."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.laboratory.formed import Formed

Array = NDArray[np.float64]

#: a point belongs to an edge that it is as near to [mm]
EDGE = 1e-6
#: share of a side about its middle over which the draw-in of the side is a mean
MIDDLE = 0.1
SIDES = ("weft_low", "warp_low", "weft_high", "warp_high")


@dataclass(frozen=True)
class DrawIn:
    """Points along the edges of the blank: ``start`` and ``now`` (n, 2) [mm], ``side`` (n,) as an index of
    :data:`SIDES` (the yarns that end there), and ``drawn`` (n,), the way inwards, normal to the side [mm].
    """

    start: Array
    now: Array
    side: NDArray[np.int64]
    drawn: Array

    def middle(self, side: str) -> float:
        """Mean draw-in of the middle of a side [mm]."""
        here = self.side == SIDES.index(side)
        along = self.start[here, 1 if side.startswith("weft") else 0]
        near = np.abs(along) <= MIDDLE * np.abs(along).max()
        return float(self.drawn[here][near].mean())

    def table(self) -> dict[str, Array]:
        """Columns of draw-in.csv."""
        return {
            "side": np.array(SIDES)[self.side],
            "start_x_mm": self.start[:, 0],
            "start_y_mm": self.start[:, 1],
            "x_mm": self.now[:, 0],
            "y_mm": self.now[:, 1],
            "draw_in_mm": self.drawn,
        }


def draw_in(found: Formed) -> DrawIn:
    """The four edges, round the blank."""
    start, now = found.start[:, :2], found.now[:, :2]
    rows = []
    for k, (axis, sign) in enumerate(((0, -1.0), (1, -1.0), (0, 1.0), (1, 1.0))):
        out = sign * start[:, axis]
        edge = np.flatnonzero(out > out.max() - EDGE)
        order = edge[np.argsort(start[edge, 1 - axis] * (1.0 if k in (1, 2) else -1.0))]
        drawn = sign * (start[order, axis] - now[order, axis])
        rows.append((start[order], now[order], np.full(len(order), k), drawn))
    return DrawIn(*(np.concatenate(column) for column in zip(*rows, strict=True)))
