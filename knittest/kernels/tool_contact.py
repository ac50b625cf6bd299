"""Contact of nodes with rigid tools: penalty and friction with a sticking spring, motion of the tools, block by
block.
"""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.loads import present_load
from knittest.kernels.state import KINETIC, NORMAL, STATIC, TANGENTIAL
from knittest.kernels.tool_shapes import FAR, frame_distance, least_distances, tool_frame
from knittest.kernels.vec import (
    ANY_ORDER,
    INLINE,
    KERNEL,
    ONE,
    PART,
    PARTITIONS,
    U,
    add,
    at3,
    combine,
    dot,
    load3,
    rows3,
    scale,
    store3,
    sub,
)

#: entries of ``Tools.motion`` that are not a table
HELD, FREE = -1, -2
#: keeps quotients of nothing finite
TINY = 1e-200


@njit(**INLINE)
def coulomb(sx, sy, sz, tangential, pressure, static, kinetic, slipping):
    """Return the sticking spring (3) [mm] to the Coulomb limit; also 1 where it slips.

    A node that sticks gives way at the static limit and slips at the kinetic one until its spring falls below that.
    Without branches, so that it vectorises.
    """
    trial = tangential * sqrt(sx * sx + sy * sy + sz * sz)
    limit = (kinetic if slipping > 0.0 else static) * pressure
    slips = trial > limit
    share = kinetic * pressure / max(trial, TINY)
    share = share if slips else 1.0
    return share * sx, share * sy, share * sz, 1.0 if slips else 0.0


@njit(**INLINE)
def damp_sticking(fx, fy, fz, dx, dy, dz, viscous, limit):
    """Sticking force (3) [N] with ``viscous`` [N/mm] times the step's slide d (3) added, up to ``limit``.

    Without it a node that stops swings about its sticking force and slips again below the static limit.
    """
    fx, fy, fz = fx + viscous * dx, fy + viscous * dy, fz + viscous * dz
    share = min(limit / max(sqrt(fx * fx + fy * fy + fz * fz), TINY), 1.0)
    return share * fx, share * fy, share * fz


@njit(**INLINE)
def touch_force(n, d, e, depth, normal, viscous, tangential, sticking, static, kinetic, slipping, dt):
    """Force of a tool on a touching node.

    ``n`` outward normal (nearly unit), ``d`` slide of this step and ``e`` sticking spring before it (3) [mm]; ``depth``
    [mm]; penalty ``normal`` and ``tangential`` [N/mm] with their damping ``viscous`` and ``sticking`` [N ms/mm].
    Returns force (3) and pressure [N], the spring (3) [mm], 1 where it slips, and the energies lost to friction and to
    damping [mJ].
    """
    closing = -dot(d, n)
    elastic = normal * depth
    pressure = max(elastic + viscous * closing / dt, 0.0)
    inv_normal2 = 1.0 / dot(n, n)
    t = add(e, d)
    t = combine(1.0, t, -dot(t, n) * inv_normal2, n)
    sx, sy, sz, slips = coulomb(t[0], t[1], t[2], tangential, pressure, static, kinetic, slipping)
    s = (sx, sy, sz)
    slide, spring = combine(1.0, d, closing * inv_normal2, n), scale(tangential, s)
    damped = damp_sticking(*spring, *slide, sticking / dt, static * pressure)
    sticks = 1.0 - slips  # a node that slips is not damped
    damping = scale(sticks, sub(damped, spring))
    rubbed = 0.5 * tangential * dot(add(e, s), sub(t, s))
    damped = (pressure - elastic) * closing + dot(damping, slide)
    return combine(pressure, n, -1.0, add(spring, damping)), pressure, s, slips, rubbed, damped


