"""Contact of two straight pieces of yarns, of round or elliptic section: closest points and the normal between them."""

from math import sqrt

from numba import njit

from knittest.kernels.options import INLINE, PART
from knittest.kernels.section import support, turned_normal
from knittest.kernels.vec import add, combine, cross, dot, scale, sub

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
def _across(n, u):
    """Unit vector along the part of ``n`` across ``u``."""
    rest = combine(1.0, n, -dot(n, u) / dot(u, u), u)
    return scale(1.0 / max(sqrt(dot(rest, rest)), 1e-9), rest)


@njit(**INLINE)
def _apart(r, u, v, first, second, n):
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
    n = _across(n, u) if inside else n
    n = _across(n, v) if on else n
    return turned_normal(n, g, first, second)


@njit(**PART)
def touch(r, u, v, first, second, enough):
    """Nearest places of two straight yarns P + s u and Q + t v of elliptic sections, r = P - Q.

    Returns s, t in [0, 1], the unit normal (3) from the second to the first, and their depth in each other [mm].
    Newton steps of the normal, halved until the distance along it grows, end within :data:`TOUCHED`, or where it is
    more than ``enough`` [mm].
    """
    s, t = segment_closest(r, u, v)
    g = add(r, combine(s, u, -t, v))
    n = scale(1.0 / max(sqrt(dot(g, g)), 1e-9), g)
    best = _apart(r, u, v, first, second, n)
    for _ in range(TURNS if best <= enough else 0):
        moved = sub(r, add(support(first, n)[1], support(second, n)[1]))
        s, t = segment_closest(moved, u, v)
        g = add(moved, combine(s, u, -t, v))
        rest = combine(1.0, g, -dot(n, g), n)
        if best > enough or dot(rest, rest) < TOUCHED * TOUCHED:
            break
        turned = _next_normal(n, g, 0.0 < s < 1.0, 0.0 < t < 1.0, u, v, first, second)
        apart = _apart(r, u, v, first, second, turned)
        for _ in range(HALVINGS):
            if apart >= best - TOUCHED * TOUCHED:
                break
            half = add(n, turned)
            turned = scale(1.0 / max(sqrt(dot(half, half)), 1e-9), half)
            apart = _apart(r, u, v, first, second, turned)
        n, best = turned, apart
    return s, t, n, -best
