"""Slip and spin of a block of contacts that were evaluated as if they stuck: where they give way, and what they lose.

Losses are those of central differences: the mean of old and new force on what slips, and of moment on what spins.
"""

from math import sqrt

from numba import njit

from knittest.kernels.contact_scratch import (
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
from knittest.kernels.options import INLINE, U
from knittest.kernels.rows import load3, rows3, store3
from knittest.kernels.spin import NOTHING, lever_of, shares_left
from knittest.kernels.vec import add, combine, cross, dot, scale


@njit(**INLINE)
def _grow(count, law, w):
    """Levers by the forces."""
    for m in range(U(count)):
        offset = load3(w, GX + m, LANES)
        pressure = dot(load3(w, PX + m, LANES), offset) / max(sqrt(dot(offset, offset)), 1e-9)
        w[LEVER + m] = lever_of(max(pressure, 0.0), w[COEFFICIENT + m], w[LEVER + m], law.softening)


@njit(**INLINE)
def _give_way(count, law, w):
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
def give_way(first, count, contacts, law, w):
    """Let the contacts first.. of a block, whose springs and forces are those of sticking, slip and spin by ``law``."""
    read3(first, count, rows3(contacts.spring), w, WAS_EX)
    read(first, count, contacts.slipping, w, WAS_SLIPPING)
    read(first, count, contacts.twist, w, TWIST)
    read(first, count, contacts.lever[1], w, LEVER)
    if law.softening > 0.0:
        read(first, count, contacts.lever[0], w, COEFFICIENT)
        _grow(count, law, w)
    _give_way(count, law, w)
    write(first, count, w, TWIST, contacts.twist)
    write(first, count, w, COUPLE, contacts.couple)
