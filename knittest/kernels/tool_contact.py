"""Contact of nodes with rigid tools: penalty and friction with a sticking spring; motion of the tools."""

from math import sqrt

from numba import njit

from knittest.kernels.drive_state import KINETIC, NORMAL, STATIC, TANGENTIAL
from knittest.kernels.loads import load_now
from knittest.kernels.options import KERNEL
from knittest.kernels.rows import rows3
from knittest.kernels.tool_shapes import tool_distance

#: entries of ``Tools.motion`` that are not a table
HELD, FREE = -1, -2


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


@njit(**KERNEL)
def touch_tools(partition, first, last, dt, nodes, tools, touch, tally):
    """Add the tools' forces on nodes first..last; tally forces on the tools [N] and energies [mJ]."""
    x, y, z = rows3(nodes.position)
    vx, vy, vz = rows3(nodes.velocity)
    fx, fy, fz = rows3(nodes.force)
    for t in range(tools.kind.size):
        law = tools.law[t]
        ux, uy, uz = tools.velocity[t, 0], tools.velocity[t, 1], tools.velocity[t, 2]
        sum_x, sum_y, sum_z, lost = 0.0, 0.0, 0.0, 0.0
        spring = touch.spring[t]
        for i in range(first, last):
            gap, nx, ny, nz = tool_distance(t, tools, x[i], y[i], z[i])
            depth = touch.radius[i] - gap
            if depth <= 0.0:
                if touch.pressure[t, i] > 0.0:
                    touch.pressure[t, i], touch.slipping[t, i] = 0.0, 0.0
                    spring[0, i], spring[1, i], spring[2, i] = 0.0, 0.0, 0.0
                continue
            dx, dy, dz = (vx[i] - ux) * dt, (vy[i] - uy) * dt, (vz[i] - uz) * dt
            closing = -(dx * nx + dy * ny + dz * nz)
            elastic = law[NORMAL] * touch.stiffness[i] * depth
            pressure = max(elastic + touch.viscous[i] * sqrt(law[NORMAL]) * closing / dt, 0.0)
            tangential = law[TANGENTIAL] * touch.stiffness[i]
            ex, ey, ez = spring[0, i], spring[1, i], spring[2, i]
            tx, ty, tz = ex + dx, ey + dy, ez + dz
            normal2 = nx * nx + ny * ny + nz * nz
            along = (tx * nx + ty * ny + tz * nz) / normal2
            tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
            sx, sy, sz, slips = coulomb(
                tx, ty, tz, tangential, pressure, law[STATIC], law[KINETIC], touch.slipping[t, i]
            )
            slip = (ex + sx) * (tx - sx) + (ey + sy) * (ty - sy) + (ez + sz) * (tz - sz)
            lost += 0.5 * tangential * slip + (pressure - elastic) * closing
            rubs_x, rubs_y, rubs_z = tangential * sx, tangential * sy, tangential * sz
            if slips == 0.0:
                viscous, back = touch.viscous[i] * sqrt(law[TANGENTIAL]) / dt, closing / normal2
                dx, dy, dz = dx + back * nx, dy + back * ny, dz + back * nz
                rubs_x, rubs_y, rubs_z = damp_sticking(
                    rubs_x, rubs_y, rubs_z, dx, dy, dz, viscous, law[STATIC] * pressure
                )
                lost += (rubs_x - tangential * sx) * dx + (rubs_y - tangential * sy) * dy
                lost += (rubs_z - tangential * sz) * dz
            spring[0, i], spring[1, i], spring[2, i] = sx, sy, sz
            touch.slipping[t, i], touch.pressure[t, i] = slips, pressure
            gx, gy, gz = pressure * nx - rubs_x, pressure * ny - rubs_y, pressure * nz - rubs_z
            fx[i], fy[i], fz[i] = fx[i] + gx, fy[i] + gy, fz[i] + gz
            sum_x, sum_y, sum_z = sum_x - gx, sum_y - gy, sum_z - gz
        tally.tool[partition, t, 0] += sum_x
        tally.tool[partition, t, 1] += sum_y
        tally.tool[partition, t, 2] += sum_z
        tally.energy[partition, 1] += lost


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
        law = tools.law[t]
        for i in range(n_nodes):
            if touch.pressure[t, i] > 0.0:
                gap = tool_distance(t, tools, x[i], y[i], z[i])[0]
                depth = max(touch.radius[i] - gap, 0.0)
                spring2 = touch.spring[t, 0, i] ** 2 + touch.spring[t, 1, i] ** 2 + touch.spring[t, 2, i] ** 2
                elastic += 0.5 * touch.stiffness[i] * (law[NORMAL] * depth * depth + law[TANGENTIAL] * spring2)
                deepest = max(deepest, depth)
        for axis in range(3):
            if tools.motion[t, axis] == FREE:
                kinetic += 0.5 * tools.mass[t] * tools.velocity[t, axis] ** 2
    return elastic, kinetic, deepest
