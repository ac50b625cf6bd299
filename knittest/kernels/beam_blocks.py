"""Beam forces and time integration, fused block by block so that a block's data stay in the first-level cache.

The only place that knows about blocking. Scratch is one flat array with compile-time strides: separate arrays would
cost LLVM's alias checks and the vectorisation with them. Column k + 1 of a force row is element ``start + k``, column 0
the last element of the block before, so a node's sum is a difference of neighbours and nothing is scattered.
"""

import numpy as np
from numba import njit

from knittest.kernels.beam import (
    axial_strain,
    elastic_energy,
    flat_energy,
    flat_moment,
    mean_frame,
    quaternion_step,
    section_force,
    section_moment,
)
from knittest.kernels.laws import hinge_energy, hinge_force
from knittest.kernels.options import INLINE, KERNEL, ONE, U
from knittest.kernels.rows import rows3, rows4

BLOCK = 192
STRIDE = np.uintp(BLOCK + 16)
# rows of the scratch: element force (3), moment on node 1 and 2 (3 + 3), then axis (3), curvature (3), factor, strain,
# axial force
FX, FY, FZ = (np.uintp(STRIDE * k) for k in range(3))
AX, AY, AZ = (np.uintp(STRIDE * k) for k in range(3, 6))
BX, BY, BZ = (np.uintp(STRIDE * k) for k in range(6, 9))
TX, TY, TZ = (np.uintp(STRIDE * k) for k in range(9, 12))
CX, CY, CZ = (np.uintp(STRIDE * k) for k in range(12, 15))
INV, STRAIN, AXIAL = (np.uintp(STRIDE * k) for k in range(15, 18))
FORCE_ROWS = 9
SCRATCH = int(STRIDE) * 18  # size of the flat scratch


@njit(**INLINE)
def _kinematics(start, count, nodes, beams, w):
    x, y, z = rows3(nodes.position)
    qw_, qx_, qy_, qz_ = rows4(nodes.rotation)
    dx_, dy_, dz_ = rows3(beams.tangent)
    for k in range(U(count)):
        i = U(start) + k
        j = i + ONE
        ax, ay, az, cx, cy, cz, inv = mean_frame(
            qw_[i], qx_[i], qy_[i], qz_[i], qw_[j], qx_[j], qy_[j], qz_[j],
            dx_[i], dy_[i], dz_[i],
        )  # fmt: skip
        rx, ry, rz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
        w[TX + k], w[TY + k], w[TZ + k] = ax, ay, az
        w[CX + k], w[CY + k], w[CZ + k] = cx, cy, cz
        w[INV + k] = inv
        w[STRAIN + k] = axial_strain(ax, ay, az, rx, ry, rz, beams.inv_length[i])


@njit(**INLINE)
def _axial_law(start, count, beams, section, w):
    """Axial force by hinge sums; returns how many elements failed now."""
    compression = beams.stiffness[section, 0]
    for k in range(U(count)):
        w[AXIAL + k] = compression * min(w[STRAIN + k], 0.0)
    for h in range(beams.hinge_strain.shape[1]):
        knee, slope = beams.hinge_strain[section, h], beams.hinge_slope[section, h]
        for k in range(U(count)):
            w[AXIAL + k] += hinge_force(w[STRAIN + k] - beams.slack[U(start) + k], knee, slope)
    failed = 0.0
    for k in range(U(count)):
        i = U(start) + k
        alive = beams.alive[i]
        stays = alive if w[STRAIN + k] - beams.slack[i] < beams.fail_strain[i] else 0.0
        failed += alive - stays
        beams.alive[i] = stays
    return failed


@njit(**INLINE)
def _forces(start, count, nodes, beams, section, w):
    x, y, z = rows3(nodes.position)
    _, shear, torsion, bending = rows4(beams.stiffness[section])
    for k in range(U(count)):
        i = U(start) + k
        j = i + ONE
        rx, ry, rz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
        ax, ay, az = w[TX + k], w[TY + k], w[TZ + k]
        cx, cy, cz = w[CX + k], w[CY + k], w[CZ + k]
        inv_length, alive = beams.inv_length[i], beams.alive[i]
        nx, ny, nz = section_force(w[AXIAL + k], w[STRAIN + k], shear, ax, ay, az, rx, ry, rz, inv_length)
        tx, ty, tz = ry * nz - rz * ny, rz * nx - rx * nz, rx * ny - ry * nx
        mx, my, mz = section_moment(torsion, bending, w[INV + k], inv_length, ax, ay, az, cx, cy, cz, tx, ty, tz)
        m = k + ONE
        w[FX + m], w[FY + m], w[FZ + m] = alive * nx, alive * ny, alive * nz
        w[AX + m], w[AY + m], w[AZ + m] = alive * (mx + 0.5 * tx), alive * (my + 0.5 * ty), alive * (mz + 0.5 * tz)
        w[BX + m], w[BY + m], w[BZ + m] = alive * (mx - 0.5 * tx), alive * (my - 0.5 * ty), alive * (mz - 0.5 * tz)


