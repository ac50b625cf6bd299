"""Geometrically exact one-point beam with large rotations and a cross-section integration rule.

Hughes & Liu (1981) in the resultant form of Reissner (1981) and Simo & Vu-Quoc (1986): strains are measured in the mean
frame of the two nodal rotations, the section rule enters through EA, EI, GJ and GA. Each element stores its initial
tangent, so natural curvature costs nothing, and the normal of a flat section, about which it bends with another EI.
Forces are the exact gradient of the stored energy.
"""

from math import sqrt

from numba import njit

from knittest.kernels.options import INLINE


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
