"""Blocked evaluation of tracked contacts: scalar gather, vectorised physics, scalar store; then scatter by owner.

Forces are first stored by contact, then every partition adds those on its own chains in the fixed order of
``Contacts.half``: no races and the same bits at any thread count.
"""

import numpy as np
from numba import njit

from knittest.kernels.contact import closest_step, contact_force, spline_weights
from knittest.kernels.contact_scratch import (
    BLOCK,
    DAMPED,
    EX,
    EY,
    EZ,
    GX,
    GY,
    GZ,
    LANES,
    LINE,
    LOST,
    OVER,
    P0,
    P1,
    P2,
    P3,
    P4,
    P5,
    P6,
    P7,
    P8,
    PX,
    PY,
    PZ,
    R0,
    R1,
    R2,
    R3,
    R4,
    R5,
    R6,
    R7,
    R8,
    REACH,
    SLIPPING,
    SPUN,
    SWING_X,
    SWUNG_X,
    TURN_X,
    TURN_Y,
    TURN_Z,
    S,
    T,
    write,
    write3,
)
from knittest.kernels.flatten import squeeze, swelling
from knittest.kernels.options import INLINE, KERNEL, ONE, PART, U
from knittest.kernels.rows import at3, load3, put3, rows3, store3
from knittest.kernels.section_blocks import carry_over, section_at
from knittest.kernels.spin_blocks import give_way
from knittest.kernels.state import ContactLaw
from knittest.kernels.vec import add, combine, cross, dot, scale, sub

#: closest-point steps a time step: a contact that lags behind the closest points makes energy out of friction
NEWTON_STEPS = 2
#: coefficient of friction with which contacts stick, to give way afterwards
STICKS = 1e30


@njit(**PART)
def walk(first, last, contacts, alive):
    """Move contacts whose parameter left [0, 1) to the neighbouring piece of the same yarn.

    Piece i spans elements i - 1 and i, so it exists where both are alive; at a yarn's end or break a contact stays,
    with a parameter outside [0, 1), where it carries force for half an element more.
    """
    for side in range(2):
        piece, parameter = contacts.piece[side], contacts.parameter[side]
        for k in range(U(last - first)):
            c = U(first) + k
            i, s = U(piece[c]), parameter[c]
            if s >= 1.0:
                if alive[i] > 0.0 and alive[i + ONE] > 0.0:
                    piece[c], parameter[c] = i + ONE, s - 1.0
            elif s < 0.0 and i > ONE and alive[i - ONE] > 0.0 and alive[i - ONE - ONE] > 0.0:
                piece[c], parameter[c] = i - ONE, s + 1.0


@njit(**INLINE)
def _spin(i, parameter, spin):
    """Spin (3) of piece ``i`` at ``parameter``."""
    before, at, after = spline_weights(parameter)
    mean = combine(before, at3(spin, i - ONE), at, at3(spin, i))
    return combine(1.0, mean, after, at3(spin, i + ONE))


@njit(**INLINE)
def _swing(i, parameter, velocity):
    """Change of the velocity (3) of piece ``i`` with the parameter."""
    first, at, last = at3(velocity, i - ONE), at3(velocity, i), at3(velocity, i + ONE)
    return combine(1.0 - parameter, sub(at, first), parameter, sub(last, at))


