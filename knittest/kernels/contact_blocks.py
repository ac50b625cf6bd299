"""Blocked evaluation of tracked contacts: gather (:mod:`contact_gather`), physics, store; then scatter by owner.

Forces are first stored by contact, then every partition adds those on its own chains in the fixed order of
``Contacts.half``: no races and the same bits at any thread count.
"""

import numpy as np
from numba import njit

from knittest.kernels.contact import (
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
    NEXT_S,
    NEXT_T,
    OWN_A,
    OWN_B,
    P0,
    P3,
    P6,
    PRESSED,
    PX,
    PY,
    PZ,
    R0,
    R3,
    R6,
    REACH,
    SLIPPING,
    SPUN,
    TURN_X,
    TURN_Y,
    TURN_Z,
    UX,
    VX,
    WAS_UX,
    S,
    T,
    closest_step,
    contact_force,
    elastic_force,
    slope_at,
    spline_weights,
    write,
    write3,
)
from knittest.kernels.contact_gather import fetch, gather_first, gather_second, move_to_next_piece
from knittest.kernels.flattening import squeeze
from knittest.kernels.spin import limit_spin_and_slip
from knittest.kernels.state import ContactLaw
from knittest.kernels.vec import INLINE, KERNEL, ONE, U, add, at3, combine, cross, load3, rows3, scale, store3, sub

#: closest-point steps a time step: a contact that lags behind the closest points makes energy out of friction
NEWTON_STEPS = 2
#: coefficient of friction with which contacts stick, to give way afterwards
STICKS = 1e30


@njit(**INLINE)
def _expand(count, w):
    """Replace the control points of a block by spline coefficients c(s) = c0 + s (c1 + s c2), of c0 the difference."""
    for m in range(U(count)):
        a0, a1, a2 = load3(w, P0 + m, LANES), load3(w, P3 + m, LANES), load3(w, P6 + m, LANES)
        b0, b1, b2 = load3(w, R0 + m, LANES), load3(w, R3 + m, LANES), load3(w, R6 + m, LANES)
        u, v = sub(a1, a0), sub(b1, b0)
        store3(w, P0 + m, LANES, u)
        store3(w, P3 + m, LANES, combine(0.5, sub(a2, a1), -0.5, u))
        store3(w, P6 + m, LANES, v)
        store3(w, R0 + m, LANES, combine(0.5, sub(b2, b1), -0.5, v))
        store3(w, R3 + m, LANES, combine(0.5, add(a0, a1), -0.5, add(b0, b1)))
        w[NEXT_S + m], w[NEXT_T + m] = w[S + m], w[T + m]


@njit(**INLINE)
def _offset_at(s, t, u1, u2, v1, v2, c):
    """Offset (3) of the points at ``s`` and ``t`` from the coefficients of both curves."""
    return (
        c[0] + s * (u1[0] + s * u2[0]) - t * (v1[0] + t * v2[0]),
        c[1] + s * (u1[1] + s * u2[1]) - t * (v1[1] + t * v2[1]),
        c[2] + s * (u1[2] + s * u2[2]) - t * (v1[2] + t * v2[2]),
    )


@njit(**INLINE)
def _approach(count, oval, w):
    """One step of a block towards the closest points: a loop of its own, in which several contacts overlap."""
    for m in range(U(count)):
        own_a, own_b = 0.0, 0.0
        if oval is not None:
            own_a, own_b = w[OWN_A + m], w[OWN_B + m]
        u1, u2 = load3(w, P0 + m, LANES), load3(w, P3 + m, LANES)
        v1, v2 = load3(w, P6 + m, LANES), load3(w, R0 + m, LANES)
        s, t = w[NEXT_S + m], w[NEXT_T + m]
        g = _offset_at(s, t, u1, u2, v1, v2, load3(w, R3 + m, LANES))
        u, v, a, b = slope_at(s, u1, u2), slope_at(t, v1, v2), scale(2.0, u2), scale(2.0, v2)
        w[NEXT_S + m], w[NEXT_T + m] = closest_step(
            s, t, g[0], g[1], g[2], u[0], u[1], u[2], v[0], v[1], v[2], a[0], a[1], a[2], b[0], b[1], b[2],
            own_a, own_b, w[LINE + m],
        )  # fmt: skip


