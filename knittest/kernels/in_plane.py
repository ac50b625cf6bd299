"""Bending of the fibres in the plane of the shells: pure functions.

A yarn that lies in a surface x(s, t) along s bends in it by its geodesic curvature k = x_ss . m, with m the unit vector
of the surface across the fibre a = x_s, which is the part of the other fibre b = x_t across it: shear turns b, not m.
Bending out of the surface is that of the laminate. Stretches are not divided out: they are some per cent at
most, and a fibre that is crushed does not grow stiff. k depends on scalar products only, so rigid motions cost nothing.
"""

from math import sqrt

from numba import njit

from knittest.kernels.options import INLINE
from knittest.kernels.vec import add, combine, dot, scale, sub

#: floor of the squared part of one fibre across the other, where shear has closed the angle between them
CLOSED = 1e-12


@njit(**INLINE)
def across(a, b):
    """Unit vector across the fibre ``a`` towards ``b``, one over the length of that part of b, and a . b / a . a."""
    share = dot(a, b) / dot(a, a)
    part = sub(b, scale(share, a))
    inv = 1.0 / sqrt(max(dot(part, part), CLOSED))
    return scale(inv, part), inv, share


@njit(**INLINE)
def curvature(a, b, second):
    """Geodesic curvature [1/mm] of fibre ``a`` [-] with second derivative ``second`` [1/mm] beside fibre ``b`` [-]."""
    m, _, _ = across(a, b)
    return dot(second, m)


@njit(**INLINE)
def curvature_gradients(a, b, second):
    """Curvature and its gradients with respect to a, b and the second derivative.

    With p = b - (a . b / a . a) a and m = p / |p|: dk/d second = m, dk/db = g less its part along a for
    g = (second - k m) / |p|, dk/da = -(g . a / a . a) p - (a . b / a . a) dk/db.
    """
    m, inv, share = across(a, b)
    k = dot(second, m)
    g = scale(inv, sub(second, scale(k, m)))
    along = dot(g, a) / dot(a, a)
    by_b = sub(g, scale(along, a))
    return k, combine(-along / inv, m, -share, by_b), by_b, m


@njit(**INLINE)
def bending_gradients(fibres, natural, stiffness):
    """Gradients of sum_f stiffness_f (k_f - natural_f)^2 / 2 with respect to warp, weft and their second derivatives.

    ``fibres`` (a, b, a_s, b_t), natural curvatures [1/mm] and stiffnesses [N mm^3] of warp and weft.
    """
    a, b, a_s, b_t = fibres
    k, warp_a, warp_b, warp_s = curvature_gradients(a, b, a_s)
    moment = stiffness[0] * (k - natural[0])
    k, weft_b, weft_a, weft_t = curvature_gradients(b, a, b_t)
    other = stiffness[1] * (k - natural[1])
    grad_a = add(scale(moment, warp_a), scale(other, weft_a))
    grad_b = add(scale(moment, warp_b), scale(other, weft_b))
    return grad_a, grad_b, scale(moment, warp_s), scale(other, weft_t)


@njit(**INLINE)
def bending_energy(fibres, natural, stiffness):
    """Energy [mJ] of :func:`bending_gradients`."""
    a, b, a_s, b_t = fibres
    warp, weft = curvature(a, b, a_s) - natural[0], curvature(b, a, b_t) - natural[1]
    return 0.5 * (stiffness[0] * warp * warp + stiffness[1] * weft * weft)