@njit(**PART)
def move_tools(dt, tools, tables, tally):
    """Move the tools one step; books the work of moved and loaded ones [mJ] and sums the forces of the step.

    On entry tally.tool holds the contact forces of this step by partition; they are added to tally.tool_sum.
    """
    for t in range(tools.kind.size):
        for axis in range(3):
            force = 0.0
            for p in range(tally.tool.shape[0]):
                force += tally.tool[p, t, axis]
                tally.tool[p, t, axis] = 0.0
            tally.tool_sum[t, axis] += force
            before, motion, load = tools.velocity[t, axis], tools.motion[t, axis], tools.load[t, axis]
            if motion == HELD:
                continue
            if motion >= 0:
                after = tables.now[1, motion]
                tally.energy[0, 0] -= force * 0.5 * (before + after) * dt
            else:
                applied = present_load(1.0, load, tables) if load >= 0 else 0.0
                slowed = 1.0 / (1.0 + 0.5 * tools.drag[t] * dt)
                free = before * (1.0 - 0.5 * tools.drag[t] * dt) + (force + applied) * dt / tools.mass[t]
                after = free * slowed
                mean = 0.5 * (before + after)
                tally.energy[0, 0] += applied * mean * dt
                tally.energy[0, 3] += tools.drag[t] * tools.mass[t] * mean * mean * dt
            tools.velocity[t, axis] = after
            tools.position[t, axis] += dt * after


@njit(**KERNEL)
def tool_energies(nodes, tools, touch, n_nodes):
    """Elastic energy of the contacts with tools and kinetic energy of free tools [mJ]; largest depth [mm]."""
    elastic, deepest, kinetic = 0.0, 0.0, 0.0
    x, y, z = rows3(nodes.position)
    for t in range(tools.kind.size):
        law, kind, frame, grid = tools.law[t], tools.kind[t], tool_frame(t, tools), tools.grid[t]
        for i in range(n_nodes):
            if touch.pressure[t, i] > 0.0:
                gap = frame_distance(kind, frame, grid, tools.samples, x[i], y[i], z[i])[0]
                depth = max(touch.radius[i] - gap, 0.0)
                spring2 = touch.spring[t, 0, i] ** 2 + touch.spring[t, 1, i] ** 2 + touch.spring[t, 2, i] ** 2
                elastic += 0.5 * touch.stiffness[i] * (law[NORMAL] * depth * depth + law[TANGENTIAL] * spring2)
                deepest = max(deepest, depth)
        for axis in range(3):
            if tools.motion[t, axis] == FREE:
                kinetic += 0.5 * tools.mass[t] * tools.velocity[t, axis] ** 2
    return elastic, kinetic, deepest


# Contact of nodes with tools, block by block; the only place that knows about blocking.
#
# Nodes that may reach a tool soon are listed by bounds without branches. Their distances are found one by one; the
# nodes that touch are packed into a flat scratch with compile-time strides, over which the loop of the forces
# vectorises (separate arrays would cost LLVM's alias checks).

#: share of a distance that is taken for it: what rounding leaves
ROUNDING = 1.0 - 1e-9
#: nodes that are looked at together
BLOCK = 128
STRIDE = BLOCK + 8  # no power of two, as in :mod:`contact_scratch`
LANES = np.uintp(STRIDE)
#: steps for which nodes that come near are listed
AHEAD = 20.0
# Rows of the scratch: least distance of each node by the bounds; then, of those that touch, number of the node, depth,
# outward normal (3), slide of the step (3), sticking spring (3), stiffness, viscous coefficient, 1 where it slips,
# force (3), pressure, energy lost to friction and to damping
GAP, NODE, DEPTH, NORM, SLIDE, SPRING, STIFF, VISCOUS, SLIPS, FORCE, PRESSURE, LOST, DAMPED = (
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


@njit(**PART)
def forget_rooms(touch):
    """Look at every block anew: nodes and tools may have been moved by hand."""
    for t in range(touch.room.shape[0]):
        for block in range(touch.room.shape[1]):
            touch.room[t, block] = 0.0


@njit(**KERNEL)
def touch_tools(partition, first, last, dt, nodes, tools, touch, tally, w):
    """Add the tools' forces on nodes first..last; tally forces on the tools [N] and energies [mJ].

    A block is looked at for a tool once both may have come together by what was between them; until then only those of
    its nodes are that were near. ``w`` is work space of ``SCRATCH`` numbers.
    """
    for start in range(first, last, BLOCK):
        count, block = min(BLOCK, last - start), block_of(partition, first, start)
        moved = dt * _speed(start, count, nodes)
        for t in range(tools.kind.size):
            u = tools.velocity[t]
            closing = moved + dt * sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
            room = touch.room[t, block] - closing
            if room <= 0.0:
                room, touch.near_count[t, block] = _look(t, start, count, AHEAD * closing, nodes, tools, touch, w)
            touch.room[t, block] = room
            if touch.near_count[t, block] > 0:
                _touch(partition, t, start, touch.near_count[t, block], dt, nodes, tools, touch, tally, w)


@njit(**ANY_ORDER)
def _speed(start, count, nodes):
    """Upper bound of the speeds of ``count`` nodes [mm/ms]: the root of the sum of their eighth powers.

    A sum vectorises, the largest does not; it is 1.8 times the speed at most where all of a block move alike.
    """
    vx, vy, vz = rows3(nodes.velocity)
    total = 0.0
    for k in range(U(count)):
        i = U(start) + k
        square = vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i]
        total += (square * square) * (square * square)
    return sqrt(sqrt(sqrt(total)))


