"""Yarn-yarn contact on quadratic B-spline centre-lines: closest points, penalty, Coulomb friction, the scratch of a
block.

Beam nodes are the control points of the centre-line. Piece i of a chain is
c(s) = (P[i-1] + P[i])/2 + s (P[i] - P[i-1]) + s^2/2 (P[i-1] - 2 P[i] + P[i+1]), s in [0, 1), C1 between pieces, so
a contact sliding along a yarn keeps a smooth force (the clamped segment-segment distance does not).
"""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.vec import INLINE, ONE, U, add, at3, combine, sub

#: kinds of contacts: at a point, whose place on both yarns is free; of yarns side by side, or with the first bent round
#: the second, one at the middle of each piece of the first; with the second bent round the first, of the second
POINT, SIDE_BY_SIDE, FIRST_ALONG, SECOND_ALONG = 0.0, 1.0, 2.0, 3.0
#: share of the tangent's square that a curvature term may take from the Hessian: keeps every step a descent
CURVATURE_LIMIT = 0.9
#: least determinant of the Hessian over the product of its diagonal: keeps it positive definite
LEAST_DETERMINANT = 0.02
#: largest move of a contact parameter in one step
PARAMETER_STEP = 0.2
PER_STEP = 1.0 / PARAMETER_STEP
#: parameters of a piece at the ends of its yarn: the spline goes on for half an element, up to the last node
FIRST_END, LAST_END = -0.5, 1.5


@njit(**INLINE)
def spline_weights(s):
    """Weights of the three control points of a piece at parameter ``s``."""
    last = 0.5 * s * s
    first = 0.5 * (1.0 - s) * (1.0 - s)
    return first, 1.0 - first - last, last


@njit(**INLINE)
def tangent_of(i, parameter, x):
    """Tangent (3) of piece ``i`` at ``parameter`` from the positions ``x``; from velocities its rate."""
    before, at, after = at3(x, i - ONE), at3(x, i), at3(x, i + ONE)
    return combine(1.0 - parameter, sub(at, before), parameter, sub(after, at))


@njit(**INLINE)
def bend_of(i, x):
    """Second derivative (3) of piece ``i`` from the positions ``x``; from velocities its rate."""
    return combine(1.0, add(at3(x, i - ONE), at3(x, i + ONE)), -2.0, at3(x, i))


@njit(**INLINE)
def slope_at(s, first, second):
    """Derivative (3) of c0 + s ``first`` + s^2 ``second`` by ``s``."""
    return combine(1.0, first, 2.0 * s, second)


@njit(**INLINE)
def closest_step(
    s, t, wx, wy, wz, ux, uy, uz, vx, vy, vz, ax, ay, az, bx, by, bz, own_a, own_b, line
):  # fmt: skip
    """One safeguarded Newton step for the closest points of two curves at the parameters ``s`` and ``t``.

    ``w`` offset from curve B to A, ``u``, ``v`` tangents and ``a``, ``b`` second derivatives at the present
    parameters. ``own_a`` and ``own_b`` are the products of ``a`` and ``b`` with the shifts of their own sections, which
    are in ``w`` but turn with the curves, 0 for circles. The kind ``line`` of the contact says whether either parameter
    is held. A parameter at the end of its yarn is held too while the distance falls beyond it. The Hessian is kept
    positive definite, so that the distance falls along every step: where two minima merge, an indefinite one sends the
    closest points away along both yarns, and the yarns pass through each other. Returns the new (s, t).
    """
    f = wx * ux + wy * uy + wz * uz
    h = wx * vx + wy * vy + wz * vz
    uu = ux * ux + uy * uy + uz * uz
    vv = vx * vx + vy * vy + vz * vz
    ss = uu + max(wx * ax + wy * ay + wz * az + own_a, -CURVATURE_LIMIT * uu)
    tt = vv - min(wx * bx + wy * by + wz * bz + own_b, CURVATURE_LIMIT * vv)
    held_a = (
        (line == SIDE_BY_SIDE) | (line == FIRST_ALONG) | ((s <= FIRST_END) & (f > 0.0)) | ((s >= LAST_END) & (f < 0.0))
    )
    held_b = (line == SECOND_ALONG) | ((t <= FIRST_END) & (h < 0.0)) | ((t >= LAST_END) & (h > 0.0))
    moves_a = 0.0 if held_a else 1.0
    moves_b = 0.0 if held_b else 1.0
    uv = (ux * vx + uy * vy + uz * vz) * moves_a * moves_b
    most = (1.0 - LEAST_DETERMINANT) * ss * tt
    uv = most / uv if uv * uv > most else uv
    ds = (f * tt - h * uv) * moves_a
    dt = (f * uv - h * ss) * moves_b
    # both by one factor: each cut by itself, the step might lead uphill
    determinant = max(ss * tt - uv * uv, LEAST_DETERMINANT * ss * tt)
    part = 1.0 / max(determinant, max(abs(ds), abs(dt)) * PER_STEP)
    return min(max(s - part * ds, FIRST_END), LAST_END), min(max(t - part * dt, FIRST_END), LAST_END)