@njit(**INLINE)
def _flat_moments(start, count, nodes, beams, excess, w):
    """Adds the moments of sections that are stiffer by ``excess`` about their normal; a sweep that round ones skip."""
    qw_, qx_, qy_, qz_ = rows4(nodes.rotation)
    dx_, dy_, dz_ = rows3(beams.normal)
    for k in range(U(count)):
        i = U(start) + k
        j = i + ONE
        nx, ny, nz, cx, cy, cz, inv = mean_frame(
            qw_[i], qx_[i], qy_[i], qz_[i], qw_[j], qx_[j], qy_[j], qz_[j],
            dx_[i], dy_[i], dz_[i],
        )  # fmt: skip
        mx, my, mz = flat_moment(beams.alive[i] * excess, inv, beams.inv_length[i], nx, ny, nz, cx, cy, cz)
        m = k + ONE
        w[AX + m], w[AY + m], w[AZ + m] = w[AX + m] + mx, w[AY + m] + my, w[AZ + m] + mz
        w[BX + m], w[BY + m], w[BZ + m] = w[BX + m] + mx, w[BY + m] + my, w[BZ + m] + mz


@njit(**INLINE)
def _translate(start, count, dt, nodes, w):
    """Velocities and positions; leaves the total force of each node in nodes.force."""
    x, y, z = rows3(nodes.position)
    vx_, vy_, vz_ = rows3(nodes.velocity)
    fx_, fy_, fz_ = rows3(nodes.force)
    for k in range(U(count)):
        i = U(start) + k
        force = fx_[i] + w[FX + k + ONE] - w[FX + k]
        velocity = vx_[i] * nodes.damping_factor[i] + nodes.inv_mass[i] * force * dt
        fx_[i], vx_[i] = force, velocity
        x[i] += dt * velocity
    for k in range(U(count)):
        i = U(start) + k
        force = fy_[i] + w[FY + k + ONE] - w[FY + k]
        velocity = vy_[i] * nodes.damping_factor[i] + nodes.inv_mass[i] * force * dt
        fy_[i], vy_[i] = force, velocity
        y[i] += dt * velocity
    for k in range(U(count)):
        i = U(start) + k
        force = fz_[i] + w[FZ + k + ONE] - w[FZ + k]
        velocity = vz_[i] * nodes.damping_factor[i] + nodes.inv_mass[i] * force * dt
        fz_[i], vz_[i] = force, velocity
        z[i] += dt * velocity


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


@njit(**KERNEL)
def beam_energy(i, section, nodes, beams):
    """Elastic energy [mJ] of beam ``i``, whether alive or not; uses :func:`elastic_energy`."""
    x, y, z = rows3(nodes.position)
    qw_, qx_, qy_, qz_ = rows4(nodes.rotation)
    dx_, dy_, dz_ = rows3(beams.tangent)
    j = i + 1
    ax, ay, az, cx, cy, cz, _ = mean_frame(
        qw_[i], qx_[i], qy_[i], qz_[i], qw_[j], qx_[j], qy_[j], qz_[j],
        dx_[i], dy_[i], dz_[i],
    )  # fmt: skip
    rx, ry, rz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
    compression, shear, torsion, bending = rows4(beams.stiffness[section])
    inv_length = beams.inv_length[i]
    strain = axial_strain(ax, ay, az, rx, ry, rz, inv_length)
    stretching = 0.5 * compression * min(strain, 0.0) ** 2
    for h in range(beams.hinge_strain.shape[1]):
        stretching += hinge_energy(
            strain - beams.slack[i], beams.hinge_strain[section, h], beams.hinge_slope[section, h]
        )
    energy = elastic_energy(
        stretching, strain, shear, torsion, bending,
        ax, ay, az, rx, ry, rz, cx, cy, cz, inv_length,
    )  # fmt: skip
    excess = beams.excess[section]
    if excess != 0.0:
        dx_, dy_, dz_ = rows3(beams.normal)
        nx, ny, nz, _, _, _, _ = mean_frame(
            qw_[i], qx_[i], qy_[i], qz_[i], qw_[j], qx_[j], qy_[j], qz_[j],
            dx_[i], dy_[i], dz_[i],
        )  # fmt: skip
        energy += flat_energy(excess, nx, ny, nz, cx, cy, cz, inv_length)
    return energy


@njit(**KERNEL)
def _erode(start, count, section, time, nodes, beams):
    """Stamp newly failed elements of a block with the time; returns their lost energy [mJ]."""
    lost = 0.0
    for i in range(start, start + count):
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
    block = start
    while block < stop:
        count = min(BLOCK, stop - block)
        _kinematics(block, count, nodes, beams, w)
        if _axial_law(block, count, beams, section, w) > 0.0:
            lost += _erode(block, count, section, time, nodes, beams)
        _forces(block, count, nodes, beams, section, w)
        if beams.excess[section] != 0.0:
            _flat_moments(block, count, nodes, beams, beams.excess[section], w)
        _translate(block, count, dt, nodes, w)
        _spin(block, count, dt, nodes, w)
        _rotate(block, count, dt, nodes)
        for row in range(FORCE_ROWS):
            w[U(row) * STRIDE] = w[U(row) * STRIDE + U(count)]
        block += count
    return lost


@njit(**KERNEL)
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
