"""Shell forces block by block, drilling included, and their deterministic gather at the nodes; the only place that
knows about blocking.

A block of 64 elements is gathered into a flat scratch with compile-time strides, then the loops over its lanes
vectorise: directors and strains, tabulated laws, forces. Corner forces are stored for each element, and every
node collects its own in a fixed order, so the bits do not depend on the number of threads.
"""

import numpy as np
from numba import njit

from knittest.kernels.biaxial import biaxial_forces
from knittest.kernels.laws import hinge_force, slider_force
from knittest.kernels.shell import (
    arcsine,
    coupling_gradients,
    drill_gradients,
    fibre_frame,
    fibre_pair,
    fibre_strain,
    fibre_vectors,
    hourglass,
    hourglass_gradients,
    laminate_gradients,
    moment_of,
    spread,
    transverse_gradients,
    transverse_shears,
)
from knittest.kernels.shell_output import element_energy
from knittest.kernels.shell_state import (
    ALIVE,
    ANGLE,
    AREA,
    BLOCK,
    CORNER_ROWS,
    CORNERS,
    LANES,
    MIDDLE_A,
    MIDDLE_B,
    OUT,
    ROW3,
    RUBBED,
    SHAPE,
    SHEAR,
    SLIP,
    STATE_ROWS,
    STRAIN_A,
    STRAIN_B,
    STRENGTH,
    WARP,
    D,
    X,
    add_to_corner,
    corners,
    distortion_of,
    fibres_of,
    gather,
    hold_of,
    normal_of,
    rotate_vector,
    state_index,
    warp_of,
)
from knittest.kernels.vec import INLINE, KERNEL, PART, U, add, combine, load3, rows3, scale, store3


@njit(**INLINE)
def _corner(w, i, fibres, axes, stiffness):
    """Gradients at ``fibres`` a, b and moment of the corner rotated by ``i``; ``axes``: the initial warp and normal."""
    return drill_gradients(fibres[0], fibres[1], rotate_vector(w, i, axes[0]), rotate_vector(w, i, axes[1]), stiffness)


@njit(**INLINE)
def add_drilling(block, at, out, nodes, shells, laminate, w):
    """Add the forces and moments of drilling to those of a block; its rotations are gathered anew.

    A sweep of its own, which laminates without this stiffness skip.
    """
    state, corner = shells.state, shells.corner
    gather(block, nodes, shells.conn, w)
    for k in range(LANES):
        s, d, o = at + k, D + k, out + k
        axes, fibres = (warp_of(state, s), normal_of(state, s)), fibres_of(state, s)
        ab = fibre_vectors(corners(w, X + k), fibres)
        stiffness = 0.25 * laminate.drilling * state[s + ALIVE] * state[s + AREA]
        a1, b1, m1 = _corner(w, d + CORNERS[0], ab, axes, stiffness)
        a2, b2, m2 = _corner(w, d + CORNERS[1], ab, axes, stiffness)
        a3, b3, m3 = _corner(w, d + CORNERS[2], ab, axes, stiffness)
        a4, b4, m4 = _corner(w, d + CORNERS[3], ab, axes, stiffness)
        grad_a, grad_b = add(add(a1, a2), add(a3, a4)), add(add(b1, b2), add(b3, b4))
        g31, g42 = combine(fibres[0], grad_a, fibres[2], grad_b), combine(fibres[1], grad_a, fibres[3], grad_b)
        add_to_corner(corner, o + OUT[0], g31, m1)
        add_to_corner(corner, o + OUT[1], g42, m2)
        add_to_corner(corner, o + OUT[2], scale(-1.0, g31), m3)
        add_to_corner(corner, o + OUT[3], scale(-1.0, g42), m4)


@njit(**INLINE)
def _directors(at, state, w):
    """Replace the rotations of the corners of a block by the directors into which they turn the initial normal."""
    for k in range(LANES):
        normal = normal_of(state, at + k)
        store3(w, D + CORNERS[0] + k, LANES, rotate_vector(w, D + CORNERS[0] + k, normal))
        store3(w, D + CORNERS[1] + k, LANES, rotate_vector(w, D + CORNERS[1] + k, normal))
        store3(w, D + CORNERS[2] + k, LANES, rotate_vector(w, D + CORNERS[2] + k, normal))
        store3(w, D + CORNERS[3] + k, LANES, rotate_vector(w, D + CORNERS[3] + k, normal))


@njit(**INLINE)
def _strains(at, state, w):
    """Fibre strains and shear angle of a block."""
    for k in range(LANES):
        a, b = fibre_vectors(corners(w, X + k), fibres_of(state, at + k))
        inv_a, inv_b, sine = fibre_pair(a, b)
        w[STRAIN_A + k], w[STRAIN_B + k] = fibre_strain(a, inv_a), fibre_strain(b, inv_b)
        w[ANGLE + k] = arcsine(sine)


