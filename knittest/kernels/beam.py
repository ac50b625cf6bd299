"""Geometrically exact one-point beam with large rotations and a cross-section integration rule, and its sweep over
blocks.

Hughes & Liu (1981) in the resultant form of Reissner (1981) and Simo & Vu-Quoc (1986): strains are measured in the mean
frame of the two nodal rotations, the section rule enters through EA, EI, GJ and GA. Each element stores its initial
tangent, so natural curvature costs nothing, and the normal of a flat section, about which it bends with another EI.
Forces are the exact gradient of the stored energy.
"""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.laws import hinge_energy, hinge_force
from knittest.kernels.vec import INLINE, KERNEL, ONE, PART, U, at3, cross, rows3, rows4, scale, sub


@njit(**INLINE)
def mean_frame(q1w, q1x, q1y, q1z, q2w, q2x, q2y, q2z, dx, dy, dz):
    """Axis of the mean rotation of two nodes and curvature vector times length.

    ``q1``, ``q2`` are nodal rotations, ``d`` the initial unit tangent. Returns the rotated tangent (3), the curvature
    8 vec(q2 q1*) / |q1 + q2|^2 (3) and 1 / |q1 + q2|^2.
    """
    w, x, y, z = q1w + q2w, q1x + q2x, q1y + q2y, q1z + q2z
    xyz2 = x * x + y * y + z * z
    inv = 1.0 / (w * w + xyz2)
    along = 2.0 * inv * (x * dx + y * dy + z * dz)
    stretch = (w * w - xyz2) * inv
    turn = 2.0 * inv * w
    ax = stretch * dx + along * x + turn * (y * dz - z * dy)
    ay = stretch * dy + along * y + turn * (z * dx - x * dz)
    az = stretch * dz + along * z + turn * (x * dy - y * dx)
    eight = 8.0 * inv
    cx = eight * (q1w * q2x - q2w * q1x - (q2y * q1z - q2z * q1y))
    cy = eight * (q1w * q2y - q2w * q1y - (q2z * q1x - q2x * q1z))
    cz = eight * (q1w * q2z - q2w * q1z - (q2x * q1y - q2y * q1x))
    return ax, ay, az, cx, cy, cz, inv


@njit(**INLINE)
def axial_strain(ax, ay, az, rx, ry, rz, inv_length):
    """Engineering strain of the chord ``r`` along the axis ``a`` [-]."""
    return (ax * rx + ay * ry + az * rz) * inv_length - 1.0


@njit(**INLINE)
def section_force(axial, strain, shear, ax, ay, az, rx, ry, rz, inv_length):
    """Force [N] on node 1: axial force along the axis plus GA times the transverse part of the chord."""
    across = shear * inv_length
    along = axial - shear * (strain + 1.0)
    return across * rx + along * ax, across * ry + along * ay, across * rz + along * az


@njit(**INLINE)
def section_moment(torsion, bending, inv, inv_length, ax, ay, az, cx, cy, cz, tx, ty, tz):
    """Moment [N mm] of bending and torsion in the mean frame; ``t`` is chord x force, ``c`` the curvature vector."""
    factor = 4.0 * inv * inv_length
    bend = factor * bending
    twist = factor * (torsion - bending) * (cx * ax + cy * ay + cz * az)
    mx = bend * cx + twist * ax + 0.125 * (ty * cz - tz * cy)
    my = bend * cy + twist * ay + 0.125 * (tz * cx - tx * cz)
    mz = bend * cz + twist * az + 0.125 * (tx * cy - ty * cx)
    return mx, my, mz


@njit(**INLINE)
def elastic_energy(stretching, strain, shear, torsion, bending, ax, ay, az, rx, ry, rz, cx, cy, cz, inv_length):
    """Energies [mJ] of one element: of stretching, of bending with the transverse shear that it needs, of torsion.

    ``stretching`` is the integral of the axial law per length [N].
    """
    length = 1.0 / inv_length
    gx, gy, gz = rx * inv_length, ry * inv_length, rz * inv_length
    across = gx * gx + gy * gy + gz * gz - (strain + 1.0) * (strain + 1.0)
    curvature2 = cx * cx + cy * cy + cz * cz
    twist = cx * ax + cy * ay + cz * az
    bent = 0.5 * (shear * across * length + bending * (curvature2 - twist * twist) * inv_length)
    return length * stretching, bent, 0.5 * torsion * twist * twist * inv_length


@njit(**INLINE)
def flat_moment(excess, inv, inv_length, nx, ny, nz, cx, cy, cz):
    """Moment [N mm] that a section adds which is stiffer by ``excess`` [N mm^2] in bending about its normal ``n``.

    In the mean frame the curvature ``c`` changes by 4 / |q1 + q2|^2 times the turn of the nodes against each other.
    """
    moment = 4.0 * inv * inv_length * excess * (cx * nx + cy * ny + cz * nz)
    return moment * nx, moment * ny, moment * nz


