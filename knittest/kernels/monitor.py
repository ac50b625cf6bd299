"""Sums over the whole model, in a fixed order: energies, penetration."""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.beam_blocks import beam_energies
from knittest.kernels.contact import penalty
from knittest.kernels.options import ALLOCATING, KERNEL
from knittest.kernels.rows import rows3


@njit(**KERNEL)
def kinetic_energy(nodes, mass, inertia, dt):
    """Kinetic energy at the last force evaluation [mJ] and what damping takes of it in one step [mJ].

    The product of the velocities before and after it, with the elastic energy at that instant, is what central
    differences conserve (exactly, if the system is linear); squares of the half-step velocity are off by up to a
    factor 5 for element-size waves. The small rotary part is taken at the half step. ``mass`` [g], ``inertia``
    [g mm^2] are 0 for clamped nodes.
    """
    total, lost = 0.0, 0.0
    for k in range(3):
        v, f, w = nodes.velocity[k], nodes.force[k], nodes.spin[k]
        for i in range(mass.size):
            factor = nodes.damping_factor[i]
            moving = mass[i] * v[i] * (v[i] - dt * nodes.inv_mass[i] * f[i]) / factor + inertia[i] * w[i] * w[i]
            total += moving
            lost += (1.0 - factor * factor) * moving
    return 0.5 * total, 0.5 * lost


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
