"""Bending of the fibres in the plane of the shells: pure functions, arrays and row sums of the stiffness.

A yarn that lies in a surface x(s, t) along s bends in it by its geodesic curvature k = x_ss . m, with m the unit vector
of the surface across the fibre a = x_s, which is the part of the other fibre b = x_t across it: shear turns b, not m.
Bending out of the surface is that of the laminate. Stretches are not divided out: they are some per cent at
most, and a fibre that is crushed does not grow stiff. k depends on scalar products only, so rigid motions cost nothing.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from knittest.base.arrays import Array, Index
from knittest.kernels.vec import INLINE, KERNEL, PARTITIONS, add, combine, dot, scale, sub

#: floor of the squared part of one fibre across the other, where shear has closed the angle between them
CLOSED = 1e-12


@njit(**INLINE)
def unit_across(a, b):
    """Unit vector across the fibre ``a`` towards ``b``, one over the length of that part of b, and a . b / a . a."""
    share = dot(a, b) / dot(a, a)
    part = sub(b, scale(share, a))
    inv = 1.0 / sqrt(max(dot(part, part), CLOSED))
    return scale(inv, part), inv, share


@njit(**INLINE)
def curvature(a, b, second):
    """Geodesic curvature [1/mm] of fibre ``a`` [-] with second derivative ``second`` [1/mm] beside fibre ``b`` [-]."""
    m, _, _ = unit_across(a, b)
    return dot(second, m)


@njit(**INLINE)
def curvature_gradients(a, b, second):
    """Curvature and its gradients with respect to a, b and the second derivative.

    With p = b - (a . b / a . a) a and m = p / |p|: dk/d second = m, dk/db = g less its part along a for
    g = (second - k m) / |p|, dk/da = -(g . a / a . a) p - (a . b / a . a) dk/db.
    """
    m, inv, share = unit_across(a, b)
    k = dot(second, m)
    g = scale(inv, sub(second, scale(k, m)))
    along = dot(g, a) / dot(a, a)
    by_b = sub(g, scale(along, a))
    return k, combine(-along / inv, m, -share, by_b), by_b, m


@njit(**INLINE)
def bending_gradients(fibres, natural, stiffness):
    """Gradients of sum_f stiffness_f (k_f - natural_f)^2 / 2 with respect to warp, weft and their second derivatives.

    ``fibres`` (a, b, a_s, b_t), natural curvatures [1/mm] and stiffnesses [N mm^3] of warp and weft.
    """
    a, b, a_s, b_t = fibres
    k, warp_a, warp_b, warp_s = curvature_gradients(a, b, a_s)
    moment = stiffness[0] * (k - natural[0])
    k, weft_b, weft_a, weft_t = curvature_gradients(b, a, b_t)
    other = stiffness[1] * (k - natural[1])
    grad_a = add(scale(moment, warp_a), scale(other, weft_a))
    grad_b = add(scale(moment, warp_b), scale(other, weft_b))
    return grad_a, grad_b, scale(moment, warp_s), scale(other, weft_t)


@njit(**INLINE)
def bending_energy(fibres, natural, stiffness):
    """Energy [mJ] of :func:`bending_gradients`."""
    a, b, a_s, b_t = fibres
    warp, weft = curvature(a, b, a_s) - natural[0], curvature(b, a, b_t) - natural[1]
    return 0.5 * (stiffness[0] * warp * warp + stiffness[1] * weft * weft)


#: stencils of a block; one row is one quantity of its stencils
BLOCK = 64
#: rows of weights of a member: warp and weft fibre [1/mm], their second derivatives [1/mm^2]
WEIGHTS = 4
#: how a weight of a row of members is spread: not at all, the same for all stencils of the block, or each its own
NOWHERE, SAME, OWN_EACH = 0, 1, 2


class Bends(NamedTuple):
    """Stencils in blocks of 64 of equal size, padded with dead copies of the last one of a block.

    A stencil gives both fibres and their second derivatives at its node as sums of weights times positions of its
    members. ``member`` (n_rows, 64) node numbers, block b owns rows first[b] to first[b + 1]; ``weight``
    (n_rows * 4 * 64,), see :data:`WEIGHTS`, and how each is ``spread`` (n_rows, 4), see :data:`SAME`; ``force``
    (n_rows * 3 * 64,) [N] on each member; ``node_start`` (n_nodes + 1,) and ``node_entry`` say where in ``force`` the
    entries of a node are. ``natural`` (2, n) curvature of warp and weft at rest [1/mm], ``stiffness`` (2, n) bending
    stiffness per width times area [N mm^3], ``alive`` (n,) 1 until a shell round the node breaks, n = 64 n_blocks.
    Shells round stencil s are around[around_start[s]] to around[around_start[s + 1]]. ``broken`` (PARTITIONS,) is above
    0 once a partition has lost a shell.
    """

    member: NDArray[np.int32]
    first: Index
    weight: Array
    spread: NDArray[np.int8]
    force: Array
    node_start: Index
    node_entry: Index
    natural: Array
    stiffness: Array
    alive: Array
    around: NDArray[np.int32]
    around_start: Index
    broken: Array


def no_bends() -> Bends:
    """Shells whose fibres do not bend in the plane."""
    none, start = np.zeros(0), np.zeros(1, np.int64)
    return Bends(
        np.zeros((0, BLOCK), np.int32), start, none, np.zeros((0, WEIGHTS), np.int8), none.copy(),
        start.copy(), start[:0].copy(), np.zeros((2, 0)), np.zeros((2, 0)), none.copy(), np.zeros(0, np.int32),
        start.copy(), np.zeros(PARTITIONS),
    )  # fmt: skip


# Row sums of the stiffness of the fibres' bending in the plane, about any state of the shells.
#
# A stencil of one fibre stores c (k - k0)^2 / 2 with k = x'' . m (:mod:`knittest.kernels.in_plane`), so its stiffness
# is c (dk dk + (k - k0) d2k). m turns about a by at most (|db| + |a . b| |da| / a . a) / |p| and towards a by |da| /
# |a|: a member with the weights u of the second derivative and v of both turns has |dk| <= u + v x'', each turn with
# the part of x'' that it meets, along the normal and along a, and two members have |d2k| <= u v' + v u' + 3 |x''| v v'.


@njit(**INLINE)
def _weight(row, lane, f, bends):
    return bends.weight[(row * WEIGHTS + f) * BLOCK + lane]


@njit(**INLINE)
def _fibres(first, last, lane, position, bends):
    """Warp, weft and their second derivatives of a stencil."""
    a, b, a_s, b_t = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for row in range(first, last):
        n = bends.member[row, lane]
        x = (position[0, n], position[1, n], position[2, n])
        a = add(a, scale(_weight(row, lane, 0, bends), x))
        b = add(b, scale(_weight(row, lane, 1, bends), x))
        a_s = add(a_s, scale(_weight(row, lane, 2, bends), x))
        b_t = add(b_t, scale(_weight(row, lane, 3, bends), x))
    return a, b, a_s, b_t


@njit(**INLINE)
def _turning_terms(a, b, second, natural):
    """Sizes of a . b / a . a, 1 / |a|, 1 / |p|, of x'' along a and along the normal, of k - k0, and of x''."""
    m, inv_p, share = unit_across(a, b)
    inv_a = 1.0 / sqrt(dot(a, a))
    k, along = dot(second, m), inv_a * dot(second, a)
    square = dot(second, second)
    out = sqrt(max(square - k * k - along * along, 0.0))
    return abs(share), inv_a, inv_p, abs(along), out, abs(k - natural), sqrt(square)


@njit(**INLINE)
def _member(row, lane, family, turning, bends):
    """Weights u and v of a member and the bound of its gradient."""
    share, inv_a, inv_p, along, out, _, _ = turning
    own, other = abs(_weight(row, lane, family, bends)), abs(_weight(row, lane, 1 - family, bends))
    u, about, towards = abs(_weight(row, lane, 2 + family, bends)), (other + share * own) * inv_p, own * inv_a
    return u, about + towards, u + about * out + towards * along


@njit(**INLINE)
def _add_fibre(first, last, lane, family, turning, stiffness, bends, rows):
    """Add the row sums of one fibre of a stencil to those of its members."""
    sum_u, sum_v, sum_g = 0.0, 0.0, 0.0
    for row in range(first, last):
        u, v, g = _member(row, lane, family, turning, bends)
        sum_u, sum_v, sum_g = sum_u + u, sum_v + v, sum_g + g
    off, size = turning[5], turning[6]
    for row in range(first, last):
        u, v, g = _member(row, lane, family, turning, bends)
        change = u * sum_v + v * (sum_u + 3.0 * size * sum_v)
        rows[bends.member[row, lane]] += stiffness * (g * sum_g + off * change)


@njit(**KERNEL)
def add_bounds(position, bends, rows):
    """Add to ``rows`` (n,) the row sum [N/mm] of each node about the state of ``position`` (3, n) [mm]."""
    for block in range(bends.first.size - 1):
        first, last = bends.first[block], bends.first[block + 1]
        for lane in range(BLOCK):
            s = block * BLOCK + lane
            if bends.alive[s] > 0.0:
                a, b, a_s, b_t = _fibres(first, last, lane, position, bends)
                warp, weft = (
                    _turning_terms(a, b, a_s, bends.natural[0, s]),
                    _turning_terms(b, a, b_t, bends.natural[1, s]),
                )
                _add_fibre(first, last, lane, 0, warp, bends.stiffness[0, s], bends, rows)
                _add_fibre(first, last, lane, 1, weft, bends.stiffness[1, s], bends, rows)