@njit(**INLINE)
def _middle_layer(strain, force, direction, laminate, w):
    """Tabulated force per width of the middle layer, row ``strain`` to row ``force``."""
    for k in range(LANES):
        w[force + k] = laminate.compression[direction] * min(w[strain + k], 0.0)
    for h in range(laminate.knee.shape[1]):
        knee, slope = laminate.knee[direction, h], laminate.slope[direction, h]
        for k in range(LANES):
            w[force + k] += hinge_force(w[strain + k], knee, slope)


@njit(**INLINE)
def _shear(at, state, laminate, w):
    """Shear force of a block; the slip of its friction goes on. Returns the energy that friction took [mJ].

    Slip times force at its end: never negative, and the same however often a state is evaluated.
    """
    for k in range(LANES):
        w[SHEAR + k] = 0.0
    for h in range(laminate.shear_knee.size):  # the law is odd: that of the size, with the sign
        knee, slope = laminate.shear_knee[h], laminate.shear_slope[h]
        for k in range(LANES):
            w[SHEAR + k] += hinge_force(abs(w[ANGLE + k]), knee, slope)
    for k in range(LANES):
        w[SHEAR + k] = w[SHEAR + k] if w[ANGLE + k] >= 0.0 else -w[SHEAR + k]
    share, stick = laminate.shear_friction, laminate.shear_stick
    for k in range(LANES):
        slip = state[at + SLIP + k]
        friction = slider_force(w[ANGLE + k] - slip, stick, share * abs(w[SHEAR + k]))
        now = w[ANGLE + k] - friction / stick
        w[RUBBED + k] = state[at + ALIVE + k] * state[at + AREA + k] * friction * (now - slip)
        state[at + SLIP + k] = now
        w[SHEAR + k] = (1.0 - share) * w[SHEAR + k] + friction
    lost = 0.0
    for k in range(LANES):
        lost += w[RUBBED + k]
    return lost


@njit(**INLINE)
def _delete(at, state, laminate, w):
    """Delete elements whose membrane strain exceeds the limit of a direction; returns how many."""
    limit_a, limit_b = laminate.fail_strain[0], laminate.fail_strain[1]
    failed = 0
    for k in range(LANES):
        alive = state[at + ALIVE + k]
        strength = state[at + STRENGTH + k]
        over = max(w[STRAIN_A + k] - strength * limit_a, w[STRAIN_B + k] - strength * limit_b)
        stays = 0.0 if over > 0.0 else alive
        failed += stays != alive
        state[at + ALIVE + k] = stays
    return failed


@njit(**INLINE)
def _store_corner(corner, i, grad_x, grad_d, director):
    store3(corner, i, LANES, scale(-1.0, grad_x))
    store3(corner, i + ROW3, LANES, moment_of(grad_d, director))


@njit(**INLINE)
def _forces(at, out, state, laminate, corner, w):
    """Corner forces and moments of a block: minus the gradient of the energy."""
    for k in range(LANES):
        s = at + k
        x, d, fibres, distortion = corners(w, X + k), corners(w, D + k), fibres_of(state, s), distortion_of(state, s)
        alive, (hold_a, hold_b) = state[s + ALIVE], hold_of(state, s, laminate)
        area, shape = alive * state[s + AREA], alive * state[s + SHAPE]
        hold_d, hold_edge = shape * laminate.hourglass_bending, shape * laminate.hourglass_transverse
        frame = fibre_frame(x, d, fibres)
        strains, middle = (w[STRAIN_A + k], w[STRAIN_B + k]), (w[MIDDLE_A + k], w[MIDDLE_B + k])
        stiffness = (laminate.layer_offset, laminate.outer[0], laminate.outer[1], laminate.twist)
        grad_a, grad_b, grad_az, grad_bz = laminate_gradients(frame, area, strains, middle, w[SHEAR + k], stiffness)
        grad_x, add_a, add_b = hourglass_gradients(frame, hourglass(x, distortion), (alive * hold_a, alive * hold_b))
        grad_d, add_az, add_bz = hourglass_gradients(frame, hourglass(d, distortion), (hold_d, hold_d))
        grad_a, grad_b = add(grad_a, add(add_a, add_az)), add(grad_b, add(add_b, add_bz))
        f = spread(grad_a, grad_b, grad_x, fibres, distortion)
        g = spread(grad_az, grad_bz, grad_d, fibres, distortion)
        shear_a, shear_b, along, across = transverse_shears(x, d, fibres, state[s + WARP])
        forces = (
            area * laminate.transverse[0] * shear_a,
            area * laminate.transverse[1] * shear_b,
            hold_edge * along,
            hold_edge * across,
        )
        ft, gt = transverse_gradients(x, d, fibres, forces)
        _store_corner(corner, out + OUT[0] + k, add(f[0], ft[0]), add(g[0], gt[0]), d[0])
        _store_corner(corner, out + OUT[1] + k, add(f[1], ft[1]), add(g[1], gt[1]), d[1])
        _store_corner(corner, out + OUT[2] + k, add(f[2], ft[2]), add(g[2], gt[2]), d[2])
        _store_corner(corner, out + OUT[3] + k, add(f[3], ft[3]), add(g[3], gt[3]), d[3])