@njit(**INLINE)
def penalty(depth, normal, linear, square, cubic, cap):
    """Force [N], tangent [N/mm] and energy [mJ] of a contact at ``depth`` [mm].

    F = normal d (1 + linear d + square d^2 + cubic d^3), beyond ``cap`` along its tangent there, so that the stiffness
    has a bound.
    """
    d = min(depth, cap)
    force = normal * d * (1.0 + d * (linear + d * (square + d * cubic)))
    tangent = normal * (1.0 + d * (2.0 * linear + d * (3.0 * square + d * 4.0 * cubic)))
    energy = normal * d * d * (0.5 + d * (linear / 3.0 + d * (0.25 * square + d * 0.2 * cubic)))
    over = depth - d
    return force + tangent * over, tangent, energy + over * (force + 0.5 * tangent * over)


@njit(**INLINE)
def elastic_force(depth, law):
    """Force [N] at ``depth`` [mm], none in a gap, by ``law`` (:class:`ContactLaw`)."""
    normal, _, _, _, _, linear, square, cubic, cap, _, _ = law
    return penalty(max(depth, 0.0), normal, linear, square, cubic, cap)[0]


@njit(**INLINE)
def contact_force(gx, gy, gz, closing, reach, ex, ey, ez, dx, dy, dz, slipping, law, inv_dt):
    """Penalty and friction of one contact by ``law`` (:class:`ContactLaw`, as a tuple).

    ``g`` offset from B to A [mm], ``closing`` approach of the material points of the centre-lines in this step [mm]
    (not of the closest points, which also slide along the yarns), ``reach`` the sum of radii, ``e`` the stretch of the
    sticking spring, turned with the yarns, and ``d`` the slide of the touching surfaces in this step [mm]. A contact
    that sticks gives way at the static limit and slips at the kinetic one until its spring falls below that. Returns
    force on A (3) [N], returned spring (3), 1 where it slips, the energy lost by slip in this step [mJ] (mean spring
    force times slip, as central differences see it), and the viscous part of the force [N].
    """
    _, tangential, static, kinetic, viscous, _, _, _, _, _, _ = law
    distance = sqrt(gx * gx + gy * gy + gz * gz)
    inv = 1.0 / max(distance, 1e-9)
    nx, ny, nz = gx * inv, gy * inv, gz * inv
    depth = max(reach - distance, 0.0)
    touching = 1.0 if depth > 0.0 else 0.0
    elastic = elastic_force(depth, law)
    pressure = max(elastic + touching * viscous * closing * inv_dt, 0.0)
    tx, ty, tz = ex + dx, ey + dy, ez + dz
    along = tx * nx + ty * ny + tz * nz
    sx, sy, sz = tx - along * nx, ty - along * ny, tz - along * nz
    trial = tangential * sqrt(sx * sx + sy * sy + sz * sz)
    over = trial > (kinetic if slipping > 0.0 else static) * pressure
    share = kinetic * pressure / max(trial, 1e-30) if over else 1.0
    slips = 1.0 if over & (pressure > 0.0) else 0.0
    sx, sy, sz = sx * share, sy * share, sz * share
    slip = (ex + sx) * (tx - sx) + (ey + sy) * (ty - sy) + (ez + sz) * (tz - sz)
    rubbed = 0.5 * tangential * slip
    fx = pressure * nx - tangential * sx
    fy = pressure * ny - tangential * sy
    fz = pressure * nz - tangential * sz
    return fx, fy, fz, sx, sy, sz, slips, rubbed, pressure - elastic


