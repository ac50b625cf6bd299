"""Contact of soft yarns: a dense core in a shell of loose fibres, summed over pairs of nodes of their centre-lines.

Two yarns store the energy V(d) per length of either between points at the distance d (Singal et al., 2024, Nature
Communications 15, 2622, for a fibre mass whose pressure grows as a power of its density), with the outer and the core
diameter of equal yarns, D their difference and z = (d - core) / D:

    V = k D^2 / (p (p - 1)) (z^(1 - p) - 1 + (1 - p)(1 - z)),    -dV/dd = k D / p (z^-p - 1).

The sum over nodes, each with its length, is the integral over both yarns. Straight yarns that cross at the angle a at
the distance d store 2 pi / sin(a) times the integral of V(r) r from d to the outer diameter, and press each other with
F = 2 pi d V(d) / sin(a). The kernels take -dV/dd from a table, piece by piece linear, and V as its exact integral, so
that force and energy agree. Below a least distance the law continues along its tangent.

Friction sticks and slides at each pair along the plane across the line between both nodes, with one Coulomb
coefficient. It sees the motion of the centre-lines: a yarn that rolls is taken to slide.
"""

from math import sqrt

from numba import njit

from knittest.kernels.vec import INLINE, KERNEL, PARTITIONS, at3, rows3, scale, sub


@njit(**INLINE)
def shell_pressure(distance, law):
    """Pressure -dV/dd [N/mm2], its stiffness [N/mm3] and V [N/mm] at a ``distance`` [mm] below the outer diameter."""
    if distance <= law.least:
        over = law.least - distance
        pressure = law.pressure[0] + law.steepest * over
        return pressure, law.steepest, law.energy[0] + 0.5 * over * (law.pressure[0] + pressure)
    place = (distance - law.least) * law.inv_step
    k = min(int(place), law.pressure.size - 2)
    share = place - k
    below, above = law.pressure[k], law.pressure[k + 1]
    pressure = below + share * (above - below)
    energy = law.energy[k + 1] + 0.5 * (1.0 - share) * (pressure + above) / law.inv_step
    return pressure, (below - above) * law.inv_step, energy


@njit(**KERNEL)
def press_pairs(p, dt, nodes, pairs, law, tally):
    """Find the forces of share ``p`` of the pairs and book what friction takes."""
    count = pairs.weight.size
    x, v, spring, force = rows3(nodes.position), rows3(nodes.velocity), rows3(pairs.spring), rows3(pairs.force)
    outer2 = law.outer * law.outer
    for c in range(count * p // PARTITIONS, count * (p + 1) // PARTITIONS):
        i, j = pairs.node[0, c], pairs.node[1, c]
        dx, dy, dz = sub(at3(x, i), at3(x, j))
        distance2 = dx * dx + dy * dy + dz * dz
        if distance2 >= outer2:
            for row in range(3):
                spring[row][c] = 0.0
                force[row][c] = 0.0
            continue
        distance = sqrt(distance2)
        inv = 1.0 / max(distance, 1e-9)
        nx, ny, nz = dx * inv, dy * inv, dz * inv
        weight = pairs.weight[c]
        pressure = weight * shell_pressure(distance, law)[0]
        if law.friction == 0.0:
            force[0][c], force[1][c], force[2][c] = pressure * nx, pressure * ny, pressure * nz
            continue
        ex, ey, ez = at3(spring, c)
        ux, uy, uz = scale(dt, sub(at3(v, i), at3(v, j)))
        tx, ty, tz = ex + ux, ey + uy, ez + uz
        along = tx * nx + ty * ny + tz * nz
        tx, ty, tz = tx - along * nx, ty - along * ny, tz - along * nz
        stiffness = weight * law.tangential
        trial, limit = stiffness * sqrt(tx * tx + ty * ty + tz * tz), law.friction * pressure
        share = limit / trial if trial > limit else 1.0
        sx, sy, sz = share * tx, share * ty, share * tz
        slip = (ex + sx) * (tx - sx) + (ey + sy) * (ty - sy) + (ez + sz) * (tz - sz)
        tally.energy[p, 1] += pairs.share[c] * 0.5 * stiffness * slip
        spring[0][c], spring[1][c], spring[2][c] = sx, sy, sz
        force[0][c] = pressure * nx - stiffness * sx
        force[1][c] = pressure * ny - stiffness * sy
        force[2][c] = pressure * nz - stiffness * sz


@njit(**KERNEL)
def gather_pairs(start, stop, nodes, pairs):
    """Add the forces of the pairs to the nodes from ``start`` to ``stop``."""
    force, total = rows3(pairs.force), rows3(nodes.force)
    for i in range(start, stop):
        for k in range(pairs.start[i], pairs.start[i + 1]):
            c = pairs.entry[k] >> 1
            sign = 1.0 if pairs.entry[k] & 1 == 0 else -1.0
            for row in range(3):
                total[row][i] += sign * force[row][c]


@njit(**KERNEL)
def pair_statistics(nodes, pairs, law):
    """Energy [mJ] of all pairs, sum of their forces [N] and least distance [mm], each by its share."""
    x, spring, force = rows3(nodes.position), rows3(pairs.spring), rows3(pairs.force)
    energy, total, least = 0.0, 0.0, law.outer
    for c in range(pairs.weight.size):
        dx, dy, dz = sub(at3(x, pairs.node[0, c]), at3(x, pairs.node[1, c]))
        distance = sqrt(dx * dx + dy * dy + dz * dz)
        if distance < law.outer:
            ex, ey, ez = at3(spring, c)
            stored = shell_pressure(distance, law)[2] + 0.5 * law.tangential * (ex * ex + ey * ey + ez * ez)
            energy += pairs.share[c] * pairs.weight[c] * stored
            fx, fy, fz = at3(force, c)
            total += pairs.share[c] * sqrt(fx * fx + fy * fy + fz * fz)
            least = min(least, distance)
    return energy, total, least
