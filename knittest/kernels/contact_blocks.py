"""Blocked evaluation of tracked contacts: scalar gather, vectorised physics, scalar store; then scatter by owner.

Forces are first stored by contact, then every partition adds those on its own chains in the fixed order of
``Contacts.half``: no races and the same bits at any thread count.
"""

import numpy as np
from numba import njit

from knittest.kernels.contact import closest_step, contact_force, spline_weights
from knittest.kernels.options import INLINE, KERNEL, U
from knittest.kernels.rows import rows3

BLOCK = 128
#: closest-point steps a time step: a contact that lags behind the closest points makes energy out of friction
NEWTON_STEPS = 2
# rows of the scratch: control points of A and B (9 + 9), parameters, line flag, reach, spring, offset, force, loss by
# friction, slipping, turn of the touching surfaces, loss by damping
P = tuple(np.uintp(BLOCK * k) for k in range(18))
S, T, LINE, REACH = (np.uintp(BLOCK * k) for k in range(18, 22))
EX, EY, EZ = (np.uintp(BLOCK * k) for k in range(22, 25))
GX, GY, GZ = (np.uintp(BLOCK * k) for k in range(25, 28))
PX, PY, PZ = (np.uintp(BLOCK * k) for k in range(28, 31))
LOST, SLIPPING = np.uintp(BLOCK * 31), np.uintp(BLOCK * 32)
TURN_X, TURN_Y, TURN_Z = (np.uintp(BLOCK * k) for k in range(33, 36))
DAMPED = np.uintp(BLOCK * 36)
SCRATCH = BLOCK * 37
P0, P1, P2, P3, P4, P5, P6, P7, P8 = P[:9]
R0, R1, R2, R3, R4, R5, R6, R7, R8 = P[9:]


@njit(**KERNEL)
def walk(first, last, contacts, alive):
    """Move contacts whose parameter left [0, 1) to the neighbouring piece of the same yarn.

    Piece i spans elements i - 1 and i, so it exists where both are alive; at a yarn's end or break a contact stays,
    with a parameter outside [0, 1), where it carries force for half an element more.
    """
    piece, parameter = contacts.piece, contacts.parameter
    for c in range(first, last):
        for side in range(2):
            i, s = piece[side, c], parameter[side, c]
            if s >= 1.0 and alive[i] > 0.0 and alive[i + 1] > 0.0:
                piece[side, c], parameter[side, c] = i + 1, s - 1.0
            elif s < 0.0 and i >= 2 and alive[i - 1] > 0.0 and alive[i - 2] > 0.0:
                piece[side, c], parameter[side, c] = i - 1, s + 1.0


@njit(**INLINE)
def _turn(i, parameter, share, wx, wy, wz):
    """``share`` of the spin (3) of piece ``i`` at ``parameter``."""
    before, at, after = spline_weights(parameter)
    return (
        share * (before * wx[i - 1] + at * wx[i] + after * wx[i + 1]),
        share * (before * wy[i - 1] + at * wy[i] + after * wy[i + 1]),
        share * (before * wz[i - 1] + at * wz[i] + after * wz[i + 1]),
    )


@njit(**INLINE)
def _gather(first, count, dt, nodes, contacts, alive, w):
    x, y, z = rows3(nodes.position)
    ex, ey, ez = rows3(contacts.spring)
    gx, gy, gz = rows3(contacts.offset)
    fx, fy, fz = rows3(contacts.force)
    wx, wy, wz = rows3(nodes.spin)
    for k in range(count):
        c, m = first + k, U(k)
        i, j = contacts.piece[0, c], contacts.piece[1, c]
        w[P0 + m], w[P1 + m], w[P2 + m] = x[i - 1], y[i - 1], z[i - 1]
        w[P3 + m], w[P4 + m], w[P5 + m] = x[i], y[i], z[i]
        w[P6 + m], w[P7 + m], w[P8 + m] = x[i + 1], y[i + 1], z[i + 1]
        w[R0 + m], w[R1 + m], w[R2 + m] = x[j - 1], y[j - 1], z[j - 1]
        w[R3 + m], w[R4 + m], w[R5 + m] = x[j], y[j], z[j]
        w[R6 + m], w[R7 + m], w[R8 + m] = x[j + 1], y[j + 1], z[j + 1]
        s, t = contacts.parameter[0, c], contacts.parameter[1, c]
        w[S + m], w[T + m] = s, t
        # a piece with a broken element does not touch
        whole = alive[i - 1] * alive[i] * alive[j - 1] * alive[j]
        w[LINE + m], w[REACH + m] = contacts.line[c], contacts.reach[c] * whole
        w[EX + m], w[EY + m], w[EZ + m], w[SLIPPING + m] = ex[c], ey[c], ez[c], contacts.slipping[c]
        w[GX + m], w[GY + m], w[GZ + m] = gx[c], gy[c], gz[c]
        # both surfaces turn, by their arms; none do where nothing touched
        touched = dt if (fx[c] != 0.0) | (fy[c] != 0.0) | (fz[c] != 0.0) else 0.0
        ax, ay, az = _turn(i, s, touched * contacts.arm[c], wx, wy, wz)
        bx, by, bz = _turn(j, t, touched * (1.0 - contacts.arm[c]), wx, wy, wz)
        w[TURN_X + m], w[TURN_Y + m], w[TURN_Z + m] = ax + bx, ay + by, az + bz