@njit(**PART)
def _look(t, start, count, skin, nodes, tools, touch, w):
    """List the ``count`` nodes from ``start`` on that touch tool ``t`` or are within ``skin`` [mm] of it.

    Returns the room between the tool and all others, and how many are listed.
    """
    radius, pressure, near = touch.radius, touch.pressure[t], touch.near[t]
    least_distances(t, tools, start, count, rows3(nodes.position), radius, skin, w)
    room, listed = FAR, 0
    for k in range(U(count)):
        i = U(start) + k
        gap = w[GAP + k] - radius[i]
        if gap < skin or pressure[i] != 0.0:
            near[U(start) + U(listed)] = i
            listed += 1
        else:
            room = min(room, gap)
    return ROUNDING * room, listed


@njit(**PART)
def _touch(partition, t, start, listed, dt, nodes, tools, touch, tally, w):
    """Forces of tool ``t`` on those that touch of the nodes ``listed`` of the block at ``start``."""
    touching = _pack(t, start, listed, dt, nodes, tools, touch, w)
    if touching > 0:
        _forces(touching, dt, tools.law[t], w)
        rubbed, damped = _unpack(t, touching, nodes, touch, tally.tool[partition, t], w)
        tally.energy[partition, 1] += rubbed
        tally.energy[partition, 5] += rubbed
        tally.energy[partition, 3] += damped


@njit(**INLINE)
def _pack(t, start, listed, dt, nodes, tools, touch, w):
    """Pack all that the forces of the touching nodes of a block depend on; returns their number. Others forget their
    springs.
    """
    x, v, spring, u = rows3(nodes.position), rows3(nodes.velocity), rows3(touch.spring[t]), rows3(tools.velocity[t])
    kind, frame, grid, samples = tools.kind[t], tool_frame(t, tools), tools.grid[t], tools.samples
    near, pressure, slipping = touch.near[t], touch.pressure[t], touch.slipping[t]
    m = U(0)
    for k in range(U(listed)):
        i = U(near[U(start) + k])
        gap, nx, ny, nz = frame_distance(kind, frame, grid, samples, x[0][i], x[1][i], x[2][i])
        depth = touch.radius[i] - gap
        if depth <= 0.0:
            pressure[i], slipping[i], spring[0][i], spring[1][i], spring[2][i] = 0.0, 0.0, 0.0, 0.0, 0.0
            continue
        w[NODE + m], w[DEPTH + m], w[STIFF + m], w[VISCOUS + m] = i, depth, touch.stiffness[i], touch.viscous[i]
        store3(w, NORM + m, LANES, (nx, ny, nz))
        store3(w, SLIDE + m, LANES, scale(dt, sub(at3(v, i), u)))
        store3(w, SPRING + m, LANES, at3(spring, i))
        w[SLIPS + m] = slipping[i]
        m += ONE
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
