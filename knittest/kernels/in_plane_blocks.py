"""Forces of the fibres' bending in the plane, block by block, and their deterministic gather at the nodes.

As with the shells, a block of 64 stencils goes through a flat scratch in loops that vectorise, each stencil stores the
forces on its members, and every node collects its own in a fixed order: the bits do not depend on the threads.
"""

import numpy as np
from numba import njit

from knittest.kernels.in_plane import bending_energy, bending_gradients
from knittest.kernels.in_plane_state import BLOCK, WEIGHTS
from knittest.kernels.options import INLINE, KERNEL, U
from knittest.kernels.rows import load3, rows3, store3
from knittest.kernels.vec import add, combine, scale

LANES = np.uintp(BLOCK)
ROW2, ROW3 = np.uintp(2 * BLOCK), np.uintp(3 * BLOCK)
# rows of the scratch: warp and weft fibre, their second derivatives, three each, in place their gradients
WARP, WEFT, WARP_S, WEFT_T = (np.uintp(3 * BLOCK * k) for k in range(4))
#: position of a member, later the force on it
PLACE = np.uintp(12 * BLOCK)
#: weights of a member
SHARE = np.uintp(15 * BLOCK)
#: natural curvatures and stiffnesses of warp and weft
OWN = np.uintp(19 * BLOCK)
SCRATCH = 23 * BLOCK


@njit(**INLINE)
def _four(w, i):
    """Four numbers of a lane, the first at ``i``."""
    return w[i], w[i + LANES], w[i + ROW2], w[i + ROW3]


@njit(**INLINE)
def _take_weights(row, weight, w):
    """Copy the weights of a row of members: loops over one array vectorise, as nothing can overlap."""
    at = U(row) * U(WEIGHTS * BLOCK)
    for k in range(U(WEIGHTS * BLOCK)):
        w[SHARE + k] = weight[at + k]


@njit(**INLINE)
def _grow(w, i, factor, v):
    """Add a multiple of ``v`` to the vector of the scratch at ``i``."""
    store3(w, i, LANES, add(load3(w, i, LANES), scale(factor, v)))


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
        _take_weights(row, bends.weight, w)
        for k in range(LANES):
            place = load3(w, PLACE + k, LANES)
            warp, weft, warp_s, weft_t = _four(w, SHARE + k)
            _grow(w, WARP + k, warp, place)
            _grow(w, WEFT + k, weft, place)
            _grow(w, WARP_S + k, warp_s, place)
            _grow(w, WEFT_T + k, weft_t, place)


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
        _take_weights(row, bends.weight, w)
        for k in range(LANES):
            a, b, a_s, b_t = _fibres(w, k)
            warp, weft, warp_s, weft_t = _four(w, SHARE + k)
            store3(w, PLACE + k, LANES, add(combine(-warp, a, -weft, b), combine(-warp_s, a_s, -weft_t, b_t)))
        out = U(row) * ROW3
        for k in range(ROW3):
            bends.force[out + k] = w[PLACE + k]


@njit(**KERNEL)
def _energy(block, lane, bends, w):
    """Energy [mJ] of a gathered stencil."""
    s = block * BLOCK + lane
    natural, stiffness = (bends.natural[0, s], bends.natural[1, s]), (bends.stiffness[0, s], bends.stiffness[1, s])
    return bends.alive[s] * bending_energy(_fibres(w, U(lane)), natural, stiffness)


@njit(**KERNEL)
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


@njit(**KERNEL)
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


@njit(**KERNEL)
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


@njit(**KERNEL)
def bend_energy(nodes, bends):
    """Energy of the fibres' bending in the plane [mJ]."""
    total, w = 0.0, np.zeros(SCRATCH)
    for block in range(bends.first.size - 1):
        _gather(block, nodes, bends, w)
        for lane in range(BLOCK):
            total += _energy(block, lane, bends, w)
    return total
