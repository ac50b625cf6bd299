"""Cells of a grid round one of them: the 27 of a search as nine rows of three, in the order of their numbers."""

from numba import njit

from knittest.kernels.options import INLINE

#: rows of cells round a cell
ROWS = 9


@njit(**INLINE)
def place_of(cell, shape):
    """Place (3) of a cell in a grid of ``shape``."""
    rest = cell // shape[2]
    return rest // shape[1], rest % shape[1], cell % shape[2]


@njit(**INLINE)
def row_near(place, shape, row):
    """First cell and stop of a ``row``, 0 to 8, of those round the cell at ``place``; empty beyond the grid."""
    a, b = place[0] + row // 3 - 1, place[1] + row % 3 - 1
    if a < 0 or a >= shape[0] or b < 0 or b >= shape[1]:
        return 0, 0
    begin = (a * shape[1] + b) * shape[2]
    return begin + max(place[2] - 1, 0), begin + min(place[2] + 2, shape[2])
