"""Sums and checks over the whole model: energies and penetration in a fixed order, collapsed elements, pierced
contacts.
"""

from math import acos, cos, sqrt

import numpy as np
from numba import njit

from knittest.kernels.beam import beam_energies
from knittest.kernels.contact import SIDE_BY_SIDE, penalty, spline_weights
from knittest.kernels.laws import hinge_force
from knittest.kernels.shell_state import AREA, state_index
from knittest.kernels.soft_contact import shell_pressure
from knittest.kernels.vec import (
    ALLOCATING,
    INLINE,
    KERNEL,
    LANE_SUMS,
    PART,
    U,
    at3,
    combine,
    dot,
    rows3,
    sub,
    total_of_sums,
)


@njit(**ALLOCATING)
def kinetic_energy(nodes, mass, inertia, dt):
    """Kinetic energy at the last force evaluation [mJ] and what damping takes of it in one step [mJ].

    The product of the velocities before and after it, with the elastic energy at that instant, is what central
    differences conserve (exactly, if the system is linear); squares of the half-step velocity are off by up to a
    factor 5 for element-size waves. The small rotary part is taken at the half step. ``mass`` [g], ``inertia``
    [g mm^2] are 0 for clamped nodes.
    """
    w, inv_mass, damping = np.zeros(2 * LANE_SUMS), nodes.inv_mass, nodes.damping_factor
    for axis in range(3):
        v, f, spin = nodes.velocity[axis], nodes.force[axis], nodes.spin[axis]
        for block in range(0, mass.size, LANE_SUMS):
            for k in range(U(min(LANE_SUMS, mass.size - block))):
                i = U(block) + k
                factor = damping[i]
                moving = mass[i] * v[i] * (v[i] - dt * inv_mass[i] * f[i]) / factor + inertia[i] * spin[i] * spin[i]
                w[k] += moving
                w[U(LANE_SUMS) + k] += (1.0 - factor * factor) * moving
    return 0.5 * total_of_sums(w, U(0)), 0.5 * total_of_sums(w, U(LANE_SUMS))


@njit(**ALLOCATING)
def section_energies(nodes, parts, beams):
    """Elastic energies [mJ] of the living beams of each section, (n_sections, 3): of stretching, bending, torsion."""
    total = np.zeros((beams.stiffness.shape[0], 3))
    for k in range(parts.span.shape[0]):
        section = parts.span[k, 2]
        if section >= 0:
            for i in range(parts.span[k, 0], parts.span[k, 1]):
                if beams.alive[i] > 0.0:
                    stretched, bent, twisted = beam_energies(i, section, nodes, beams)
                    total[section, 0] += stretched
                    total[section, 1] += bent
                    total[section, 2] += twisted
    return total


@njit(**ALLOCATING)
def contact_statistics(contacts, count, law, radius):
    """Elastic contact energy [mJ], and penetration over the smaller radius of the contacts that touch (n_touching,)."""
    energy, share, touching = 0.0, np.empty(count), 0
    fx, fy, fz = rows3(contacts.force)
    gx, gy, gz = rows3(contacts.offset)
    ex, ey, ez = rows3(contacts.spring)
    for c in range(count):
        share_of_cell = contacts.share[c]
        if share_of_cell > 0.0 and (fx[c] != 0.0 or fy[c] != 0.0 or fz[c] != 0.0):
            depth = contacts.reach[c] - sqrt(gx[c] ** 2 + gy[c] ** 2 + gz[c] ** 2)
            stretch2 = ex[c] ** 2 + ey[c] ** 2 + ez[c] ** 2
            stored = penalty(depth, law.normal, law.linear, law.square, law.cubic, law.cap)[2]
            stored += 0.5 * law.tangential * stretch2 + 0.5 * law.torsional * contacts.twist[c] ** 2
            energy += share_of_cell * stored
            share[touching] = depth / min(radius[contacts.piece[0, c]], radius[contacts.piece[1, c]])
            touching += 1
    return energy, share[:touching]


