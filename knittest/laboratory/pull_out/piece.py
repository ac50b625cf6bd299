"""Nodes of a piece of fabric: of the inlay that is pulled, and what the clamps hold."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.fabric.strip import YarnPath
from knittest.laboratory.pull_out.config import PullOutRun
from knittest.laboratory.strips import AXIS, pitch
from knittest.models.meso import chain_order

Index = NDArray[np.int64]


@dataclass(frozen=True)
class Nodes:
    """Nodes of the pulled inlay in the order of the model: its clamped end, its free ``tail``; those of the piece
    ``held``, and how wide [mm] the edge is that its clamps hold.
    """

    pulled: Index
    tail: int
    held: Index
    edge: float


def nodes_of(run: PullOutRun, paths: list[YarnPath], size: tuple[float, float]) -> Nodes:
    """Nodes of ``paths``, numbered as in the model, in a piece of ``size`` (along x, y) [mm]."""
    direction = run.rig.direction
    axis = AXIS[direction]
    ordered = sorted(paths, key=chain_order)
    start = np.concatenate([[0], np.cumsum([len(p.points) for p in ordered])])
    own = middle([p.index for p in ordered if p.system == direction])
    chain = next(k for k, p in enumerate(ordered) if (p.system, p.index) == (direction, own))
    points = np.concatenate([p.points for p in ordered])
    along, across = points[:, axis], points[:, 1 - axis]
    if run.rig.clamped == "sides":
        edge = pitch(run, "weft" if direction == "warp" else "warp")
        gripped = (across <= edge) | (across >= size[1 - axis] - edge)
    else:
        edge = pitch(run, direction)
        gripped = along <= edge
    gripped[start[chain] : start[chain + 1]] = False
    ends = int(start[chain]), int(start[chain + 1]) - 1
    tail, top = sorted(ends, key=lambda node: float(along[node]))
    return Nodes(np.array([top], np.int64), tail, np.flatnonzero(gripped), edge)


def middle(indices: list[int]) -> int:
    """Index of the middle yarn."""
    return sorted(indices)[len(indices) // 2]
