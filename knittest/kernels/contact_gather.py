"""Inputs of a block of yarn contacts: their own rows, read one after the other, and the nodes of their pieces.

Nodes are gathered for one yarn after the other: a loop over both would run out of registers.
"""

from math import sqrt

from numba import njit

from knittest.kernels.contact import (
    EX,
    GX,
    LANES,
    LINE,
    OVER,
    OWN_A,
    OWN_B,
    P0,
    P3,
    P6,
    PRESSED,
    R0,
    R3,
    R6,
    REACH,
    SLIPPING,
    TOUCHED,
    TURN_X,
    VX,
    WAS_UX,
    S,
    T,
    bend_of,
    read,
    read3,
    spline_weights,
    tangent_of,
)
from knittest.kernels.flattening import swelling
from knittest.kernels.section_blocks import section_at, shift_to_sections
from knittest.kernels.vec import INLINE, ONE, PART, U, add, at3, combine, dot, load3, put3, rows3, scale, store3, sub


@njit(**INLINE)
def _last_tangent(i, parameter, dt, x, velocity):
    """Tangent (3) of piece ``i`` one step before."""
    return combine(1.0, tangent_of(i, parameter, x), -dt, tangent_of(i, parameter, velocity))


@njit(**INLINE)
def _bend_before(i, dt, x, velocity):
    """Second derivative (3) of piece ``i`` one step before."""
    return combine(1.0, bend_of(i, x), -dt, bend_of(i, velocity))


@njit(**INLINE)
def _shift_offset(c, by, contacts):
    """Move the last offset of contact ``c`` ``by`` (3) as if it had been so: its depth stays, and nothing slid."""
    offset = rows3(contacts.offset)
    before = at3(offset, c)
    after = add(before, by)
    put3(offset, c, after)
    contacts.reach[c] += sqrt(dot(after, after)) - sqrt(dot(before, before))


@njit(**PART)
def move_to_next_piece(first, last, dt, nodes, contacts, alive):
    """Move contacts whose parameter left [0, 1) to the neighbouring piece of the same yarn.

    Piece i spans elements i - 1 and i, so it exists where both are alive; at a yarn's end or break a contact stays,
    with a parameter outside [0, 1), where it carries force for half an element more. A contact that ran beyond its
    piece lay on its continuation, off the neighbour by half the difference of their second derivatives times the way
    squared.
    """
    x, velocity = rows3(nodes.position), rows3(nodes.velocity)
    for side in range(2):
        piece, parameter = contacts.piece[side], contacts.parameter[side]
        tangent = rows3(contacts.other_tangent if side == 1 else contacts.tangent)
        half = -0.5 if side == 1 else 0.5
        for k in range(U(last - first)):
            c = U(first) + k
            i, s = U(piece[c]), parameter[c]
            j, t, beyond = i, s, 0.0
            if s >= 1.0:
                if alive[i] > 0.0 and alive[i + ONE] > 0.0:
                    j, t, beyond = i + ONE, s - 1.0, s - 1.0
            elif s < 0.0 and i > ONE and alive[i - ONE] > 0.0 and alive[i - ONE - ONE] > 0.0:
                j, t, beyond = i - ONE, s + 1.0, s
            if j != i:
                piece[c], parameter[c] = j, t
                put3(tangent, c, _last_tangent(j, t, dt, x, velocity))
                change = sub(_bend_before(j, dt, x, velocity), _bend_before(i, dt, x, velocity))
                _shift_offset(c, scale(half * beyond * beyond, change), contacts)


@njit(**INLINE)
def _spin(i, parameter, spin):
    """Spin (3) of piece ``i`` at ``parameter``."""
    before, at, after = spline_weights(parameter)
    mean = combine(before, at3(spin, i - ONE), at, at3(spin, i))
    return combine(1.0, mean, after, at3(spin, i + ONE))