@njit(**ALLOCATING)
def axial_state(nodes, parts, beams):
    """Axial strain [-] and force [N] of every beam slot, (n_nodes,) each; 0 where no living beam is."""
    x, y, z = rows3(nodes.position)
    from_law = np.zeros((2, beams.alive.size))
    for k in range(parts.span.shape[0]):
        section = parts.span[k, 2]
        if section < 0:
            continue
        for i in range(parts.span[k, 0], parts.span[k, 1]):
            if beams.alive[i] > 0.0:
                rx, ry, rz = x[i + 1] - x[i], y[i + 1] - y[i], z[i + 1] - z[i]
                strain = sqrt(rx * rx + ry * ry + rz * rz) * beams.inv_length[i] - 1.0
                force = beams.stiffness[section, 0] * min(strain, 0.0)
                for h in range(beams.hinge_strain.shape[1]):
                    over = max(strain - beams.slack[i] - beams.hinge_strain[section, h], 0.0)
                    force += beams.hinge_slope[section, h] * over
                from_law[0, i], from_law[1, i] = strain, force
    return from_law


# Search of the whole model for invalid states: collapsed elements, pierced contacts, overloaded nodes.
#
# Called every few steps, so faults are counted without branches; the entity is only searched for where there is one.


@njit(**KERNEL)
def count_short_beams(position, alive, inv_length, limit):
    """Living beams shorter than ``limit`` times their rest length."""
    x, y, z = rows3(position)
    count, limit2 = 0, limit * limit
    for i in range(alive.size):
        dx, dy, dz = x[i + 1] - x[i], y[i + 1] - y[i], z[i + 1] - z[i]
        stretch2 = (dx * dx + dy * dy + dz * dz) * inv_length[i] * inv_length[i]
        count += (stretch2 < limit2) & (alive[i] > 0.0)
    return count


@njit(**KERNEL)
def least_stable_beam(nodes, parts, beams):
    """Living beam whose sections are nearest to turning against its axis, and N / (GA (1 + e)) there; -1 if none pulls.

    e is the strain of the chord: that of sections which have turned stays behind. Above 1 they are not stable, see
    :func:`knittest.materials.yarn_section.stable_shear`.
    """
    x, y, z = rows3(nodes.position)
    worst, largest = -1, 0.0
    for k in range(parts.span.shape[0]):
        section = parts.span[k, 2]
        if section < 0:
            continue
        shear = max(beams.stiffness[section, 1], 1e-300)
        for i in range(parts.span[k, 0], parts.span[k, 1]):
            dx, dy, dz = x[i + 1] - x[i], y[i + 1] - y[i], z[i + 1] - z[i]
            stretch = sqrt(dx * dx + dy * dy + dz * dz) * beams.inv_length[i]
            force = 0.0
            for h in range(beams.hinge_strain.shape[1]):
                over = stretch - 1.0 - beams.slack[i]
                force += hinge_force(over, beams.hinge_strain[section, h], beams.hinge_slope[section, h])
            ratio = beams.alive[i] * force / (shear * stretch)
            if ratio > largest:
                worst, largest = i, ratio
    return worst, largest


@njit(**KERNEL)
def count_pierced(offset, reach, line, count, limit):
    """Contacts, but of yarns side by side, whose centre-lines are nearer than ``limit`` times the reach: one yarn is
    about to pass the other.
    """
    gx, gy, gz = rows3(offset)
    found, limit2 = 0, limit * limit
    for c in range(count):
        gap2 = gx[c] * gx[c] + gy[c] * gy[c] + gz[c] * gz[c]
        found += (gap2 < limit2 * reach[c] * reach[c]) & (line[c] != SIDE_BY_SIDE)
    return found


@njit(**INLINE)
def _largest_eigenvalue(xx, yy, zz, yz, xz, xy):
    """Eigenvalues of a symmetric 3 x 3 matrix (Smith, 1961, Eigenvalues of a symmetric 3 x 3 matrix, Comm. ACM 4)."""
    mean = (xx + yy + zz) / 3.0
    x, y, z = xx - mean, yy - mean, zz - mean
    spread = (x * x + y * y + z * z + 2.0 * (yz * yz + xz * xz + xy * xy)) / 6.0
    det = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz)
    ratio = 0.5 * det / max(spread * sqrt(spread), 1e-300)
    return mean + 2.0 * sqrt(spread) * cos(acos(min(max(ratio, -1.0), 1.0)) / 3.0)


