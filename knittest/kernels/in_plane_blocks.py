"""Forces of the fibres' bending in the plane, block by block, and their deterministic gather at the nodes.

As with the shells, a block of 64 stencils goes through a flat scratch in loops that vectorise, each stencil stores the
forces on its members, and every node collects its own in a fixed order: the bits do not depend on the threads.
"""

import numpy as np
from numba import njit

from knittest.kernels.in_plane import BLOCK, OWN_EACH, SAME, WEIGHTS, bending_energy, bending_gradients
from knittest.kernels.vec import ALLOCATING, INLINE, PART, U, add, load3, rows3, scale, store3

LANES = np.uintp(BLOCK)
ROW2, ROW3 = np.uintp(2 * BLOCK), np.uintp(3 * BLOCK)
# rows of the scratch: warp and weft fibre, their second derivatives, three each, in place their gradients
WARP, WEFT, WARP_S, WEFT_T = (np.uintp(3 * BLOCK * k) for k in range(4))
#: position of a member, later the force on it
PLACE = np.uintp(12 * BLOCK)
#: one weight of a member
SHARE = np.uintp(15 * BLOCK)
#: natural curvatures and stiffnesses of warp and weft
OWN = np.uintp(16 * BLOCK)
SCRATCH = 20 * BLOCK


@njit(**INLINE)
def _four(w, i):
    """Four numbers of a lane, the first at ``i``."""
    return w[i], w[i + LANES], w[i + ROW2], w[i + ROW3]


@njit(**INLINE)
def _grow(w, to, factor, v):
    """Add a multiple of the vectors of the scratch at ``v`` to those at ``to``."""
    for k in range(ROW3):
        w[to + k] += factor * w[v + k]


@njit(**INLINE)
def _grow_each(w, to, sign, v):
    """Add by each lane's own weight, times ``sign``."""
    for k in range(LANES):
        store3(w, to + k, LANES, add(load3(w, to + k, LANES), scale(sign * w[SHARE + k], load3(w, v + k, LANES))))


@njit(**INLINE)
def _grow_by_weight(row, f, bends, w, to, sign, v):
    """Add weight ``f`` of a row of members times the vectors at ``v``, times ``sign``, to those at ``to``."""
    at = (U(row) * U(WEIGHTS) + U(f)) * LANES
    spread = bends.spread[row, f]
    if spread == SAME:
        _grow(w, to, sign * bends.weight[at], v)
    elif spread == OWN_EACH:
        for k in range(LANES):  # loops over one array vectorise, as nothing can overlap
            w[SHARE + k] = bends.weight[at + k]
        _grow_each(w, to, sign, v)


@njit(**INLINE)
def _fibres(w, k):
    """Fibres and second derivatives of a lane."""
    return (
        load3(w, WARP + k, LANES), load3(w, WEFT + k, LANES), load3(w, WARP_S + k, LANES), load3(w, WEFT_T + k, LANES),
    )  # fmt: skip


@njit(**INLINE)
def _gather(block, nodes, bends, w):
    """Fibres and second derivatives of a block, from the positions of its members."""
    x, y, z = rows3(nodes.position)
    for k in range(PLACE):
        w[k] = 0.0
    for row in range(bends.first[block], bends.first[block + 1]):
        for k in range(BLOCK):
            n = U(bends.member[row, k])
            store3(w, PLACE + U(k), LANES, (x[n], y[n], z[n]))
        for f in range(WEIGHTS):
            _grow_by_weight(row, f, bends, w, U(f) * ROW3, 1.0, PLACE)