@njit(**INLINE)
def flat_energy(excess, nx, ny, nz, cx, cy, cz, inv_length):
    """Energy [mJ] of :func:`flat_moment`."""
    about = cx * nx + cy * ny + cz * nz
    return 0.5 * excess * about * about * inv_length


@njit(**INLINE)
def quaternion_step(qw, qx, qy, qz, ax, ay, az):
    """Rotate ``q`` by the small global rotation vector 2 ``a``; one Newton step keeps the norm at 1."""
    nw = qw - ax * qx - ay * qy - az * qz
    nx = qx + ax * qw + ay * qz - az * qy
    ny = qy + ay * qw + az * qx - ax * qz
    nz = qz + az * qw + ax * qy - ay * qx
    scale = 1.5 - 0.5 * (nw * nw + nx * nx + ny * ny + nz * nz)
    return nw * scale, nx * scale, ny * scale, nz * scale


def rotary_inertia_factor(axial: float, shear: float, torsion: float, bending: float, length: float) -> float:
    """Factor alpha of the nodal rotary inertia alpha m L^2 that keeps rotations from governing the step.

    Stiffnesses EA, GA [N], GJ, EI [N mm^2], element length [mm]; from the eigenvalues of the one-point element: with
    g = GA/EA, alpha >= max(g / (4 (1 - g)), EI / (EA L^2), GJ / (EA L^2)), and never below 1/8.
    """
    g = min(shear / axial, 0.9)
    return max(0.125, 1.05 * g / (4.0 * (1.0 - g)), bending / (axial * length**2), torsion / (axial * length**2))


def wave_speed(axial: float, mass_per_length: float) -> float:
    """Bar wave speed [mm/ms] from EA [N] and mass per length [g/mm]."""
    return sqrt(axial / mass_per_length)


# Beam forces and time integration, fused block by block so that a block's data stay in the first-level cache.
#
# Only this part works in blocks. Scratch is one flat array with compile-time strides: separate arrays would
# cost LLVM's alias checks and the vectorisation with them. Column k + 1 of a force row is element ``start + k``, column
# 0 the last element of the block before, so a node's sum is a difference of neighbours and nothing is scattered.

BLOCK = 192
STRIDE = np.uintp(BLOCK + 16)
# rows of the scratch: element force (3), moment on node 1 and 2 (3 + 3), then axial force beyond the first hinge, and
# whether the element stays alive
FX, FY, FZ = (np.uintp(STRIDE * k) for k in range(3))
AX, AY, AZ = (np.uintp(STRIDE * k) for k in range(3, 6))
BX, BY, BZ = (np.uintp(STRIDE * k) for k in range(6, 9))
MORE, STAYS = (np.uintp(STRIDE * k) for k in range(9, 11))
FORCE_ROWS = 9
SCRATCH = int(STRIDE) * 11  # size of the flat scratch


@njit(**INLINE)
def _frame(i, rotation, direction):
    """Axis, curvature and factor of :func:`mean_frame` of beam ``i``, whose ``direction`` turns with its nodes."""
    dx, dy, dz = at3(direction, i)
    qw, qx, qy, qz = rotation
    j = i + ONE
    return mean_frame(qw[i], qx[i], qy[i], qz[i], qw[j], qx[j], qy[j], qz[j], dx, dy, dz)


@njit(**INLINE)
def _more_hinges(start, count, nodes, beams, section, w):
    """Axial force of the hinges after the first: a sweep that laws of one hinge skip."""
    x, rotation, tangent = rows3(nodes.position), rows4(nodes.rotation), rows3(beams.tangent)
    for k in range(U(count)):
        i = U(start) + k
        ax, ay, az, _, _, _, _ = _frame(i, rotation, tangent)
        rx, ry, rz = sub(at3(x, i + ONE), at3(x, i))
        over = axial_strain(ax, ay, az, rx, ry, rz, beams.inv_length[i]) - beams.slack[i]
        w[STAYS + k], w[MORE + k] = over, 0.0
    for h in range(1, beams.hinge_strain.shape[1]):
        knee, slope = beams.hinge_strain[section, h], beams.hinge_slope[section, h]
        for k in range(U(count)):
            w[MORE + k] += hinge_force(w[STAYS + k], knee, slope)