@njit(**INLINE)
def _add_dyad(load, i, along, across, x, y, z):
    """Add ``across`` I + (``along`` - ``across``) n n^T to row i of ``load`` (n, 6): xx, yy, zz, yz, xz, xy."""
    over = along - across
    load[i, 0] += across + over * x * x
    load[i, 1] += across + over * y * y
    load[i, 2] += across + over * z * z
    load[i, 3] += over * y * z
    load[i, 4] += over * x * z
    load[i, 5] += over * x * y


@njit(**PART)
def _add_contacts(contacts, count, law, nodes, load):
    """Add every loaded contact to its six nodes: penalty along its normal, sticking across it, couples and spin."""
    fx, fy, fz = rows3(contacts.force)
    gx, gy, gz = rows3(contacts.offset)
    first, second, elliptic = rows3(contacts.shift), rows3(contacts.other), contacts.excess.size > 0
    pieces, parameters, reach, arms = contacts.piece, contacts.parameter, contacts.reach, contacts.arm
    inv_mass, inv_inertia = nodes.inv_mass, nodes.inv_inertia
    for c in range(count):
        if fx[c] == 0.0 and fy[c] == 0.0 and fz[c] == 0.0:
            continue
        gap = max(sqrt(gx[c] ** 2 + gy[c] ** 2 + gz[c] ** 2), 1e-12)
        depth = max(reach[c] - gap, 0.0)
        normal = penalty(depth, law.normal, law.linear, law.square, law.cubic, law.cap)[1]
        a, b = spline_weights(parameters[0, c]), spline_weights(parameters[1, c])
        total = abs(a[0]) + abs(a[1]) + abs(a[2]) + abs(b[0]) + abs(b[1]) + abs(b[2])
        torsional = law.torsional if contacts.lever[1, c] > 0.0 else 0.0
        for side in range(2):
            arm = arms[c] if side == 0 else 1.0 - arms[c]
            arm2, across2 = (gap * arm) ** 2, 0.0
            if elliptic:
                n = (gx[c] / gap, gy[c] / gap, gz[c] / gap)
                lever = combine(arm * gap, n, 1.0, at3(second, c) if side == 1 else at3(first, c))
                arm2 = dot(lever, lever)
                across2 = max(arm2 - dot(lever, n) ** 2, 0.0)
            before, at, after = a if side == 0 else b
            for k, weight in enumerate((before, at, after)):
                i = pieces[side, c] - 1 + k
                if inv_mass[i] > 0.0:
                    share = total * abs(weight)
                    turns = inv_inertia[i] / inv_mass[i]
                    across = law.tangential * (1.0 + arm2 * turns) + torsional * turns
                    along = normal * (1.0 + across2 * turns) + torsional * turns
                    _add_dyad(load, i, share * along, share * across, gx[c] / gap, gy[c] / gap, gz[c] / gap)


@njit(**INLINE)
def _add_beam(load, i, element, axial, shear, x, y, z):
    """Add the beam ``element`` at its present direction to node ``i``."""
    if axial[element] > 0.0:
        j = element + 1
        dx, dy, dz = x[j] - x[element], y[j] - y[element], z[j] - z[element]
        inv = 1.0 / max(sqrt(dx * dx + dy * dy + dz * dz), 1e-12)
        _add_dyad(load, i, 2.0 * axial[element], 2.0 * shear[element], inv * dx, inv * dy, inv * dz)