@njit(**INLINE)
def _forces(block, bends, w):
    """Forces on the members of a block: minus the gradient of its energy."""
    natural, other_natural = bends.natural[0], bends.natural[1]
    stiffness, other = bends.stiffness[0], bends.stiffness[1]
    start = U(block) * LANES
    for k in range(LANES):
        s = start + k
        w[OWN + k], w[OWN + LANES + k] = natural[s], other_natural[s]
        w[OWN + ROW2 + k], w[OWN + ROW3 + k] = bends.alive[s] * stiffness[s], bends.alive[s] * other[s]
    for k in range(LANES):
        natural_a, natural_b, stiff_a, stiff_b = _four(w, OWN + k)
        a, b, a_s, b_t = bending_gradients(_fibres(w, k), (natural_a, natural_b), (stiff_a, stiff_b))
        store3(w, WARP + k, LANES, a)
        store3(w, WEFT + k, LANES, b)
        store3(w, WARP_S + k, LANES, a_s)
        store3(w, WEFT_T + k, LANES, b_t)
    for row in range(bends.first[block], bends.first[block + 1]):
        spread = bends.spread  # of a row, which as an array of its own would be counted
        if max(spread[row, 0], spread[row, 1], spread[row, 2], spread[row, 3]) < OWN_EACH:
            at = U(row) * U(WEIGHTS * BLOCK)
            c0, c1 = -bends.weight[at], -bends.weight[at + LANES]
            c2, c3 = -bends.weight[at + ROW2], -bends.weight[at + ROW3]
            for k in range(ROW3):
                w[PLACE + k] = (c0 * w[WARP + k] + c1 * w[WEFT + k]) + (c2 * w[WARP_S + k] + c3 * w[WEFT_T + k])
        else:
            for k in range(ROW3):
                w[PLACE + k] = 0.0
            for f in range(WEIGHTS):
                _grow_by_weight(row, f, bends, w, PLACE, -1.0, U(f) * ROW3)
        out = U(row) * ROW3
        for k in range(ROW3):
            bends.force[out + k] = w[PLACE + k]


@njit(**PART)
def _energy(block, lane, bends, w):
    """Energy [mJ] of a gathered stencil."""
    s = block * BLOCK + lane
    natural, stiffness = (bends.natural[0, s], bends.natural[1, s]), (bends.stiffness[0, s], bends.stiffness[1, s])
    return bends.alive[s] * bending_energy(_fibres(w, U(lane)), natural, stiffness)


@njit(**PART)
def _cut(block, time, fail_time, bends, w):
    """Cut the fibres of a block beside shells that broke before ``time`` [ms]; returns their energy [mJ].

    Shells that break in this very step may be seen or not, depending on the threads: they cut in the next one.
    """
    lost = 0.0
    for lane in range(BLOCK):
        s = block * BLOCK + lane
        if bends.alive[s] == 0.0:
            continue
        for i in range(bends.around_start[s], bends.around_start[s + 1]):
            if fail_time[bends.around[i]] < time:
                lost += _energy(block, lane, bends, w)
                bends.alive[s] = 0.0
                break
    return lost


@njit(**PART)
def bend_forces(block_start, block_stop, time, nodes, fail_time, bends, w):
    """Forces on the members of the blocks from block_start up to block_stop at ``time`` [ms].

    ``fail_time`` [ms] of the shells; ``w`` is work space of ``SCRATCH`` numbers. Returns the energy [mJ] of fibres cut.
    """
    lost, broken = 0.0, 0.0
    for flag in bends.broken:
        broken += flag
    for block in range(block_start, block_stop):
        _gather(block, nodes, bends, w)
        if broken > 0.0:
            lost += _cut(block, time, fail_time, bends, w)
        _forces(block, bends, w)
    return lost


@njit(**PART)
def gather_bends(node_start, node_stop, nodes, bends):
    """Add the forces of the stencils to nodes node_start up to node_stop, in a fixed order."""
    fx, fy, fz = rows3(nodes.force)
    for n in range(node_start, node_stop):
        force = (0.0, 0.0, 0.0)
        for i in range(bends.node_start[n], bends.node_start[n + 1]):
            force = add(force, load3(bends.force, U(bends.node_entry[i]), LANES))
        fx[n] += force[0]
        fy[n] += force[1]
        fz[n] += force[2]


@njit(**ALLOCATING)
def bend_energy(nodes, bends):
    """Energy of the fibres' bending in the plane [mJ]."""
    total, w = 0.0, np.zeros(SCRATCH)
    for block in range(bends.first.size - 1):
        _gather(block, nodes, bends, w)
        for lane in range(BLOCK):
            total += _energy(block, lane, bends, w)
    return total
