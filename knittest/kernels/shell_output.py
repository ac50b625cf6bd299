"""Energies and element fields of the shells, from positions and rotations; scalar loops in a fixed order."""

import numpy as np
from numba import njit

from knittest.kernels.biaxial import biaxial_energy, biaxial_forces
from knittest.kernels.laws import hinge_energy, hinge_force, odd_hinge_energy, odd_hinge_force, slider_force
from knittest.kernels.shell import (
    arcsine,
    drill,
    fibre_frame,
    fibre_pair,
    fibre_strain,
    hourglass,
    hourglass_energy,
    layers_energies,
    transverse_shears,
)
from knittest.kernels.shell_state import (
    ALIVE,
    AREA,
    SHAPE,
    SLIP,
    WARP,
    distortion_of,
    fibres_of,
    hold_of,
    normal_of,
    state_index,
    warp_of,
)
from knittest.kernels.vec import ALLOCATING, KERNEL, PART, dot, rotate


@njit(**PART)
def _corner(n, normal, nodes):
    x, q = nodes.position, nodes.rotation
    return (x[0, n], x[1, n], x[2, n]), rotate(q[0, n], q[1, n], q[2, n], q[3, n], normal)


@njit(**PART)
def _corners(e, nodes, shells):
    """Positions and directors of the corners of element ``e``."""
    normal = normal_of(shells.state, state_index(e))
    x1, d1 = _corner(shells.conn[e, 0], normal, nodes)
    x2, d2 = _corner(shells.conn[e, 1], normal, nodes)
    x3, d3 = _corner(shells.conn[e, 2], normal, nodes)
    x4, d4 = _corner(shells.conn[e, 3], normal, nodes)
    return (x1, x2, x3, x4), (d1, d2, d3, d4)


@njit(**PART)
def _drilling_energy(e, a, b, directors, nodes, shells, laminate):
    """Energy of the corners' turns about the normal against the fibres a, b, per area."""
    energy = 0.0
    for c in range(4):
        q, n = nodes.rotation, shells.conn[e, c]
        warp = rotate(q[0, n], q[1, n], q[2, n], q[3, n], warp_of(shells.state, state_index(e)))
        turn, _ = drill(a, b, warp, directors[c])
        energy += 0.125 * laminate.drilling * turn * turn
    return energy


@njit(**PART)
def _layers_energies(strain, bend, direction, laminate):
    """Energies per area of one direction's stretching and of its bending."""
    middle = 0.5 * laminate.compression[direction] * min(strain, 0.0) ** 2
    for h in range(laminate.knee.shape[1]):
        middle += hinge_energy(strain, laminate.knee[direction, h], laminate.slope[direction, h])
    return layers_energies(strain, bend, middle, laminate.outer[direction], laminate.layer_offset)


@njit(**PART)
def _stretching_energy(energy, strains, alone, laminate):
    """Energy of the membrane per area; ``alone`` are those of both directions, if they have laws of their own."""
    if energy is None:
        return alone[0] + alone[1] + laminate.coupling_membrane * strains[0] * strains[1]
    else:
        return biaxial_energy(laminate, strains[0], strains[1])


@njit(**PART)
def _force_alone(strain, i, laminate):
    """Force per width of the direction ``i`` without the other one."""
    force = 2.0 * laminate.outer[i] * strain + laminate.compression[i] * min(strain, 0.0)
    for h in range(laminate.knee.shape[1]):
        force += hinge_force(strain, laminate.knee[i, h], laminate.slope[i, h])
    return force


@njit(**PART)
def _membrane_forces(energy, strains, laminate):
    """Forces per width of warp and weft."""
    if energy is None:
        warp, weft = _force_alone(strains[0], 0, laminate), _force_alone(strains[1], 1, laminate)
        return warp + laminate.coupling_membrane * strains[1], weft + laminate.coupling_membrane * strains[0]
    else:
        return biaxial_forces(laminate, strains[0], strains[1])


@njit(**PART)
def _shear_energy(angle, slip, laminate):
    """Elastic energy of the shear law per area, that of the spring behind its friction included."""
    elastic, force = 0.0, 0.0
    for h in range(laminate.shear_knee.size):
        elastic += odd_hinge_energy(angle, laminate.shear_knee[h], laminate.shear_slope[h])
        force += odd_hinge_force(angle, laminate.shear_knee[h], laminate.shear_slope[h])
    share, stick = laminate.shear_friction, laminate.shear_stick
    friction = slider_force(angle - slip, stick, share * abs(force))
    return (1.0 - share) * elastic + 0.5 * friction * friction / stick