@njit(**INLINE)
def _evaluate(count, law, inv_dt, w):
    for m in range(U(count)):
        # spline coefficients: c(s) = c0 + s (c1 + s c2)
        ux1, uy1, uz1 = w[P3 + m] - w[P0 + m], w[P4 + m] - w[P1 + m], w[P5 + m] - w[P2 + m]
        vx1, vy1, vz1 = w[R3 + m] - w[R0 + m], w[R4 + m] - w[R1 + m], w[R5 + m] - w[R2 + m]
        ux2, uy2, uz2 = (
            0.5 * (w[P6 + m] - w[P3 + m] - ux1),
            0.5 * (w[P7 + m] - w[P4 + m] - uy1),
            0.5 * (w[P8 + m] - w[P5 + m] - uz1),
        )
        vx2, vy2, vz2 = (
            0.5 * (w[R6 + m] - w[R3 + m] - vx1),
            0.5 * (w[R7 + m] - w[R4 + m] - vy1),
            0.5 * (w[R8 + m] - w[R5 + m] - vz1),
        )
        cx = 0.5 * (w[P0 + m] + w[P3 + m] - w[R0 + m] - w[R3 + m])
        cy = 0.5 * (w[P1 + m] + w[P4 + m] - w[R1 + m] - w[R4 + m])
        cz = 0.5 * (w[P2 + m] + w[P5 + m] - w[R2 + m] - w[R5 + m])
        s, t = w[S + m], w[T + m]
        # offset of the same material points now: its change since the last step is the relative motion
        ox = cx + s * (ux1 + s * ux2) - t * (vx1 + t * vx2)
        oy = cy + s * (uy1 + s * uy2) - t * (vy1 + t * vy2)
        oz = cz + s * (uz1 + s * uz2) - t * (vz1 + t * vz2)
        dx, dy, dz = ox - w[GX + m], oy - w[GY + m], oz - w[GZ + m]
        gx, gy, gz = w[GX + m], w[GY + m], w[GZ + m]
        # surfaces touch at a point between the centre-lines: they turn with their yarns about its arms
        hx, hy, hz = 0.5 * (ox + w[GX + m]), 0.5 * (oy + w[GY + m]), 0.5 * (oz + w[GZ + m])
        rx, ry, rz = w[TURN_X + m], w[TURN_Y + m], w[TURN_Z + m]
        dx, dy, dz = dx - (ry * hz - rz * hy), dy - (rz * hx - rx * hz), dz - (rx * hy - ry * hx)
        ex, ey, ez = w[EX + m], w[EY + m], w[EZ + m]
        ex, ey, ez = ex + ry * ez - rz * ey, ey + rz * ex - rx * ez, ez + rx * ey - ry * ex
        closing = np.sqrt(gx * gx + gy * gy + gz * gz) - np.sqrt(ox * ox + oy * oy + oz * oz)
        gx, gy, gz = ox, oy, oz
        for _ in range(NEWTON_STEPS):
            ds, dt = closest_step(
                gx, gy, gz,
                ux1 + 2.0 * s * ux2, uy1 + 2.0 * s * uy2, uz1 + 2.0 * s * uz2,
                vx1 + 2.0 * t * vx2, vy1 + 2.0 * t * vy2, vz1 + 2.0 * t * vz2,
                2.0 * ux2, 2.0 * uy2, 2.0 * uz2, 2.0 * vx2, 2.0 * vy2, 2.0 * vz2, w[LINE + m],
            )  # fmt: skip
            s, t = s - ds, t - dt
            gx = cx + s * (ux1 + s * ux2) - t * (vx1 + t * vx2)
            gy = cy + s * (uy1 + s * uy2) - t * (vy1 + t * vy2)
            gz = cz + s * (uz1 + s * uz2) - t * (vz1 + t * vz2)
        # a contact beyond the end of its chain carries nothing
        on_yarns = 1.0 if (s > -0.5) & (s < 1.5) & (t > -0.5) & (t < 1.5) else 0.0
        # no depth that the yarns did not close themselves: closest points that jump along a hook would make energy
        depth = max(w[REACH + m] - np.sqrt(ox * ox + oy * oy + oz * oz), 0.0) * on_yarns
        w[REACH + m] = min(w[REACH + m], depth + np.sqrt(gx * gx + gy * gy + gz * gz))
        fx, fy, fz, ex, ey, ez, slips, lost, damped = contact_force(
            gx, gy, gz, closing, w[REACH + m] * on_yarns, ex, ey, ez, dx, dy, dz,
            w[SLIPPING + m], law, inv_dt,
        )  # fmt: skip
        w[S + m], w[T + m] = s, t
        w[EX + m], w[EY + m], w[EZ + m] = ex, ey, ez
        w[GX + m], w[GY + m], w[GZ + m] = gx, gy, gz
        w[PX + m], w[PY + m], w[PZ + m] = fx, fy, fz
        w[LOST + m], w[DAMPED + m], w[SLIPPING + m] = lost, damped, slips


