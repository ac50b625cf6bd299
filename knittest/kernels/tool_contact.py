"""Contact of nodes with rigid tools: penalty and friction with a sticking spring; motion of the tools."""

from math import sqrt

from numba import njit

from knittest.kernels.drive_state import NORMAL, TANGENTIAL
from knittest.kernels.loads import load_now
from knittest.kernels.options import INLINE, KERNEL, PART
from knittest.kernels.rows import rows3
from knittest.kernels.tool_shapes import frame_distance, tool_frame
from knittest.kernels.vec import add, combine, dot, scale, sub

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
                applied = load_now(1.0, load, tables) if load >= 0 else 0.0
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