@njit(**PART)
def element_energies(e, nodes, shells, laminate):
    """Energies [mJ] of element ``e``, alive or not: elastic ones of stretching (the coupling's with it), bending (with
    twisting and transverse shear) and shear; that of the hourglass control and of drilling.
    """
    s = state_index(e)
    fibres, distortion = fibres_of(shells.state, s), distortion_of(shells.state, s)
    x, d = _corners(e, nodes, shells)
    frame = fibre_frame(x, d, fibres)
    a, b, a_z, b_z = frame
    inv_a, inv_b, sine = fibre_pair(a, b)
    strain_a, strain_b = fibre_strain(a, inv_a), fibre_strain(b, inv_b)
    bend_a, bend_b = dot(a, a_z) * inv_a, dot(b, b_z) * inv_b
    stretching_a, bending_a = _layers_energies(strain_a, bend_a, 0, laminate)
    stretching_b, bending_b = _layers_energies(strain_b, bend_b, 1, laminate)
    alone = stretching_a, stretching_b
    stretching = _stretching_energy(laminate.energy, (strain_a, strain_b), alone, laminate)
    bent = bending_a + bending_b + laminate.coupling_bending * bend_a * bend_b
    bent += 0.5 * laminate.twist * (dot(a, b_z) + dot(b, a_z)) ** 2
    shear_a, shear_b, along, across = transverse_shears(x, d, fibres, shells.state[s + WARP])
    bent += 0.5 * (laminate.transverse[0] * shear_a**2 + laminate.transverse[1] * shear_b**2)
    sheared = _shear_energy(arcsine(sine), shells.state[s + SLIP], laminate)
    shape = shells.state[s + SHAPE]
    bending = shape * laminate.hourglass_bending
    control = hourglass_energy(frame, hourglass(x, distortion), hold_of(shells.state, s, laminate))
    control += hourglass_energy(frame, hourglass(d, distortion), (bending, bending))
    control += 0.5 * shape * laminate.hourglass_transverse * (along**2 + across**2)
    drilling = _drilling_energy(e, a, b, d, nodes, shells, laminate)
    area = shells.state[s + AREA]
    return area * stretching, area * bent, area * sheared, control + area * drilling


@njit(**PART)
def element_energy(e, nodes, shells, laminate):
    """Elastic energy, and energy of the hourglass control and of drilling [mJ], of element ``e``, alive or not."""
    stretching, bent, sheared, control = element_energies(e, nodes, shells, laminate)
    return stretching + bent + sheared, control


@njit(**KERNEL)
def shell_energies(nodes, shells, laminate):
    """Energies of all living shells [mJ], as in :func:`element_energies`."""
    stretching, bent, sheared, control = 0.0, 0.0, 0.0, 0.0
    for e in range(shells.fail_time.size):
        if shells.state[state_index(e) + ALIVE] > 0.0:
            own = element_energies(e, nodes, shells, laminate)
            stretching, bent = stretching + own[0], bent + own[1]
            sheared, control = sheared + own[2], control + own[3]
    return stretching, bent, sheared, control


@njit(**ALLOCATING)
def shell_fields(n_el, nodes, shells, laminate):
    """Membrane strain warp, weft [-], shear angle [rad], force per width warp, weft [N/mm] of each shell, (5, n_el).

    Forces are those of whole shells: a deleted one carries none.
    """
    fields = np.zeros((5, n_el))
    for e in range(n_el):
        s = state_index(e)
        x, d = _corners(e, nodes, shells)
        a, b, _, _ = fibre_frame(x, d, fibres_of(shells.state, s))
        inv_a, inv_b, sine = fibre_pair(a, b)
        fields[0, e], fields[1, e], fields[2, e] = fibre_strain(a, inv_a), fibre_strain(b, inv_b), arcsine(sine)
        fields[3, e], fields[4, e] = _membrane_forces(laminate.energy, (fields[0, e], fields[1, e]), laminate)
    return fields


@njit(**ALLOCATING)
def shell_moments(n_el, nodes, shells, laminate):
    """Moment per width of warp and weft [N], and of twisting [N], of each shell, (3, n_el).

    Positive where the side that the normal points to is stretched.
    """
    moments = np.zeros((3, n_el))
    for e in range(n_el):
        s = state_index(e)
        x, d = _corners(e, nodes, shells)
        a, b, a_z, b_z = fibre_frame(x, d, fibres_of(shells.state, s))
        inv_a, inv_b, _ = fibre_pair(a, b)
        alive = shells.state[s + ALIVE]
        stiffness, coupling = (
            2.0 * laminate.layer_offset * laminate.layer_offset * alive,
            laminate.coupling_bending * alive,
        )
        bend_a, bend_b = dot(a, a_z) * inv_a, dot(b, b_z) * inv_b
        moments[0, e] = stiffness * laminate.outer[0] * bend_a + coupling * bend_b
        moments[1, e] = stiffness * laminate.outer[1] * bend_b + coupling * bend_a
        moments[2, e] = alive * laminate.twist * (dot(a, b_z) + dot(b, a_z))
    return moments