@njit(**INLINE)
def _forces(start, count, nodes, beams, section, w):
    """Forces and moments of a block of beams in one sweep; returns how many fail now, which is kept in the scratch."""
    x, rotation, tangent = rows3(nodes.position), rows4(nodes.rotation), rows3(beams.tangent)
    compression, shear, torsion, bending = rows4(beams.stiffness[section])
    knee, slope = beams.hinge_strain[section, 0], beams.hinge_slope[section, 0]
    failed = 0  # an integer: a sum of floating-point numbers in their order would keep the loop from vectorising
    for k in range(U(count)):
        i = U(start) + k
        ax, ay, az, cx, cy, cz, inv = _frame(i, rotation, tangent)
        rx, ry, rz = sub(at3(x, i + ONE), at3(x, i))
        inv_length, alive = beams.inv_length[i], beams.alive[i]
        strain = axial_strain(ax, ay, az, rx, ry, rz, inv_length)
        over = strain - beams.slack[i]
        axial = compression * min(strain, 0.0) + hinge_force(over, knee, slope) + w[MORE + k]
        stays = alive if over < beams.fail_strain[i] else 0.0
        failed += stays != alive
        nx, ny, nz = scale(stays, section_force(axial, strain, shear, ax, ay, az, rx, ry, rz, inv_length))
        tx, ty, tz = cross((rx, ry, rz), (nx, ny, nz))
        # of one that fails no stiffness is left, nor a force in t
        mx, my, mz = section_moment(
            torsion, bending, inv, stays * inv_length, ax, ay, az, cx, cy, cz, tx, ty, tz
        )  # fmt: skip
        m = k + ONE
        w[FX + m], w[FY + m], w[FZ + m] = nx, ny, nz
        w[AX + m], w[AY + m], w[AZ + m] = mx + 0.5 * tx, my + 0.5 * ty, mz + 0.5 * tz
        w[BX + m], w[BY + m], w[BZ + m] = mx - 0.5 * tx, my - 0.5 * ty, mz - 0.5 * tz
        w[STAYS + k] = stays
    return failed


@njit(**INLINE)
def _flat_moments(start, count, nodes, beams, excess, w):
    """Add the moments of sections that are stiffer by ``excess`` about their normal; a sweep that round ones skip."""
    rotation, normal = rows4(nodes.rotation), rows3(beams.normal)
    for k in range(U(count)):
        i = U(start) + k
        nx, ny, nz, cx, cy, cz, inv = _frame(i, rotation, normal)
        mx, my, mz = flat_moment(beams.alive[i] * excess, inv, beams.inv_length[i], nx, ny, nz, cx, cy, cz)
        m = k + ONE
        w[AX + m], w[AY + m], w[AZ + m] = w[AX + m] + mx, w[AY + m] + my, w[AZ + m] + mz
        w[BX + m], w[BY + m], w[BZ + m] = w[BX + m] + mx, w[BY + m] + my, w[BZ + m] + mz


@njit(**INLINE)
def _translate_along(start, count, dt, nodes, rows, w, row):
    """Velocities and positions of one axis, of which ``rows`` are position, velocity and force."""
    x, v, f = rows
    for k in range(U(count)):
        i = U(start) + k
        force = f[i] + w[row + k + ONE] - w[row + k]
        velocity = v[i] * nodes.damping_factor[i] + nodes.inv_mass[i] * force * dt
        f[i], v[i] = force, velocity
        x[i] += dt * velocity


@njit(**INLINE)
def _translate(start, count, dt, nodes, w):
    """Velocities and positions; leaves the total force of each node in nodes.force."""
    x, v, f = nodes.position, nodes.velocity, nodes.force
    _translate_along(start, count, dt, nodes, (x[0], v[0], f[0]), w, FX)
    _translate_along(start, count, dt, nodes, (x[1], v[1], f[1]), w, FY)
    _translate_along(start, count, dt, nodes, (x[2], v[2], f[2]), w, FZ)


@njit(**INLINE)
def _spin(start, count, dt, nodes, w):
    """Angular velocities of nodes that carry beams, from the moments in the scratch and those of contacts."""
    wx_, wy_, wz_ = rows3(nodes.spin)
    mx_, my_, mz_ = rows3(nodes.moment)
    for k in range(U(count)):
        i = U(start) + k
        factor = nodes.inv_inertia[i] * dt
        wx_[i] = wx_[i] * nodes.damping_factor[i] + factor * (w[AX + k + ONE] - w[BX + k] + mx_[i])
        wy_[i] = wy_[i] * nodes.damping_factor[i] + factor * (w[AY + k + ONE] - w[BY + k] + my_[i])
        wz_[i] = wz_[i] * nodes.damping_factor[i] + factor * (w[AZ + k + ONE] - w[BZ + k] + mz_[i])


@njit(**INLINE)
def _spin_free(start, count, dt, nodes):
    """Angular velocities of nodes without beams, from nodes.moment."""
    wx_, wy_, wz_ = rows3(nodes.spin)
    mx_, my_, mz_ = rows3(nodes.moment)
    for k in range(U(count)):
        i = U(start) + k
        factor = nodes.inv_inertia[i] * dt
        wx_[i] = wx_[i] * nodes.damping_factor[i] + factor * mx_[i]
        wy_[i] = wy_[i] * nodes.damping_factor[i] + factor * my_[i]
        wz_[i] = wz_[i] * nodes.damping_factor[i] + factor * mz_[i]


