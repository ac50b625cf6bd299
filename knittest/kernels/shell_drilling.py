"""Drilling of a block of shells: what holds the corners' turns about the normal to those of the fibres."""

from numba import njit

from knittest.kernels.options import INLINE
from knittest.kernels.shell import drill_gradients, fibre_vectors
from knittest.kernels.shell_scratch import CORNERS, LANES, OUT, D, X, add_to_corner, corners, gather, turned
from knittest.kernels.shell_state import ALIVE, AREA, fibres_of, normal_of, warp_of
from knittest.kernels.vec import add, combine, scale


@njit(**INLINE)
def _corner(w, i, fibres, axes, stiffness):
    """Gradients at ``fibres`` a, b and moment of the corner rotated by ``i``; ``axes``: the initial warp and normal."""
    return drill_gradients(fibres[0], fibres[1], turned(w, i, axes[0]), turned(w, i, axes[1]), stiffness)


@njit(**INLINE)
def add_drilling(block, at, out, nodes, shells, laminate, w):
    """Add the forces and moments of drilling to those of a block; its rotations are gathered anew.

    A sweep of its own, which laminates without this stiffness skip.
    """
    state, corner = shells.state, shells.corner
    gather(block, nodes, shells.conn, w)
    for k in range(LANES):
        s, d, o = at + k, D + k, out + k
        axes, fibres = (warp_of(state, s), normal_of(state, s)), fibres_of(state, s)
        ab = fibre_vectors(corners(w, X + k), fibres)
        stiffness = 0.25 * laminate.drilling * state[s + ALIVE] * state[s + AREA]
        a1, b1, m1 = _corner(w, d + CORNERS[0], ab, axes, stiffness)
        a2, b2, m2 = _corner(w, d + CORNERS[1], ab, axes, stiffness)
        a3, b3, m3 = _corner(w, d + CORNERS[2], ab, axes, stiffness)
        a4, b4, m4 = _corner(w, d + CORNERS[3], ab, axes, stiffness)
        grad_a, grad_b = add(add(a1, a2), add(a3, a4)), add(add(b1, b2), add(b3, b4))
        g31, g42 = combine(fibres[0], grad_a, fibres[2], grad_b), combine(fibres[1], grad_a, fibres[3], grad_b)
        add_to_corner(corner, o + OUT[0], g31, m1)
        add_to_corner(corner, o + OUT[1], g42, m2)
        add_to_corner(corner, o + OUT[2], scale(-1.0, g31), m3)
        add_to_corner(corner, o + OUT[3], scale(-1.0, g42), m4)
