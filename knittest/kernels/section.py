"""Elliptic sections of yarns: support function, point of support, and the contact of two straight pieces.

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

from knittest.kernels.vec import INLINE, PART, add, combine, cross, dot, scale, sub

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
def osculating_circle(section, n):
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


#: steps that turn the normal of two ellipses, how often each may be halved, the distance [mm] from the normal at which
#: they end, and sin^2 of the angle from which on tangents fix it
TURNS, HALVINGS, TOUCHED, CROSSED = 30, 6, 1e-9, 1e-6


@njit(**INLINE)
def segment_closest(r, u, v):
    """Parameters s, t in [0, 1] of the closest points of segments P + s u, Q + t v; r = P - Q (Ericson 2005, 5.1.9)."""
    a, b, c, e, f = dot(u, u), dot(u, v), dot(u, r), dot(v, v), dot(v, r)
    det = a * e - b * b
    s = min(max((b * f - c * e) / det, 0.0), 1.0) if det > 1e-9 * a * e else 0.5
    t = (b * s + f) / e
    if t < 0.0:
        return min(max(-c / a, 0.0), 1.0), 0.0
    if t > 1.0:
        return min(max((b - c) / a, 0.0), 1.0), 1.0
    return s, t


@njit(**INLINE)
def _unit_across(n, u):
    """Unit vector along the part of ``n`` across ``u``."""
    rest = combine(1.0, n, -dot(n, u) / dot(u, u), u)
    return scale(1.0 / max(sqrt(dot(rest, rest)), 1e-9), rest)


@njit(**INLINE)
def _surface_distance(r, u, v, first, second, n):
    """Distance [mm] of two straight yarns along the unit vector ``n``; that of their surfaces is the largest."""
    nearest = dot(n, r) + min(dot(n, u), 0.0) - max(dot(n, v), 0.0)
    return nearest - support(first, n)[0] - support(second, n)[0]


@njit(**INLINE)
def _next_normal(n, g, inside, on, u, v, first, second):
    """Normal after ``n`` for the shifted offset ``g`` (3) [mm]; nearest points ``inside`` a segment and ``on`` the
    other fix it across them, both together wholly.
    """
    uv = cross(u, v)
    if inside and on and dot(uv, uv) > CROSSED * dot(u, u) * dot(v, v):
        return scale(1.0 / max(sqrt(dot(g, g)), 1e-9), g)
    n = _unit_across(n, u) if inside else n
    n = _unit_across(n, v) if on else n
    return turned_normal(n, g, first, second)


@njit(**PART)
def closest_sections(r, u, v, first, second, enough):
    """Nearest places of two straight yarns P + s u and Q + t v of elliptic sections, r = P - Q.

    Returns s, t in [0, 1], the unit normal (3) from the second to the first, and their depth in each other [mm].
    Newton steps of the normal, halved until the distance along it grows, end within :data:`TOUCHED`, or where it is
    more than ``enough`` [mm].
    """
    s, t = segment_closest(r, u, v)
    g = add(r, combine(s, u, -t, v))
    n = scale(1.0 / max(sqrt(dot(g, g)), 1e-9), g)
    best = _surface_distance(r, u, v, first, second, n)
    for _ in range(TURNS if best <= enough else 0):
        moved = sub(r, add(support(first, n)[1], support(second, n)[1]))
        s, t = segment_closest(moved, u, v)
        g = add(moved, combine(s, u, -t, v))
        rest = combine(1.0, g, -dot(n, g), n)
        if best > enough or dot(rest, rest) < TOUCHED * TOUCHED:
            break
        turned = _next_normal(n, g, 0.0 < s < 1.0, 0.0 < t < 1.0, u, v, first, second)
        apart = _surface_distance(r, u, v, first, second, turned)
        for _ in range(HALVINGS):
            if apart >= best - TOUCHED * TOUCHED:
                break
            half = add(n, turned)
            turned = scale(1.0 / max(sqrt(dot(half, half)), 1e-9), half)
            apart = _surface_distance(r, u, v, first, second, turned)
        n, best = turned, apart
    return s, t, n, -best