@njit(**INLINE)
def _couple_membrane(laminate, w):
    """Add to the force of each direction what the strain of the other does."""
    coupling = laminate.coupling_membrane
    for k in range(LANES):
        w[MIDDLE_A + k] += coupling * w[STRAIN_B + k]
        w[MIDDLE_B + k] += coupling * w[STRAIN_A + k]


@njit(**INLINE)
def _membrane(energy, laminate, w):
    """Forces of the middle layer; ``energy`` is that of a law of two strains, None in laminates without one."""
    if energy is None:
        _middle_layer(STRAIN_A, MIDDLE_A, 0, laminate, w)
        _middle_layer(STRAIN_B, MIDDLE_B, 1, laminate, w)
        if laminate.coupling_membrane != 0.0:
            _couple_membrane(laminate, w)
    else:
        twice_a, twice_b = 2.0 * laminate.outer[0], 2.0 * laminate.outer[1]
        for k in range(LANES):
            force_a, force_b = biaxial_forces(laminate, w[STRAIN_A + k], w[STRAIN_B + k])
            w[MIDDLE_A + k] = force_a - twice_a * w[STRAIN_A + k]
            w[MIDDLE_B + k] = force_b - twice_b * w[STRAIN_B + k]


@njit(**INLINE)
def _couple_bending(at, out, state, laminate, corner, w):
    """Add what the bend of one direction does to the moment of the other: a sweep that uncoupled laminates skip."""
    for k in range(LANES):
        s = at + k
        x, d, fibres, distortion = corners(w, X + k), corners(w, D + k), fibres_of(state, s), distortion_of(state, s)
        stiffness = state[s + ALIVE] * state[s + AREA] * laminate.coupling_bending
        grad_a, grad_b, grad_az, grad_bz = coupling_gradients(fibre_frame(x, d, fibres), stiffness)
        none = (0.0, 0.0, 0.0)
        f, g = spread(grad_a, grad_b, none, fibres, distortion), spread(grad_az, grad_bz, none, fibres, distortion)
        add_to_corner(corner, out + OUT[0] + k, scale(-1.0, f[0]), moment_of(g[0], d[0]))
        add_to_corner(corner, out + OUT[1] + k, scale(-1.0, f[1]), moment_of(g[1], d[1]))
        add_to_corner(corner, out + OUT[2] + k, scale(-1.0, f[2]), moment_of(g[2], d[2]))
        add_to_corner(corner, out + OUT[3] + k, scale(-1.0, f[3]), moment_of(g[3], d[3]))


@njit(**PART)
def _erode(block, time, nodes, shells, laminate):
    """Stamp newly failed elements of a block with the time; returns their lost energy [mJ]."""
    lost = 0.0
    for e in range(block * BLOCK, (block + 1) * BLOCK):
        if shells.fail_time[e] == np.inf and shells.state[state_index(e) + ALIVE] == 0.0:
            shells.fail_time[e] = time
            internal, control = element_energy(e, nodes, shells, laminate)
            lost += internal + control
    return lost


@njit(**KERNEL)
def shell_forces(block_start, block_stop, time, nodes, shells, laminate, w):
    """Corner forces and moments of the blocks from block_start up to block_stop at ``time`` [ms].

    Positions and rotations in, ``shells.corner`` out; elements beyond the fracture strain are deleted. Blocks are
    independent of each other. ``w`` is work space of ``SCRATCH`` numbers. Returns the energy of deleted elements and
    that which shear friction took [mJ].
    """
    lost, rubbed = 0.0, 0.0
    for block in range(block_start, block_stop):
        at, out = U(block) * U(STATE_ROWS * BLOCK), U(block) * U(CORNER_ROWS * BLOCK)
        gather(block, nodes, shells.conn, w)
        _directors(at, shells.state, w)
        _strains(at, shells.state, w)
        if _delete(at, shells.state, laminate, w) > 0:
            lost += _erode(block, time, nodes, shells, laminate)
        _membrane(laminate.energy, laminate, w)
        rubbed += _shear(at, shells.state, laminate, w)
        _forces(at, out, shells.state, laminate, shells.corner, w)
        if laminate.coupling_bending != 0.0:
            _couple_bending(at, out, shells.state, laminate, shells.corner, w)
        if laminate.drilling != 0.0:
            add_drilling(block, at, out, nodes, shells, laminate, w)
    return lost, rubbed


@njit(**KERNEL)
def gather_shells(node_start, node_stop, nodes, shells):
    """Add the corner forces and moments of the shells to nodes node_start up to node_stop, in a fixed order."""
    corner = shells.corner
    fx, fy, fz = rows3(nodes.force)
    mx, my, mz = rows3(nodes.moment)
    for n in range(node_start, node_stop):
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for i in range(shells.node_start[n], shells.node_start[n + 1]):
            e = U(shells.node_entry[i])
            force = add(force, load3(corner, e, LANES))
            moment = add(moment, load3(corner, e + ROW3, LANES))
        fx[n] += force[0]
        fy[n] += force[1]
        fz[n] += force[2]
        mx[n] += moment[0]
        my[n] += moment[1]
        mz[n] += moment[2]