@njit(**INLINE)
def _evaluate(count, law, oval, inv_dt, w):
    _expand(count, w)
    for _ in range(NEWTON_STEPS):
        _approach(count, oval, w)
    for m in range(U(count)):
        u1, u2 = load3(w, P0 + m, LANES), load3(w, P3 + m, LANES)
        v1, v2 = load3(w, P6 + m, LANES), load3(w, R0 + m, LANES)
        c = load3(w, R3 + m, LANES)
        was_s, was_t, s, t = w[S + m], w[T + m], w[NEXT_S + m], w[NEXT_T + m]
        # offset of the same material points now: its change since the last step is the relative motion
        ox, oy, oz = _offset_at(was_s, was_t, u1, u2, v1, v2, c)
        gx, gy, gz = _offset_at(s, t, u1, u2, v1, v2, c)
        mx, my, mz = ox - w[GX + m], oy - w[GY + m], oz - w[GZ + m]
        rx, ry, rz = w[TURN_X + m], w[TURN_Y + m], w[TURN_Z + m]
        ex, ey, ez = w[EX + m], w[EY + m], w[EZ + m]
        ex, ey, ez = ex + ry * ez - rz * ey, ey + rz * ex - rx * ez, ez + rx * ey - ry * ex
        # the motion half where the contact was and half where it is: what turns about it as it runs makes no energy
        swing = sub(slope_at(was_s, u1, u2), load3(w, WAS_UX + m, LANES))
        swung = sub(slope_at(was_t, v1, v2), load3(w, VX + m, LANES))
        kx, ky, kz = combine(0.5 * (s - was_s), swing, 0.5 * (was_t - t), swung)
        mx, my, mz = mx + kx, my + ky, mz + kz
        # surfaces touch at a point between the centre-lines: they turn with their yarns about its arms
        hx, hy, hz = 0.5 * (gx + w[GX + m]), 0.5 * (gy + w[GY + m]), 0.5 * (gz + w[GZ + m])
        dx, dy, dz = mx - (ry * hz - rz * hy), my - (rz * hx - rx * hz), mz - (rx * hy - ry * hx)
        # what the yarns close themselves, along the mean normal of the step: a slide is none, to third order
        far, near = np.sqrt(w[GX + m] ** 2 + w[GY + m] ** 2 + w[GZ + m] ** 2), np.sqrt(gx * gx + gy * gy + gz * gz)
        before = (mx * w[GX + m] + my * w[GY + m] + mz * w[GZ + m]) / max(far, 1e-9)
        closing = -0.5 * (before + (mx * gx + my * gy + mz * gz) * (1.0 / max(near, 1e-9)))
        # no other depth: closest points that jump along a hook would make energy
        depth = max(w[REACH + m] - far + closing, 0.0)
        pressed, elastic = w[PRESSED + m], elastic_force(w[REACH + m] - far, law)
        w[REACH + m] = min(w[REACH + m], depth + near)
        fx, fy, fz, ex, ey, ez, slips, lost, resists = contact_force(
            gx, gy, gz, closing, w[REACH + m], ex, ey, ez, dx, dy, dz,
            w[SLIPPING + m], law, inv_dt,
        )  # fmt: skip
        w[S + m], w[T + m] = s, t
        store3(w, UX + m, LANES, slope_at(s, u1, u2))
        store3(w, VX + m, LANES, slope_at(t, v1, v2))
        w[EX + m], w[EY + m], w[EZ + m] = ex, ey, ez
        w[GX + m], w[GY + m], w[GZ + m] = gx, gy, gz
        w[PX + m], w[PY + m], w[PZ + m] = fx, fy, fz
        # the mean of the step, as central differences see it; one that was lifted off, or is new, had no force
        resisted = pressed - elastic if (pressed > 0.0) | (elastic == 0.0) else resists
        w[DAMPED + m] = 0.5 * (resisted + resists) * closing
        w[LOST + m], w[SLIPPING + m] = lost, slips


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
    write3(first, count, w, UX, rows3(contacts.tangent))
    write3(first, count, w, VX, rows3(contacts.other_tangent))


@njit(**KERNEL)
def contact_forces(share, dt, nodes, contacts, alive, law, spin, oval, w):
    """Evaluate the contacts of ``share`` (first, stop); returns the energies lost to friction, of it to that of spin,
    and to contact damping [mJ].

    Where ``spin`` is not None contacts are evaluated as if they stuck, then give way. What resists it, and what makes
    sections ``oval``, is not even compiled where it is None.
    """
    first, last = share
    move_to_next_piece(first, last, dt, nodes, contacts, alive)
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
        fetch(block, count, dt, contacts, w)
        gather_first(block, count, nodes, contacts, alive, w)
        gather_second(block, count, spin, oval, nodes, contacts, alive, w)
        _evaluate(count, sticking, oval, 1.0 / dt, w)
        if spin is not None:
            limit_spin_and_slip(block, count, contacts, law, w)
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
