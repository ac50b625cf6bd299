"""Contact of nodes with tools, block by block; the only place that knows about blocking.

Nodes that cannot reach a tool are passed over by bounds without branches. Distances are found node by node; the nodes
that touch are packed into a flat scratch with compile-time strides, over which the loop of the forces vectorises
(separate arrays would cost LLVM's alias checks).
"""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.drive_state import KINETIC, NORMAL, STATIC, TANGENTIAL
from knittest.kernels.options import INLINE, KERNEL, PARTITIONS, U
from knittest.kernels.rows import load3, rows3, store3
from knittest.kernels.tool_contact import touch_force
from knittest.kernels.tool_shapes import FAR, frame_distance, least_distances, tool_frame

#: share of a distance that is taken for it: what rounding leaves
ROUNDING = 1.0 - 1e-9
#: nodes that are looked at together
BLOCK = 128
STRIDE = BLOCK + 8  # no power of two, as in :mod:`contact_scratch`
LANES = np.uintp(STRIDE)
# Rows of the scratch: largest depth of each node by the bounds; then, of those that touch, number of the node, depth,
# outward normal (3), slide of the step (3), sticking spring (3), stiffness, viscous coefficient, 1 where it slips,
# force (3), pressure, energy lost to friction and to damping
REACH, NODE, DEPTH, NORM, SLIDE, SPRING, STIFF, VISCOUS, SLIPS, FORCE, PRESSURE, LOST, DAMPED = (
    np.uintp(STRIDE * k) for k in (0, 1, 2, 3, 6, 9, 12, 13, 14, 15, 18, 19, 20)
)
SCRATCH = STRIDE * 21


def n_blocks(n_nodes: int) -> int:
    """Number of blocks of ``n_nodes``, however they lie in partitions."""
    return n_nodes // BLOCK + PARTITIONS


@njit(**INLINE)
def block_of(partition, first, start):
    """Number of the block at ``start`` in the partition that begins with node ``first``."""
    return partition + first // BLOCK + (start - first) // BLOCK


@njit(**KERNEL)
def touch_tools(partition, first, last, dt, nodes, tools, touch, tally, w):
    """Add the tools' forces on nodes first..last; tally forces on the tools [N] and energies [mJ].

    A block that a tool cannot reach is passed over until both may have come together by what was between them. ``w`` is
    work space of ``SCRATCH`` numbers.
    """
    for start in range(first, last, BLOCK):
        count, block = min(BLOCK, last - start), block_of(partition, first, start)
        moved = dt * _speed(start, count, nodes)
        for t in range(tools.kind.size):
            u = tools.velocity[t]
            room = touch.room[t, block] - moved - dt * sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
            if room > 0.0:
                touch.room[t, block] = room
            else:
                touch.room[t, block] = _touch(partition, t, start, count, dt, nodes, tools, touch, tally, w)


@njit(**INLINE)
def _speed(start, count, nodes):
    """Upper bound of the speeds of ``count`` nodes [mm/ms]: the root of the sum of their squares."""
    vx, vy, vz = rows3(nodes.velocity)
    squares = 0.0
    for k in range(U(count)):
        i = U(start) + k
        squares += vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i]
    return sqrt(squares)


@njit(**KERNEL)
def _touch(partition, t, start, count, dt, nodes, tools, touch, tally, w):
    """Forces of tool ``t`` on the ``count`` nodes from ``start`` on; returns the room between them, 0 if they touch."""
    x, y, z = rows3(nodes.position)
    radius, pressure, frame = touch.radius, touch.pressure[t], tool_frame(t, tools)
    least_distances(tools.kind[t], frame, tools.grid[t], tools.samples, start, count, x, y, z, radius, w)
    near = 0
    for k in range(U(count)):
        i = U(start) + k
        w[REACH + k] = radius[i] - w[REACH + k] if pressure[i] == 0.0 else 1.0
        near += w[REACH + k] > 0.0
    if near > 0:
        touching = _pack(t, frame, start, count, dt, nodes, tools, touch, w)
        _forces(touching, dt, tools.law[t], w)
        rubbed, damped = _unpack(t, touching, nodes, touch, tally.tool[partition, t], w)
        tally.energy[partition, 1] += rubbed
        tally.energy[partition, 5] += rubbed
        tally.energy[partition, 3] += damped
        return 0.0
    room = FAR
    for k in range(U(count)):
        room = min(room, -w[REACH + k])
    return ROUNDING * room