@njit(**INLINE)
def _rotate(start, count, dt, nodes):
    qw_, qx_, qy_, qz_ = rows4(nodes.rotation)
    wx_, wy_, wz_ = rows3(nodes.spin)
    half = 0.5 * dt
    for k in range(U(count)):
        i = U(start) + k
        qw, qx, qy, qz = quaternion_step(
            qw_[i], qx_[i], qy_[i], qz_[i], half * wx_[i], half * wy_[i], half * wz_[i]
        )  # fmt: skip
        qw_[i], qx_[i], qy_[i], qz_[i] = qw, qx, qy, qz


@njit(**PART)
def beam_energies(i, section, nodes, beams):
    """Elastic energies [mJ] of beam ``i``, whether alive or not, as in :func:`elastic_energy`."""
    x, rotation = rows3(nodes.position), rows4(nodes.rotation)
    ax, ay, az, cx, cy, cz, _ = _frame(i, rotation, rows3(beams.tangent))
    rx, ry, rz = sub(at3(x, i + ONE), at3(x, i))
    compression, shear, torsion, bending = rows4(beams.stiffness[section])
    inv_length = beams.inv_length[i]
    strain = axial_strain(ax, ay, az, rx, ry, rz, inv_length)
    stretching = 0.5 * compression * min(strain, 0.0) ** 2
    for h in range(beams.hinge_strain.shape[1]):
        stretching += hinge_energy(
            strain - beams.slack[i], beams.hinge_strain[section, h], beams.hinge_slope[section, h]
        )
    stretched, bent, twisted = elastic_energy(
        stretching, strain, shear, torsion, bending,
        ax, ay, az, rx, ry, rz, cx, cy, cz, inv_length,
    )  # fmt: skip
    excess = beams.excess[section]
    if excess != 0.0:
        nx, ny, nz, _, _, _, _ = _frame(i, rotation, rows3(beams.normal))
        bent += flat_energy(excess, nx, ny, nz, cx, cy, cz, inv_length)
    return stretched, bent, twisted


@njit(**PART)
def beam_energy(i, section, nodes, beams):
    """Elastic energy [mJ] of beam ``i``, whether alive or not."""
    stretched, bent, twisted = beam_energies(i, section, nodes, beams)
    return stretched + bent + twisted


@njit(**PART)
def _erode(start, count, section, time, nodes, beams, w):
    """Stamp newly failed elements of a block with the time; returns their lost energy [mJ]."""
    lost = 0.0
    for k in range(U(count)):
        i = U(start) + k
        beams.alive[i] = w[STAYS + k]
        if beams.alive[i] == 0.0 and beams.fail_time[i] == np.inf:
            beams.fail_time[i] = time
            lost += beam_energy(i, section, nodes, beams)
    return lost


@njit(**KERNEL)
def advance_beams(start, stop, section, time, dt, nodes, beams, w):
    """One step of nodes start..stop, which hold whole chains of one section; returns eroded energy [mJ].

    On entry nodes.force holds the forces from contacts and loads, nodes.moment the moments of contacts; on return
    nodes.force holds the totals.
    """
    lost = 0.0
    for row in range(FORCE_ROWS):
        w[U(row) * STRIDE] = 0.0
    for k in range(U(BLOCK)):
        w[MORE + k] = 0.0
    block = start
    while block < stop:
        count = min(BLOCK, stop - block)
        if beams.hinge_strain.shape[1] > 1:
            _more_hinges(block, count, nodes, beams, section, w)
        if _forces(block, count, nodes, beams, section, w) > 0:
            lost += _erode(block, count, section, time, nodes, beams, w)
        if beams.excess[section] != 0.0:
            _flat_moments(block, count, nodes, beams, beams.excess[section], w)
        _translate(block, count, dt, nodes, w)
        _spin(block, count, dt, nodes, w)
        _rotate(block, count, dt, nodes)
        for row in range(FORCE_ROWS):
            w[U(row) * STRIDE] = w[U(row) * STRIDE + U(count)]
        block += count
    return lost


@njit(**PART)
def advance_free(start, stop, dt, nodes, w):
    """One step of nodes start..stop that carry no beams."""
    for row in range(FORCE_ROWS):
        for k in range(BLOCK + 1):
            w[U(row) * STRIDE + U(k)] = 0.0
    block = start
    while block < stop:
        count = min(BLOCK, stop - block)
        _translate(block, count, dt, nodes, w)
        _spin_free(block, count, dt, nodes)
        _rotate(block, count, dt, nodes)
        block += count