BLOCK = 64
#: rows lie apart by no power of two: the rows of a contact would share a few sets of the first-level cache
STRIDE = BLOCK + 8
LANES = U(STRIDE)
# control points of A and B (9 + 9), parameters, kind, reach, spring, offset, force, loss by friction, slipping,
# turn of the touching surfaces, loss by damping, turn of A over B about the offset times its length, loss by spin
P = tuple(np.uintp(STRIDE * k) for k in range(18))
S, T, LINE, REACH = (np.uintp(STRIDE * k) for k in range(18, 22))
EX, EY, EZ = (np.uintp(STRIDE * k) for k in range(22, 25))
GX, GY, GZ = (np.uintp(STRIDE * k) for k in range(25, 28))
PX, PY, PZ = (np.uintp(STRIDE * k) for k in range(28, 31))
LOST, SLIPPING = np.uintp(STRIDE * 31), np.uintp(STRIDE * 32)
TURN_X, TURN_Y, TURN_Z = (np.uintp(STRIDE * k) for k in range(33, 36))
DAMPED = np.uintp(STRIDE * 36)
OVER, SPUN = np.uintp(STRIDE * 37), np.uintp(STRIDE * 38)
# tangents (3) of A, before the step where the force will be, after it where control points were, and of B
WAS_UX, UX, VX = PX, P[3], np.uintp(STRIDE * 39)
# the step [ms] where surfaces touched, else 0, until losses are known
TOUCHED = LOST
# before losses are known: normal force before the step; products of the second derivatives of A and B with the shifts
# of their own sections, the latter in the place of TOUCHED, which is read before
PRESSED, OWN_A, OWN_B = DAMPED, SPUN, LOST
SCRATCH = STRIDE * 42
P0, P1, P2, P3, P4, P5, P6, P7, P8 = P[:9]
R0, R1, R2, R3, R4, R5, R6, R7, R8 = P[9:]
# parameters after the step, in rows that control points leave when they become spline coefficients
NEXT_S, NEXT_T = R6, R7
# control points are done with when contacts give way: spring of the last step (3), whether it slipped, twist, lever and
# its coefficient, couple
WAS_EX, WAS_SLIPPING, TWIST, LEVER, COEFFICIENT, COUPLE = P0, P6, P7, P8, R0, R1


@njit(**INLINE)
def read(first, count, row, w, target):
    """Read a block of ``count`` contacts of ``row`` from ``first`` on into the row ``target``."""
    for m in range(U(count)):
        w[target + m] = row[U(first) + m]


@njit(**INLINE)
def read3(first, count, rows, w, target):
    """Read a block of three rows, the first of them into ``target``."""
    read(first, count, rows[0], w, target)
    read(first, count, rows[1], w, target + LANES)
    read(first, count, rows[2], w, target + LANES + LANES)


@njit(**INLINE)
def write(first, count, w, source, row):
    """Write the row ``source`` of a block of ``count`` contacts into ``row`` from ``first`` on."""
    for m in range(U(count)):
        row[U(first) + m] = w[source + m]


@njit(**INLINE)
def write3(first, count, w, source, rows):
    """Write three rows of a block, the first of them ``source``."""
    write(first, count, w, source, rows[0])
    write(first, count, w, source + LANES, rows[1])
    write(first, count, w, source + LANES + LANES, rows[2])