@njit(**INLINE)
def _store(first, count, contacts, w):
    ex, ey, ez = rows3(contacts.spring)
    gx, gy, gz = rows3(contacts.offset)
    fx, fy, fz = rows3(contacts.force)
    for k in range(count):
        c, m = first + k, U(k)
        contacts.parameter[0, c], contacts.parameter[1, c] = w[S + m], w[T + m]
        contacts.reach[c] = w[REACH + m]
        ex[c], ey[c], ez[c], contacts.slipping[c] = w[EX + m], w[EY + m], w[EZ + m], w[SLIPPING + m]
        gx[c], gy[c], gz[c] = w[GX + m], w[GY + m], w[GZ + m]
        fx[c], fy[c], fz[c] = w[PX + m], w[PY + m], w[PZ + m]


@njit(**KERNEL)
def contact_forces(first, last, dt, nodes, contacts, alive, law, w):
    """Evaluate contacts first..last; returns the energies lost to friction and to contact damping [mJ]."""
    walk(first, last, contacts, alive)
    lost, damped = 0.0, 0.0
    block = first
    while block < last:
        count = min(BLOCK, last - block)
        _gather(block, count, dt, nodes, contacts, alive, w)
        _evaluate(count, law, 1.0 / dt, w)
        _store(block, count, contacts, w)
        for k in range(count):
            lost += w[LOST + U(k)]
            damped += w[DAMPED + U(k)]
        block += count
    return lost, damped


@njit(**INLINE)
def _add(row, i, before, at, after, value):
    row[i - 1] += before * value
    row[i] += at * value
    row[i + 1] += after * value


@njit(**KERNEL)
def scatter_contacts(partition, nodes, contacts):
    """Add the contact forces on the chains of one partition, and their moments about the centre-lines, to the nodes."""
    fx, fy, fz = rows3(nodes.force)
    mx, my, mz = rows3(nodes.moment)
    px, py, pz = rows3(contacts.force)
    gx, gy, gz = rows3(contacts.offset)
    for h in range(contacts.half_start[partition], contacts.half_start[partition + 1]):
        c, side = contacts.half[h] >> 1, contacts.half[h] & 1
        x, y, z = px[c], py[c], pz[c]
        if x == 0.0 and y == 0.0 and z == 0.0:
            continue
        i = contacts.piece[side, c]
        before, at, after = spline_weights(contacts.parameter[side, c])
        sign = 1.0 - 2.0 * side
        _add(fx, i, before, at, after, sign * x)
        _add(fy, i, before, at, after, sign * y)
        _add(fz, i, before, at, after, sign * z)
        # arm x force: arms point from either centre-line to the common point, so the signs cancel
        arm = contacts.arm[c] if side == 0 else 1.0 - contacts.arm[c]
        _add(mx, i, before, at, after, arm * (y * gz[c] - z * gy[c]))
        _add(my, i, before, at, after, arm * (z * gx[c] - x * gz[c]))
        _add(mz, i, before, at, after, arm * (x * gy[c] - y * gx[c]))
