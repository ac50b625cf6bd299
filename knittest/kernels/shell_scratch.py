"""Scratch of a block of shells: where its rows lie, and how the corners of its lanes get there and are read."""

import numpy as np
from numba import njit

from knittest.kernels.options import INLINE, U
from knittest.kernels.rows import load3, rows3, rows4, store3
from knittest.kernels.shell_state import BLOCK
from knittest.kernels.vec import add, rotate

LANES = np.uintp(BLOCK)
ROW2, ROW3 = np.uintp(2 * BLOCK), np.uintp(3 * BLOCK)
# Rows of the scratch: four rows a corner for positions (the last unused), four for rotations, the first three of which
# become the director; strains of warp and weft, shear angle, forces of the middle layer in warp and weft, shear force,
# energy that shear friction took.
X, D, STRAIN_A, STRAIN_B, ANGLE, MIDDLE_A, MIDDLE_B, SHEAR, RUBBED = (
    np.uintp(BLOCK * k) for k in (0, 16, *range(32, 39))
)
CORNERS = tuple(np.uintp(4 * BLOCK * k) for k in range(4))
SCRATCH = BLOCK * 39
#: first row of each corner in the output
OUT = tuple(np.uintp(6 * BLOCK * k) for k in range(4))


@njit(**INLINE)
def corners(w, i):
    """Positions or directors of the four corners of a lane."""
    return (
        load3(w, i + CORNERS[0], LANES), load3(w, i + CORNERS[1], LANES), load3(w, i + CORNERS[2], LANES),
        load3(w, i + CORNERS[3], LANES),
    )  # fmt: skip


@njit(**INLINE)
def gather(block, nodes, conn, w):
    """Positions and rotations of the corners of a block."""
    x, y, z = rows3(nodes.position)
    qw, qx, qy, qz = rows4(nodes.rotation)
    for k in range(BLOCK):
        for c in range(4):
            n = U(conn[block * BLOCK + k, c])
            i = U(c) * CORNERS[1] + U(k)
            store3(w, X + i, LANES, (x[n], y[n], z[n]))
            store3(w, D + i, LANES, (qw[n], qx[n], qy[n]))
            w[D + i + ROW3] = qz[n]


@njit(**INLINE)
def turned(w, i, vector):
    """``vector`` as the rotation at ``i`` turns it."""
    return rotate(w[i], w[i + LANES], w[i + ROW2], w[i + ROW3], vector)


@njit(**INLINE)
def add_to_corner(corner, i, force, moment):
    """Add to the force and moment of a corner in the output."""
    store3(corner, i, LANES, add(load3(corner, i, LANES), force))
    store3(corner, i + ROW3, LANES, add(load3(corner, i + ROW3, LANES), moment))