@njit(**INLINE)
def _gather(first, count, dt, spin, oval, nodes, contacts, alive, w):
    shift, other, velocity = rows3(contacts.shift), rows3(contacts.other), rows3(nodes.velocity)
    turned, square, excess = rows3(contacts.turned), contacts.square, contacts.excess
    x, turning, spring = rows3(nodes.position), rows3(nodes.spin), rows3(contacts.spring)
    offset, force = rows3(contacts.offset), rows3(contacts.force)
    pieces, parameters = (contacts.piece[0], contacts.piece[1]), (contacts.parameter[0], contacts.parameter[1])
    for m in range(U(count)):
        c = U(first) + m
        i, j = U(pieces[0][c]), U(pieces[1][c])
        store3(w, P0 + m, LANES, at3(x, i - ONE))
        store3(w, P3 + m, LANES, at3(x, i))
        store3(w, P6 + m, LANES, at3(x, i + ONE))
        store3(w, R0 + m, LANES, at3(x, j - ONE))
        store3(w, R3 + m, LANES, at3(x, j))
        store3(w, R6 + m, LANES, at3(x, j + ONE))
        s, t = parameters[0][c], parameters[1][c]
        w[S + m], w[T + m] = s, t
        # a piece with a broken element does not touch
        whole = alive[i - ONE] * alive[i] * alive[j - ONE] * alive[j]
        w[LINE + m], w[REACH + m] = contacts.line[c], contacts.reach[c] * whole
        w[SLIPPING + m] = contacts.slipping[c]
        store3(w, EX + m, LANES, at3(spring, c))
        store3(w, GX + m, LANES, at3(offset, c))
        # both surfaces turn, by their arms; none do where nothing touched
        fx, fy, fz = at3(force, c)
        touched = dt if (fx != 0.0) | (fy != 0.0) | (fz != 0.0) else 0.0
        spin_a, spin_b = _spin(i, s, turning), _spin(j, t, turning)
        store3(w, SWING_X + m, LANES, scale(dt, _swing(i, s, velocity)))
        store3(w, SWUNG_X + m, LANES, scale(dt, _swing(j, t, velocity)))
        if oval is not None and (excess[i] != 0.0) | (excess[j] != 0.0):
            first_section = section_at(i, s, turned, square, excess)
            second_section = section_at(j, t, turned, square, excess)
            grown = swelling(i, j, s, t, first_section, second_section, at3(offset, c), contacts)
            a, b, extent, touch = carry_over(
                m, first_section, second_section, at3(shift, c), at3(other, c), contacts.touch[c], touched, grown,
                scale(touched, spin_a), scale(touched, spin_b), w,
            )  # fmt: skip
            put3(shift, c, a)
            put3(other, c, b)
            contacts.touch[c], contacts.arm[c] = touch, extent / touch
        arm = contacts.arm[c]
        store3(w, TURN_X + m, LANES, add(scale(touched * arm, spin_a), scale(touched * (1.0 - arm), spin_b)))
        if spin is not None:
            w[OVER + m] = touched * dot(sub(spin_a, spin_b), at3(offset, c))


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
        mx, my, mz = dx, dy, dz
        # surfaces touch at a point between the centre-lines: they turn with their yarns about its arms
        hx, hy, hz = 0.5 * (ox + w[GX + m]), 0.5 * (oy + w[GY + m]), 0.5 * (oz + w[GZ + m])
        rx, ry, rz = w[TURN_X + m], w[TURN_Y + m], w[TURN_Z + m]
        dx, dy, dz = dx - (ry * hz - rz * hy), dy - (rz * hx - rx * hz), dz - (rx * hy - ry * hx)
        ex, ey, ez = w[EX + m], w[EY + m], w[EZ + m]
        ex, ey, ez = ex + ry * ez - rz * ey, ey + rz * ex - rx * ez, ez + rx * ey - ry * ex
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
        # the motion half where the contact was and half where it is: what turns about it as it runs makes no energy
        ds, dt = 0.5 * (s - w[S + m]), 0.5 * (t - w[T + m])
        kx, ky, kz = combine(ds, load3(w, SWING_X + m, LANES), -dt, load3(w, SWUNG_X + m, LANES))
        mx, my, mz = mx + kx, my + ky, mz + kz
        dx, dy, dz = dx + kx, dy + ky, dz + kz
        # a contact beyond the end of its chain carries nothing
        on_yarns = 1.0 if (s > -0.5) & (s < 1.5) & (t > -0.5) & (t < 1.5) else 0.0
        # what the yarns close themselves, along the mean normal of the step: a slide is none, to third order
        far, near = np.sqrt(w[GX + m] ** 2 + w[GY + m] ** 2 + w[GZ + m] ** 2), np.sqrt(gx * gx + gy * gy + gz * gz)
        before = (mx * w[GX + m] + my * w[GY + m] + mz * w[GZ + m]) / max(far, 1e-9)
        closing = -0.5 * (before + (mx * gx + my * gy + mz * gz) / max(near, 1e-9))
        # no other depth: closest points that jump along a hook would make energy
        depth = max(w[REACH + m] - far + closing, 0.0) * on_yarns
        w[REACH + m] = min(w[REACH + m], depth + near)
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
    """Store what was evaluated, row by row, which vectorises."""
    write(first, count, w, S, contacts.parameter[0])
    write(first, count, w, T, contacts.parameter[1])
    write(first, count, w, REACH, contacts.reach)
    write(first, count, w, SLIPPING, contacts.slipping)
    write3(first, count, w, EX, rows3(contacts.spring))
    write3(first, count, w, GX, rows3(contacts.offset))
    write3(first, count, w, PX, rows3(contacts.force))


