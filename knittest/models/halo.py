"""Images that a periodic cell has, and whether its yarns reach ones that it has not."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.periodic_state import Images
from knittest.kernels.state import Nodes
from knittest.models.contact_tracker import CONTACT_SKIN, YarnContactGroup

Array = NDArray[np.float64]


class Cell(Protocol):
    """The parts of a periodic model that are looked at."""

    nodes: Nodes
    images: Images
    group: YarnContactGroup
    owned: Array

    def name_of(self, node: int) -> str:
        """System and number of the yarn that owns ``node``."""


def beyond(cell: Cell) -> str:
    """Name the image that comes near a node of the cell without being in the model; empty if none does.

    Images next to those kept are placed as a flat fabric has them: bending takes them apart by a small part of a cell.
    """
    from scipy.spatial import cKDTree

    images, own = cell.images, np.flatnonzero(cell.owned)
    x, half = cell.nodes.position[:, own].T, float(cell.group.half_piece[own].max())
    most = np.abs(images.times).max(axis=0).astype(int) + 1
    held = set(zip(images.of[images.ghost].tolist(), images.master.tolist(), strict=True))
    number = {tuple(t): k for k, t in enumerate(images.times.astype(int).tolist())}
    reach = 2.0 * float(cell.group.bound.max()) + CONTACT_SKIN + 2.0 * half
    low, high = x.min(axis=0) - reach, x.max(axis=0) + reach
    tree, vectors = cKDTree(x), images.lattice[:6].reshape(2, 3)
    for i, j in np.ndindex(*(2 * most + 1)):
        times = (int(i - most[0]), int(j - most[1]))
        if times == (0, 0):
            continue
        moved = x + times @ vectors
        k = number.get(times)
        inside = ((moved >= low) & (moved <= high)).all(axis=1)
        for m in np.flatnonzero(inside):
            if k is not None and (k, int(own[m])) in held:
                continue
            distance, nearest = tree.query(moved[m])
            radius = cell.group.bound[own[np.array([m, int(nearest)])]].sum()
            if distance < radius + CONTACT_SKIN + 2.0 * half:
                return (
                    f"{cell.name_of(int(own[m]))} and {cell.name_of(int(own[nearest]))} come near each other where the "
                    f"cell has no image, {times[0]:+d} and {times[1]:+d} cells away; keep more images: a larger "
                    "rig.slide, or halo of a cell posed by hand"
                )
    return ""
