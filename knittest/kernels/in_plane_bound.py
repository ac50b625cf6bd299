"""Row sums of the stiffness of the fibres' bending in the plane, about any state of the shells.

A stencil of one fibre stores c (k - k0)^2 / 2 with k = x'' . m (:mod:`knittest.kernels.in_plane`), so its stiffness is
c (dk dk + (k - k0) d2k). m turns about a by at most (|db| + |a . b| |da| / a . a) / |p| and towards a by |da| / |a|: a
member with the weights u of the second derivative and v of both turns has |dk| <= u + v x'', each turn with the part of
x'' that it meets, along the normal and along a, and two members have |d2k| <= u v' + v u' + 3 |x''| v v'.
"""

from math import sqrt

from numba import njit

from knittest.kernels.in_plane import across
from knittest.kernels.in_plane_state import BLOCK, WEIGHTS
from knittest.kernels.options import INLINE, KERNEL
from knittest.kernels.vec import add, dot, scale


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
def _turning(a, b, second, natural):
    """Sizes of a . b / a . a, 1 / |a|, 1 / |p|, of x'' along a and along the normal, of k - k0, and of x''."""
    m, inv_p, share = across(a, b)
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
                warp, weft = _turning(a, b, a_s, bends.natural[0, s]), _turning(b, a, b_t, bends.natural[1, s])
                _add_fibre(first, last, lane, 0, warp, bends.stiffness[0, s], bends, rows)
                _add_fibre(first, last, lane, 1, weft, bends.stiffness[1, s], bends, rows)
