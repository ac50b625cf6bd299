"""Rows of structure-of-arrays blocks: as separate arrays, taken once per kernel call and never inside a loop, or three
numbers of a flat scratch whose rows are ``lanes`` apart, a compile-time constant.
"""

from numba import njit

from knittest.kernels.options import INLINE, ROWS


@njit(**ROWS)
def rows3(a):
    """The three rows of a (3, n) array."""
    return a[0], a[1], a[2]


@njit(**ROWS)
def rows4(a):
    """The four rows of a (4, n) array."""
    return a[0], a[1], a[2], a[3]


@njit(**INLINE)
def at3(rows, i):
    """The vector at ``i`` of three rows."""
    return rows[0][i], rows[1][i], rows[2][i]


@njit(**INLINE)
def put3(rows, i, v):
    """Put the vector ``v`` at ``i`` of three rows."""
    rows[0][i], rows[1][i], rows[2][i] = v


@njit(**INLINE)
def load3(w, i, lanes):
    """A vector of the scratch ``w``, its first component at ``i``."""
    return w[i], w[i + lanes], w[i + lanes + lanes]


@njit(**INLINE)
def store3(w, i, lanes, v):
    """Put the vector ``v`` into the scratch ``w``."""
    w[i], w[i + lanes], w[i + lanes + lanes] = v
