"""Parts of all kernels: compiler options, vectors as tuples, rows of blocks, tables of time, cells of a grid."""

from typing import Any

import numpy as np
from numba import njit

from knittest.kernels import CODE_FOLDER

# Compiler options shared by all kernels.
#
# ``nnan`` and ``ninf`` stay out of the fast-math flags so that NaN and Inf remain detectable; ``reassoc`` and ``arcp``
# because LLVM rearranges a function anew in every kernel it is linked into, so that one thread and several, or code
# just compiled and code read back, would differ in their last bits. Loop indices in blocked loops are unsigned
# (:data:`U`): a signed ``start + k`` keeps LLVM from vectorising, and so does a sum of floats, which has an order.

FASTMATH = {"contract", "nsz"}
U = np.uintp
ONE = np.uintp(1)

#: a kernel that makes arrays: each array that it reads is counted, atomically, also in its loops
ALLOCATING: dict[str, Any] = {
    "cache": CODE_FOLDER is not None, "error_model": "numpy", "fastmath": FASTMATH, "nogil": True,
}  # fmt: skip
#: a kernel called from Python or from another kernel; it counts no references, so that it may neither make nor return
#: an array
KERNEL: dict[str, Any] = {**ALLOCATING, "_nrt": False}
#: a kernel that only kernels call: without the wrappers by which Python would call it, a quarter of all compilation;
#: Python that called it nevertheless would end without a word
PART: dict[str, Any] = {**KERNEL, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
#: a pure function of scalars, inlined into the blocked loops by LLVM
INLINE: dict[str, Any] = {**PART, "forceinline": True}
#: a sum of floats in any order, of what decides no result
ANY_ORDER: dict[str, Any] = {**INLINE, "fastmath": FASTMATH | {"reassoc"}}
#: parts of an array, taken apart where they are used: inlined before it is decided whether references are counted
ROWS: dict[str, Any] = {"cache": CODE_FOLDER is not None, "inline": "always"}
#: a kernel with prange; only prange loops are made parallel, which spares compile time
PARALLEL: dict[str, Any] = {
    "cache": CODE_FOLDER is not None,
    "error_model": "numpy",
    "fastmath": FASTMATH,
    "parallel": {
        "comprehension": False,
        "fusion": False,
        "inplace_binop": False,
        "numpy": False,
        "prange": True,
        "reduction": False,
        "setitem": False,
        "stencil": False,
    },
}

#: partitions of the nodes; fixed, so that sums have the same order at any thread count
PARTITIONS = 16
_BITS = (PARTITIONS - 1).bit_length()
#: the order in which they are shared out, bits reversed: a thread takes a run of it and so gets partitions from all
#: over the fabric, whose expensive and cheap regions (some of the contacts, what the tools touch) are shared evenly
SHARED_OUT = np.array([int(f"{p:0{_BITS}b}"[::-1], 2) for p in range(PARTITIONS)])


@njit(**INLINE)
def add(u, v):
    """Sum u + v."""
    return u[0] + v[0], u[1] + v[1], u[2] + v[2]


@njit(**INLINE)
def sub(u, v):
    """Difference u - v."""
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


@njit(**INLINE)
def scale(factor, u):
    """Multiple of u."""
    return factor * u[0], factor * u[1], factor * u[2]


@njit(**INLINE)
def combine(p, u, q, v):
    """Linear combination p u + q v."""
    return p * u[0] + q * v[0], p * u[1] + q * v[1], p * u[2] + q * v[2]


@njit(**INLINE)
def dot(u, v):
    """Scalar product."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


@njit(**INLINE)
def cross(u, v):
    """Vector product."""
    return u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]


@njit(**INLINE)
def rotate(qw, qx, qy, qz, v):
    """Rotate ``v`` by the unit quaternion (qw, qx, qy, qz): v + 2 qw (q x v) + 2 q x (q x v)."""
    q = (qx, qy, qz)
    t = scale(2.0, cross(q, v))
    return add(add(v, scale(qw, t)), cross(q, t))


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


#: terms that are summed side by side: a sum in one order waits for each addition and does not vectorise
LANE_SUMS = 64


@njit(**INLINE)
def clear_sums(w, at):
    """Clear :data:`LANE_SUMS` sums of the scratch ``w`` from ``at`` on."""
    for k in range(U(LANE_SUMS)):
        w[at + k] = 0.0


@njit(**INLINE)
def total_of_sums(w, at):
    """Total of :data:`LANE_SUMS` sums of the scratch ``w`` from ``at`` on, in a fixed order; changes them."""
    half = U(LANE_SUMS) >> ONE
    while half > U(0):
        for k in range(half):
            w[at + k] += w[at + half + k]
        half = half >> ONE
    return w[at]


@njit(**PART)
def table_value(times, values, time):
    """Value at ``time`` of the piecewise linear function through (times, values); constant outside."""
    last = times.size - 1
    if time <= times[0]:
        return values[0]
    if time >= times[last]:
        return values[last]
    k = np.searchsorted(times, time, side="right") - 1
    share = (time - times[k]) / (times[k + 1] - times[k])
    return values[k] + (values[k + 1] - values[k]) * share


@njit(**KERNEL)
def read_tables(tables, before, now):
    """Fill ``tables.now`` with the values at two times [ms]."""
    for m in range(tables.time.shape[0]):
        knots = tables.knots[m]
        tables.now[0, m] = table_value(tables.time[m, :knots], tables.value[m, :knots], before)
        tables.now[1, m] = table_value(tables.time[m, :knots], tables.value[m, :knots], now)


#: rows of cells round a cell
GRID_ROWS = 9


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
