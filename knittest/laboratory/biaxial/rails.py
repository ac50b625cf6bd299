"""Rails of the biaxial test, along which the needles slide: blocks outside the four sides."""

import numpy as np

from knittest.base.history import Body, History
from knittest.laboratory.apparatus import at_frames, jaw

NAMES = (("left rail", "right rail"), ("lower rail", "upper rail"))


def rails(history: History, axis: int, sides: tuple[float, float]) -> list[Body]:
    """Rails along a rectangle of ``sides`` (along x, along y) [mm] about the origin, which move apart at the strains of
    the curve: its own along ``axis`` (0: x, 1: y), that of the other system across it.
    """
    own, cross = (0.01 * at_frames(history, column) for column in ("strain_pct", "cross_strain_pct"))
    found = []
    for normal, (side, strain) in enumerate(zip(sides, (own, cross) if axis == 0 else (cross, own), strict=True)):
        for name, way in zip(NAMES[normal], (-1.0, 1.0), strict=True):
            offset = np.zeros((len(history.frames), 3))
            offset[:, normal] = 0.5 * way * side * strain
            found.append(jaw(name, history, normal, (0.5 * way * side, way), offset, aside=0.0))
    return found