@njit(**KERNEL)
def contact_forces(share, dt, nodes, contacts, alive, law, spin, oval, w):
    """Evaluate the contacts of ``share`` (first, stop); returns the energies lost to friction, of it to that of spin,
    and to contact damping [mJ].

    Where ``spin`` is not None contacts are evaluated as if they stuck, then give way. What resists it, and what makes
    sections ``oval``, is not even compiled where it is None.
    """
    first, last = share
    walk(first, last, contacts, alive)
    sticking = law
    if spin is not None:
        sticking = ContactLaw(
            law.normal, law.tangential, STICKS, STICKS, law.viscous, law.linear, law.square, law.cubic, law.cap,
            0.0, 0.0,
        )  # fmt: skip
    lost, spun, damped = 0.0, 0.0, 0.0
    block = first
    while block < last:
        count = min(BLOCK, last - block)
        _gather(block, count, dt, spin, oval, nodes, contacts, alive, w)
        _evaluate(count, sticking, 1.0 / dt, w)
        if spin is not None:
            give_way(block, count, contacts, law, w)
        _store(block, count, contacts, w)
        for k in range(U(count)):
            counts = contacts.share[U(block) + k]
            lost += counts * w[LOST + k]
            damped += counts * w[DAMPED + k]
            if spin is not None:
                spun += counts * w[SPUN + k]
        block += count
    return lost, spun, damped


@njit(**INLINE)
def _add(rows, i, weights, vector):
    """Share ``vector`` out to the three nodes of piece ``i`` by ``weights``."""
    for k in range(3):
        row, value = rows[k], vector[k]
        row[i - ONE] += weights[0] * value
        row[i] += weights[1] * value
        row[i + ONE] += weights[2] * value


@njit(**KERNEL)
def scatter_contacts(partition, nodes, contacts):
    """Add the contact forces on the chains of one partition, and their moments about the centre-lines, to the nodes."""
    forces, moments = rows3(nodes.force), rows3(nodes.moment)
    force, offset, couple = rows3(contacts.force), rows3(contacts.offset), contacts.couple
    shift, other, elliptic = rows3(contacts.shift), rows3(contacts.other), contacts.excess.size > 0
    pieces, parameters = (contacts.piece[0], contacts.piece[1]), (contacts.parameter[0], contacts.parameter[1])
    first = U(contacts.half_start[partition])
    for k in range(U(contacts.half_start[partition + 1]) - first):
        half = contacts.half[first + k]
        c, on_second = U(half >> 1), half & 1 == 1
        f = at3(force, c)
        if f[0] == 0.0 and f[1] == 0.0 and f[2] == 0.0:
            continue
        i = U(pieces[1][c] if on_second else pieces[0][c])
        weights = spline_weights(parameters[1][c] if on_second else parameters[0][c])
        # arm x force: arms point from either centre-line to the common point, so the signs cancel
        arm = 1.0 - contacts.arm[c] if on_second else contacts.arm[c]
        _add(forces, i, weights, scale(-1.0 if on_second else 1.0, f))
        turning = scale(arm, cross(f, at3(offset, c)))
        if elliptic:
            turning = add(turning, cross(f, at3(other, c) if on_second else at3(shift, c)))
            if contacts.shape.shape[1] > 0:
                squeeze(i, parameters[1][c] if on_second else parameters[0][c], f, at3(offset, c), contacts)
        if couple[c] != 0.0:
            turning = combine(1.0, turning, couple[c] if on_second else -couple[c], at3(offset, c))
        _add(moments, i, weights, turning)
