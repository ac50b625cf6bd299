"""Friction moment of a crossing: yarns that touch over a patch resist spin about its normal, with one limit for
both.

Slip and spin share the limit (f / mu N)^2 + (M / (mu N l))^2 <= 1, l the lever of the patch: 2/3 R for a disc of even
pressure. It is the ellipsoid by which Howe & Cutkosky (1996) replace the limit surface of a disc (Goyal, Ruina &
Papadopoulos 1991). What slips does so along the normal of that surface, so that a disc which slides at v and spins at w
resists with f : M / l = v : l w.
"""

from math import sqrt

from numba import njit

from knittest.kernels.contact import (
    COEFFICIENT,
    COUPLE,
    EX,
    GX,
    LANES,
    LEVER,
    LOST,
    OVER,
    PX,
    SLIPPING,
    SPUN,
    TURN_X,
    TWIST,
    WAS_EX,
    WAS_SLIPPING,
    read,
    read3,
    write,
)
from knittest.kernels.vec import INLINE, U, add, combine, cross, dot, load3, rows3, scale, store3

#: no force [N] and no lever [mm]
NOTHING = 1e-30


@njit(**INLINE)
def lever_of(pressure, coefficient, most, softening):
    """Lever [mm] of the friction moment under ``pressure`` [N]: min(coefficient N^p, most), p = 1/8 for a ``softening``
    of 3, 1/4 for one of 1.
    """
    root = sqrt(sqrt(pressure))
    return min(coefficient * (sqrt(root) if softening > 1.0 else root), most)


@njit(**INLINE)
def shares_left(slid2, spun2, limit, ratio):
    """Shares of force and moment left on the limit [N], by its normal: f / x and m / y, y - 1 = ``ratio`` (x - 1).

    ``slid2``, ``spun2`` squares of force and moment over lever [N^2] beyond the limit, ``ratio`` of their stiffnesses.
    x from two Newton steps for 1/sqrt(slid2/x^2 + spun2/y^2) = 1/limit, exact in one for a ratio of 1; what is left
    of the error goes along the ray.
    """
    inv_limit, square = 1.0 / max(limit, NOTHING), slid2 + spun2
    over = max(sqrt(square) * inv_limit - 1.0, 0.0)
    x = 1.0 + over * square / max(slid2 + spun2 * ratio, NOTHING * NOTHING)
    p, q = 1.0 / x, 1.0 / (1.0 + (x - 1.0) * ratio)
    f2, m2 = slid2 * p * p, spun2 * q * q
    over = max(sqrt(f2 + m2) * inv_limit - 1.0, 0.0)
    x += over * (f2 + m2) / max(f2 * p + m2 * q * ratio, NOTHING * NOTHING * NOTHING)
    p, q = 1.0 / x, 1.0 / (1.0 + (x - 1.0) * ratio)
    ray = limit / max(sqrt(slid2 * p * p + spun2 * q * q), NOTHING * NOTHING)
    return ray * p, ray * q


# Slip and spin of a block of contacts that were evaluated as if they stuck: where they give way, and what they lose.
#
# Losses are those of central differences: the mean of old and new force on what slips, and of moment on what spins.


@njit(**INLINE)
def _update_levers(count, law, w):
    """Levers by the forces."""
    for m in range(U(count)):
        offset = load3(w, GX + m, LANES)
        pressure = dot(load3(w, PX + m, LANES), offset) / max(sqrt(dot(offset, offset)), 1e-9)
        w[LEVER + m] = lever_of(max(pressure, 0.0), w[COEFFICIENT + m], w[LEVER + m], law.softening)


@njit(**INLINE)
def _limit_spin(count, law, w):
    for m in range(U(count)):
        offset = load3(w, GX + m, LANES)
        force, slid = load3(w, PX + m, LANES), load3(w, EX + m, LANES)
        before = load3(w, WAS_EX + m, LANES)
        before = add(before, cross(load3(w, TURN_X + m, LANES), before))
        inv = 1.0 / max(sqrt(dot(offset, offset)), 1e-9)
        pressure, lever, twist = max(dot(force, offset) * inv, 0.0), w[LEVER + m], w[TWIST + m]
        spun = twist + inv * w[OVER + m]
        holds = 1.0 if lever > 0.0 else 0.0
        inv_lever = holds / max(lever, NOTHING)
        ratio = law.torsional * inv_lever * inv_lever
        slid2, spun2 = law.tangential * law.tangential * dot(slid, slid), law.torsional * ratio * spun * spun
        sticks_to = (law.kinetic if w[WAS_SLIPPING + m] > 0.0 else law.static) * pressure
        gives = slid2 + spun2 > sticks_to * sticks_to
        f_left, m_left = shares_left(slid2, spun2, law.kinetic * pressure, ratio / law.tangential)
        f_left, m_left = f_left if gives else 1.0, holds * (m_left if gives else 1.0)
        kept, left = scale(f_left, slid), spun * m_left
        lost_spin = 0.5 * law.torsional * (twist + left) * (spun - left)
        store3(w, EX + m, LANES, kept)
        store3(w, PX + m, LANES, combine(1.0, force, law.tangential * (1.0 - f_left), slid))
        w[LOST + m] += 0.5 * law.tangential * (1.0 - f_left) * dot(slid, add(kept, before)) + lost_spin
        w[SPUN + m], w[TWIST + m], w[COUPLE + m] = lost_spin, left, law.torsional * left * inv
        w[SLIPPING + m] = 1.0 if gives & (pressure > 0.0) else 0.0


@njit(**INLINE)
def limit_spin_and_slip(first, count, contacts, law, w):
    """Let the contacts first.. of a block, whose springs and forces are those of sticking, slip and spin by ``law``."""
    read3(first, count, rows3(contacts.spring), w, WAS_EX)
    read(first, count, contacts.slipping, w, WAS_SLIPPING)
    read(first, count, contacts.twist, w, TWIST)
    read(first, count, contacts.lever[1], w, LEVER)
    if law.softening > 0.0:
        read(first, count, contacts.lever[0], w, COEFFICIENT)
        _update_levers(count, law, w)
    _limit_spin(count, law, w)
    write(first, count, w, TWIST, contacts.twist)
    write(first, count, w, COUPLE, contacts.couple)
