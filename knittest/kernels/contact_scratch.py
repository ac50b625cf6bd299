"""Rows of the scratch in which a block of yarn contacts is evaluated."""

import numpy as np
from numba import njit

from knittest.kernels.options import INLINE, U

BLOCK = 64
#: rows lie apart by no power of two: the rows of a contact would share a few sets of the first-level cache
STRIDE = BLOCK + 8
LANES = U(STRIDE)
# control points of A and B (9 + 9), parameters, kind, reach, spring, offset, force, loss by friction, slipping,
# turn of the touching surfaces, loss by damping, turn of A over B about the offset times its length, loss by spin
P = tuple(np.uintp(STRIDE * k) for k in range(18))
S, T, LINE, REACH = (np.uintp(STRIDE * k) for k in range(18, 22))
EX, EY, EZ = (np.uintp(STRIDE * k) for k in range(22, 25))
GX, GY, GZ = (np.uintp(STRIDE * k) for k in range(25, 28))
PX, PY, PZ = (np.uintp(STRIDE * k) for k in range(28, 31))
LOST, SLIPPING = np.uintp(STRIDE * 31), np.uintp(STRIDE * 32)
TURN_X, TURN_Y, TURN_Z = (np.uintp(STRIDE * k) for k in range(33, 36))
DAMPED = np.uintp(STRIDE * 36)
OVER, SPUN = np.uintp(STRIDE * 37), np.uintp(STRIDE * 38)
# tangents (3) of A, before the step where the force will be, after it where control points were, and of B
WAS_UX, UX, VX = PX, P[3], np.uintp(STRIDE * 39)
# the step [ms] where surfaces touched, else 0, until losses are known
TOUCHED = LOST
# before losses are known: normal force before the step; products of the second derivatives of A and B with the shifts
# of their own sections, the latter in the place of TOUCHED, which is read before
PRESSED, OWN_A, OWN_B = DAMPED, SPUN, LOST
SCRATCH = STRIDE * 42
P0, P1, P2, P3, P4, P5, P6, P7, P8 = P[:9]
R0, R1, R2, R3, R4, R5, R6, R7, R8 = P[9:]
# control points are done with when contacts give way: spring of the last step (3), whether it slipped, twist, lever and
# its coefficient, couple
WAS_EX, WAS_SLIPPING, TWIST, LEVER, COEFFICIENT, COUPLE = P0, P6, P7, P8, R0, R1


@njit(**INLINE)
def read(first, count, row, w, target):
    """Read a block of ``count`` contacts of ``row`` from ``first`` on into the row ``target``."""
    for m in range(U(count)):
        w[target + m] = row[U(first) + m]


@njit(**INLINE)
def read3(first, count, rows, w, target):
    """Read a block of three rows, the first of them into ``target``."""
    read(first, count, rows[0], w, target)
    read(first, count, rows[1], w, target + LANES)
    read(first, count, rows[2], w, target + LANES + LANES)


@njit(**INLINE)
def write(first, count, w, source, row):
    """Write the row ``source`` of a block of ``count`` contacts into ``row`` from ``first`` on."""
    for m in range(U(count)):
        row[U(first) + m] = w[source + m]


@njit(**INLINE)
def write3(first, count, w, source, rows):
    """Write three rows of a block, the first of them ``source``."""
    write(first, count, w, source, rows[0])
    write(first, count, w, source + LANES, rows[1])
    write(first, count, w, source + LANES + LANES, rows[2])
