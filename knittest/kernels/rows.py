"""Rows of structure-of-arrays blocks as separate arrays, taken once per kernel call and never inside a loop."""

from numba import njit

from knittest.kernels.options import INLINE


@njit(**INLINE)
def rows3(a):
    """The three rows of a (3, n) array."""
    return a[0], a[1], a[2]


@njit(**INLINE)
def rows4(a):
    """The four rows of a (4, n) array."""
    return a[0], a[1], a[2], a[3]