@njit(**KERNEL)
def stiffest_node(contacts, count, law, axial, shear, nodes, load):
    """Node with the largest bound of its squared frequency [1/ms^2], and that bound; -1 if none moves.

    The bound is that of :func:`knittest.models.chains.nodal_loads` with the contacts as they are. ``axial`` and
    ``shear`` (n,) stiffness of the beams [N/mm], 0 where there is none; ``load`` (n, 6) is work space, zero before and
    after.
    """
    _add_contacts(contacts, count, law, nodes, load)
    x, y, z = rows3(nodes.position)
    pieces, inv_mass = contacts.piece, nodes.inv_mass
    worst, largest = -1, 0.0
    for c in range(count):
        for side in range(2):
            for i in range(pieces[side, c] - 1, pieces[side, c] + 2):
                if load[i, 0] + load[i, 1] + load[i, 2] > 0.0:
                    if i > 0:
                        _add_beam(load, i, i - 1, axial, shear, x, y, z)
                    _add_beam(load, i, i, axial, shear, x, y, z)
                    xx, yy, zz = load[i, 0], load[i, 1], load[i, 2]
                    yz, xz, xy = load[i, 3], load[i, 4], load[i, 5]
                    # no eigenvalue exceeds the Frobenius norm, which takes no roots
                    norm2 = xx * xx + yy * yy + zz * zz + 2.0 * (yz * yz + xz * xz + xy * xy)
                    if norm2 * inv_mass[i] * inv_mass[i] > largest * largest:
                        bound = _largest_eigenvalue(xx, yy, zz, yz, xz, xy) * inv_mass[i]
                        if bound > largest:
                            worst, largest = i, bound
                    for k in range(6):
                        load[i, k] = 0.0
    return worst, largest


@njit(**PART)
def _bound_of(i, axial, shear, nodes, load):
    """Bound of the squared frequency [1/ms^2] of node ``i`` from its ``load`` and its beams."""
    x, y, z = rows3(nodes.position)
    if i > 0:
        _add_beam(load, i, i - 1, axial, shear, x, y, z)
    _add_beam(load, i, i, axial, shear, x, y, z)
    return (
        _largest_eigenvalue(load[i, 0], load[i, 1], load[i, 2], load[i, 3], load[i, 4], load[i, 5]) * nodes.inv_mass[i]
    )


@njit(**KERNEL)
def stiffest_soft_node(pairs, law, axial, shear, nodes, load):
    """:func:`stiffest_node` with pairs of soft yarns: pressing along their line, sticking or pressure across it."""
    position = rows3(nodes.position)
    for c in range(pairs.weight.size):
        i, j = pairs.node[0, c], pairs.node[1, c]
        offset = sub(at3(position, i), at3(position, j))
        distance = max(sqrt(dot(offset, offset)), 1e-9)
        if distance < law.outer:
            pressure, stiffness, _ = shell_pressure(distance, law)
            across = max(law.tangential, pressure / distance)
            weight, inv = 2.0 * pairs.weight[c], 1.0 / distance
            for node in (i, j):
                _add_dyad(
                    load, node, weight * stiffness, weight * across, inv * offset[0], inv * offset[1], inv * offset[2]
                )
    worst, largest = -1, 0.0
    for i in range(pairs.start.size - 1):
        if load[i, 0] + load[i, 1] + load[i, 2] > 0.0:
            bound = _bound_of(i, axial, shear, nodes, load) if nodes.inv_mass[i] > 0.0 else 0.0
            if bound > largest:
                worst, largest = i, bound
            for k in range(6):
                load[i, k] = 0.0
    return worst, largest


@njit(**KERNEL)
def smallest_shell(position, conn, fail_time, state):
    """Living shell with the smallest area over its reference area [-], and that ratio; -1 if none lives."""
    x, y, z = rows3(position)
    worst, least = -1, np.inf
    for e in range(fail_time.size):
        if fail_time[e] != np.inf:
            continue
        i, j, k, m = conn[e, 0], conn[e, 1], conn[e, 2], conn[e, 3]
        ax, ay, az = x[k] - x[i], y[k] - y[i], z[k] - z[i]
        bx, by, bz = x[m] - x[j], y[m] - y[j], z[m] - z[j]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        area = 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)
        ratio = area / state[state_index(e) + AREA]
        if ratio < least:
            worst, least = e, ratio
    return worst, least
