"""Contact of nodes with rigid tools: penalty and friction with a sticking spring; motion of the tools."""

from math import sqrt

from numba import njit

from knittest.kernels.drive_state import KINETIC, NORMAL, STATIC, TANGENTIAL
from knittest.kernels.loads import load_now
from knittest.kernels.options import INLINE, KERNEL, U
from knittest.kernels.rows import rows3
from knittest.kernels.tool_shapes import frame_distance, least_distances, tool_frame
from knittest.kernels.vec import add, combine, dot, scale, sub

#: entries of ``Tools.motion`` that are not a table
HELD, FREE = -1, -2
#: nodes that are looked at together
BLOCK = 1024
SCRATCH = BLOCK + 1


@njit(**KERNEL)
def coulomb(sx, sy, sz, tangential, pressure, static, kinetic, slipping):
    """Return the sticking spring (3) [mm] to the Coulomb limit; also 1 where it slips.

    A node that sticks gives way at the static limit and slips at the kinetic one until its spring falls below that.
    """
    trial = tangential * sqrt(sx * sx + sy * sy + sz * sz)
    limit = (kinetic if slipping > 0.0 else static) * pressure
    if trial <= limit:
        return sx, sy, sz, 0.0
    share = kinetic * pressure / trial
    return share * sx, share * sy, share * sz, 1.0


@njit(**KERNEL)
def damp_sticking(fx, fy, fz, dx, dy, dz, viscous, limit):
    """Sticking force (3) [N] with ``viscous`` [N/mm] times the step's slide d (3) added, up to ``limit``.

    Without it a node that stops swings about its sticking force and slips again below the static limit.
    """
    fx, fy, fz = fx + viscous * dx, fy + viscous * dy, fz + viscous * dz
    size = sqrt(fx * fx + fy * fy + fz * fz)
    share = limit / size if size > limit else 1.0
    return share * fx, share * fy, share * fz


@njit(**INLINE)
def touch_force(n, d, e, depth, normal, viscous, tangential, sticking, static, kinetic, slipping, dt):
    """Force of a tool on a touching node.

    ``n`` outward normal (nearly unit), ``d`` slide of this step and ``e`` sticking spring before it (3) [mm]; ``depth``
    [mm]; penalty ``normal`` and ``tangential`` [N/mm] with their damping ``viscous`` and ``sticking`` [N ms/mm].
    Returns force (3) and pressure [N], the spring (3) [mm], 1 where it slips, and the energy lost [mJ].
    """
    closing = -dot(d, n)
    elastic = normal * depth
    pressure = max(elastic + viscous * closing / dt, 0.0)
    normal2 = dot(n, n)
    t = add(e, d)
    t = combine(1.0, t, -dot(t, n) / normal2, n)
    sx, sy, sz, slips = coulomb(t[0], t[1], t[2], tangential, pressure, static, kinetic, slipping)
    s = (sx, sy, sz)
    lost = 0.5 * tangential * dot(add(e, s), sub(t, s)) + (pressure - elastic) * closing
    rubs = scale(tangential, s)
    if slips == 0.0:
        slide = combine(1.0, d, closing / normal2, n)
        rubs = damp_sticking(*rubs, *slide, sticking / dt, static * pressure)
        lost += dot(combine(1.0, rubs, -tangential, s), slide)
    return combine(pressure, n, -1.0, rubs), pressure, s, slips, lost


@njit(**KERNEL)
def touch_tools(partition, first, last, dt, nodes, tools, touch, tally, w):
    """Add the tools' forces on nodes first..last; tally forces on the tools [N] and energies [mJ]."""
    x, y, z = rows3(nodes.position)
    for t in range(tools.kind.size):
        kind, frame, pressure, radius = tools.kind[t], tool_frame(t, tools), touch.pressure[t], touch.radius
        block = first
        while block < last:
            count = min(BLOCK, last - block)
            least_distances(kind, frame, block, count, x, y, z, w)
            for k in range(U(count)):
                i = U(block) + k
                w[k] = w[k] - radius[i] if pressure[i] == 0.0 else -1.0
            _touch_block(t, frame, block, count, dt, nodes, tools, touch, tally.tool[partition, t], w)
            tally.energy[partition, 1] += w[BLOCK]
            block += count


@njit(**INLINE)
def _touch_block(t, frame, start, count, dt, nodes, tools, touch, force_on_tool, w):
    """Forces of tool ``t`` on the nodes of a block whose least distances are in ``w``; leaves the loss in w[BLOCK]."""
    x, y, z = rows3(nodes.position)
    vx, vy, vz = rows3(nodes.velocity)
    fx, fy, fz = rows3(nodes.force)
    kind, grid, law, velocity = tools.kind[t], tools.grid[t], tools.law[t], tools.velocity[t]
    ux, uy, uz = velocity[0], velocity[1], velocity[2]
    ex, ey, ez = rows3(touch.spring[t])
    pressure, slipping = touch.pressure[t], touch.slipping[t]
    damp, stick = sqrt(law[NORMAL]), sqrt(law[TANGENTIAL])
    sum_x, sum_y, sum_z, lost = 0.0, 0.0, 0.0, 0.0
    for k in range(U(count)):
        if w[k] >= 0.0:
            continue
        i = U(start) + k
        gap, nx, ny, nz = frame_distance(kind, frame, grid, tools.samples, x[i], y[i], z[i])
        depth = touch.radius[i] - gap
        if depth <= 0.0:
            pressure[i], slipping[i], ex[i], ey[i], ez[i] = 0.0, 0.0, 0.0, 0.0, 0.0
            continue
        stiffness, viscous = touch.stiffness[i], touch.viscous[i]
        f, pressure[i], e, slipping[i], loss = touch_force(
            (nx, ny, nz), ((vx[i] - ux) * dt, (vy[i] - uy) * dt, (vz[i] - uz) * dt), (ex[i], ey[i], ez[i]), depth,
            law[NORMAL] * stiffness, damp * viscous, law[TANGENTIAL] * stiffness, stick * viscous, law[STATIC],
            law[KINETIC], slipping[i], dt,
        )  # fmt: skip
        ex[i], ey[i], ez[i] = e
        fx[i], fy[i], fz[i] = fx[i] + f[0], fy[i] + f[1], fz[i] + f[2]
        sum_x, sum_y, sum_z, lost = sum_x - f[0], sum_y - f[1], sum_z - f[2], lost + loss
    force_on_tool[0] += sum_x
    force_on_tool[1] += sum_y
    force_on_tool[2] += sum_z
    w[BLOCK] = lost


@njit(**KERNEL)
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
                tally.energy[0, 1] += tools.drag[t] * tools.mass[t] * mean * mean * dt
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
