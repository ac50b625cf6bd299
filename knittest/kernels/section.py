"""Elliptic sections of yarns: support function, point of support, and the normal at which two of them touch.

A section is swept along its centre-line as the spheroid of half axes a, a and b, b along ``axis`` (its height); across
a straight yarn that is the elliptic cylinder. Its support function in the unit direction n is h(n) = sqrt(a^2 + (b^2 -
a^2) (n axis)^2), and it touches the plane across n at P(n) = grad h = h n + q, whose part q across n is the shift. Two
convex bodies with the offset g from B to A are apart by max over n of n g - hA(n) - hB(n), for which g - qA - qB is
along n: they touch as two circles of radii hA and hB would whose centres are shifted by q (support functions and their
distance: Schneider, 2014, Convex Bodies, 1.7; Gilbert & Foo, 1990, IEEE Trans. Robotics and Automation 6, 53-61). By
the envelope theorem the distance changes along n alone.

A section is passed as (axis (3), ``square`` = a^2, ``excess`` = b^2 - a^2), lengths in mm; ``excess`` 0 is a circle.
"""

from math import sqrt

from numba import njit

from knittest.kernels.options import INLINE
from knittest.kernels.vec import combine, dot, scale

#: least radius of curvature of a touching pair that a step of the normal is divided by, over their distance
FLATTEST = 0.05


@njit(**INLINE)
def support(section, n):
    """Half extent h [mm] of ``section`` along the unit vector ``n``, and the shift q (3) [mm] of what it touches."""
    axis, square, excess = section
    x = dot(axis, n)
    h = sqrt(square + excess * x * x)
    return h, scale(excess * x / h, combine(1.0, axis, -x, n))


@njit(**INLINE)
def rounding(section, n, e):
    """Second derivative of h [mm] when ``n`` turns towards the unit vector ``e`` across it: h + it is the radius of
    curvature of the surface, a^2 b^2 / h^3 in the plane of the ellipse.
    """
    axis, square, excess = section
    x, y = dot(axis, n), dot(axis, e)
    h2 = square + excess * x * x
    return (square + excess * y * y - h2 - (excess * x * y) ** 2 / h2) / sqrt(h2)


@njit(**INLINE)
def osculating(section, n):
    """Radius of curvature R = a^2 b^2 / h^3 [mm] where ``section`` touches a plane across the unit vector ``n``, and
    the shift (3) [mm] of the centre of that circle, which does not move across n as n turns.
    """
    square, excess = section[1], section[2]
    h, shift = support(section, n)
    radius = square * (square + excess) / (h * h * h)
    return radius, combine(1.0, shift, h - radius, n)


@njit(**INLINE)
def turned_normal(n, gap, first, second):
    """Unit normal after a Newton step from ``n`` towards where the shifted offset ``gap`` (3) [mm] lies along it.

    For yarns side by side, whose normal no tangents fix: the step divides what lies across n by the radii of curvature
    less the depth. ``first`` and ``second`` are the sections.
    """
    along = dot(n, gap)
    rest = combine(1.0, gap, -along, n)
    size = sqrt(dot(rest, rest))
    e = scale(1.0 / max(size, 1e-30), rest)
    least = FLATTEST * abs(along)
    step = 1.0 / max(along + rounding(first, n, e) + rounding(second, n, e), least)
    turned = combine(1.0, n, step, rest)
    return scale(1.0 / sqrt(dot(turned, turned)), turned)