@njit(**INLINE)
def _pack(t, frame, start, count, dt, nodes, tools, touch, w):
    """Pack all that the forces of the touching nodes of a block depend on; returns their number. Others forget their
    springs.
    """
    # fields are read once: in the loop each reading would count a reference
    x, y, z = rows3(nodes.position)
    vx, vy, vz = rows3(nodes.velocity)
    ex, ey, ez = rows3(touch.spring[t])
    kind, grid, samples, radius = tools.kind[t], tools.grid[t], tools.samples, touch.radius
    pressure, slipping, stiffness, viscous = touch.pressure[t], touch.slipping[t], touch.stiffness, touch.viscous
    ux, uy, uz = rows3(tools.velocity[t])
    m = U(0)
    for k in range(U(count)):
        if w[REACH + k] <= 0.0:
            continue
        i = U(start) + k
        gap, nx, ny, nz = frame_distance(kind, frame, grid, samples, x[i], y[i], z[i])
        depth = radius[i] - gap
        if depth <= 0.0:
            pressure[i], slipping[i], ex[i], ey[i], ez[i] = 0.0, 0.0, 0.0, 0.0, 0.0
            continue
        w[NODE + m], w[DEPTH + m], w[STIFF + m], w[VISCOUS + m] = i, depth, stiffness[i], viscous[i]
        store3(w, NORM + m, LANES, (nx, ny, nz))
        store3(w, SLIDE + m, LANES, ((vx[i] - ux) * dt, (vy[i] - uy) * dt, (vz[i] - uz) * dt))
        store3(w, SPRING + m, LANES, (ex[i], ey[i], ez[i]))
        w[SLIPS + m] = slipping[i]
        m += U(1)
    return m


@njit(**INLINE)
def _forces(count, dt, law, w):
    """Forces of ``count`` packed nodes."""
    normal, tangential, static, kinetic = law[NORMAL], law[TANGENTIAL], law[STATIC], law[KINETIC]
    damp, stick = sqrt(normal), sqrt(tangential)
    for k in range(U(count)):
        stiffness, viscous = w[STIFF + k], w[VISCOUS + k]
        f, w[PRESSURE + k], e, w[SLIPS + k], w[LOST + k], w[DAMPED + k] = touch_force(
            load3(w, NORM + k, LANES), load3(w, SLIDE + k, LANES), load3(w, SPRING + k, LANES), w[DEPTH + k],
            normal * stiffness, damp * viscous, tangential * stiffness, stick * viscous, static, kinetic,
            w[SLIPS + k], dt,
        )  # fmt: skip
        store3(w, FORCE + k, LANES, f)
        store3(w, SPRING + k, LANES, e)


@njit(**INLINE)
def _unpack(t, count, nodes, touch, force_on_tool, w):
    """Add the forces of ``count`` packed nodes and keep their springs; returns losses by friction and damping [mJ]."""
    fx, fy, fz = rows3(nodes.force)
    ex, ey, ez = rows3(touch.spring[t])
    pressure, slipping = touch.pressure[t], touch.slipping[t]
    sum_x, sum_y, sum_z, lost, damped = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(U(count)):
        i = U(w[NODE + k])
        f = load3(w, FORCE + k, LANES)
        fx[i], fy[i], fz[i] = fx[i] + f[0], fy[i] + f[1], fz[i] + f[2]
        ex[i], ey[i], ez[i] = load3(w, SPRING + k, LANES)
        pressure[i], slipping[i] = w[PRESSURE + k], w[SLIPS + k]
        sum_x, sum_y, sum_z = sum_x + f[0], sum_y + f[1], sum_z + f[2]
        lost, damped = lost + w[LOST + k], damped + w[DAMPED + k]
    force_on_tool[0] -= sum_x
    force_on_tool[1] -= sum_y
    force_on_tool[2] -= sum_z
    return lost, damped
