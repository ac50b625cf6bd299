"""Order of the layers: every warp on its side of the wefts that it crosses, or not."""

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, Mesh
from knittest.laboratory.shear_angles import pieces

Array = NDArray[np.float64]


def above(mesh: Mesh, frame: Frame) -> Array:
    """Distance [mm] of the warp above the weft along their common normal at every crossing, (n_warp, n_weft)."""
    (warp, at_warp), (weft, at_weft) = (pieces(mesh, frame, system) for system in ("warp", "weft"))
    across, at = weft.transpose(1, 0, 2), at_weft.transpose(1, 0, 2)
    normal = np.cross(across, warp)
    height: Array = np.sum((at_warp - at) * normal, axis=2) / np.linalg.norm(normal, axis=2)
    return height


def out_of_order(mesh: Mesh, first: Frame, last: Frame) -> int:
    """Crossings whose warp has come to lie on the other side of the weft between two frames."""
    return int(np.count_nonzero(above(mesh, first) * above(mesh, last) < 0.0))