@njit(**INLINE)
def fetch(first, count, dt, contacts, w):
    """Fetch what contacts hold themselves, row by row, which vectorises."""
    read(first, count, contacts.parameter[0], w, S)
    read(first, count, contacts.parameter[1], w, T)
    read(first, count, contacts.line, w, LINE)
    read(first, count, contacts.reach, w, REACH)
    read(first, count, contacts.slipping, w, SLIPPING)
    read3(first, count, rows3(contacts.spring), w, EX)
    read3(first, count, rows3(contacts.offset), w, GX)
    read3(first, count, rows3(contacts.tangent), w, WAS_UX)
    read3(first, count, rows3(contacts.other_tangent), w, VX)
    fx, fy, fz = rows3(contacts.force)
    gx, gy, gz = rows3(contacts.offset)
    for m in range(U(count)):
        c = U(first) + m
        # surfaces turn where they touched
        w[TOUCHED + m] = dt if (fx[c] != 0.0) | (fy[c] != 0.0) | (fz[c] != 0.0) else 0.0
        along = fx[c] * gx[c] + fy[c] * gy[c] + fz[c] * gz[c]
        w[PRESSED + m] = along / max(sqrt(gx[c] * gx[c] + gy[c] * gy[c] + gz[c] * gz[c]), 1e-9)


@njit(**INLINE)
def gather_first(first, count, nodes, contacts, alive, w):
    """Gather the nodes of the first pieces; their spins are left where the turn of the surfaces will be."""
    x, turning, pieces = rows3(nodes.position), rows3(nodes.spin), contacts.piece[0]
    for m in range(U(count)):
        i, s = U(pieces[U(first) + m]), w[S + m]
        store3(w, P0 + m, LANES, at3(x, i - ONE))
        store3(w, P3 + m, LANES, at3(x, i))
        store3(w, P6 + m, LANES, at3(x, i + ONE))
        store3(w, TURN_X + m, LANES, _spin(i, s, turning))
        w[REACH + m] *= alive[i - ONE] * alive[i]  # a piece with a broken element does not touch


@njit(**INLINE)
def _bend(before, at, after, m, w):
    """Second derivative (3) of the piece of contact ``m`` whose control points begin in three rows of the scratch."""
    ends = add(load3(w, before + m, LANES), load3(w, after + m, LANES))
    return combine(1.0, ends, -2.0, load3(w, at + m, LANES))


@njit(**INLINE)
def _turn_ellipses(c, m, spin_a, spin_b, contacts, w):
    """Shift contact ``c``, number ``m`` of a block, to its sections where one is an ellipse; they turn by the spins."""
    turned, square, excess = rows3(contacts.turned), contacts.square, contacts.excess
    shift, other = rows3(contacts.shift), rows3(contacts.other)
    i, j, s, t = U(contacts.piece[0, c]), U(contacts.piece[1, c]), w[S + m], w[T + m]
    if (excess[i] != 0.0) | (excess[j] != 0.0):
        first, second = section_at(i, s, turned, square, excess), section_at(j, t, turned, square, excess)
        grown, touched = swelling(i, j, s, t, first, second, load3(w, GX + m, LANES), contacts), w[TOUCHED + m]
        a, b, extent, touch = shift_to_sections(
            m, first, second, at3(shift, c), at3(other, c), contacts.touch[c], touched, grown,
            scale(touched, spin_a), scale(touched, spin_b), w,
        )  # fmt: skip
        put3(shift, c, a)
        put3(other, c, b)
        contacts.touch[c], contacts.arm[c] = touch, extent / touch
        w[OWN_A + m], w[OWN_B + m] = dot(a, _bend(P0, P3, P6, m, w)), dot(b, _bend(R0, R3, R6, m, w))
    else:
        w[OWN_A + m], w[OWN_B + m] = 0.0, 0.0


@njit(**INLINE)
def gather_second(first, count, spin, oval, nodes, contacts, alive, w):
    """Gather the nodes of the second pieces, and how the surfaces of both turn."""
    x, turning, pieces, arms = rows3(nodes.position), rows3(nodes.spin), contacts.piece[1], contacts.arm
    for m in range(U(count)):
        c = U(first) + m
        j, t = U(pieces[c]), w[T + m]
        store3(w, R0 + m, LANES, at3(x, j - ONE))
        store3(w, R3 + m, LANES, at3(x, j))
        store3(w, R6 + m, LANES, at3(x, j + ONE))
        w[REACH + m] *= alive[j - ONE] * alive[j]
        spin_a, spin_b, touched = load3(w, TURN_X + m, LANES), _spin(j, t, turning), w[TOUCHED + m]
        if spin is not None:
            w[OVER + m] = touched * dot(sub(spin_a, spin_b), load3(w, GX + m, LANES))
        if oval is not None:
            _turn_ellipses(c, m, spin_a, spin_b, contacts, w)
        arm = arms[c]
        store3(w, TURN_X + m, LANES, add(scale(touched * arm, spin_a), scale(touched * (1.0 - arm), spin_b)))
