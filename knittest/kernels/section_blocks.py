"""Elliptic sections in contacts that are tracked: heights that turn with their nodes, shifts from step to step.

A contact of two ellipses is one of the circles that osculate them at the last normal, on centre-lines that are shifted
to the centres of these; the normal follows from the shifted offset, to second order, however yarns are bent. Where they
touch moves with the sections, but only what the yarns do themselves rubs and closes: the offset of the last step is
carried over to the new shift.
"""

from math import sqrt

from numba import njit

from knittest.kernels.contact import (
    FIRST_END,
    GX,
    LANES,
    LAST_END,
    POINT,
    R0,
    R3,
    R6,
    REACH,
    SECOND_ALONG,
    closest_step,
    spline_weights,
)
from knittest.kernels.line_contact import mark_line_contact
from knittest.kernels.pair_search import PARALLEL_SIN2, piece
from knittest.kernels.section import osculating_circle, support, turned_normal
from knittest.kernels.vec import (
    INLINE,
    KERNEL,
    ONE,
    PART,
    U,
    add,
    at3,
    combine,
    cross,
    dot,
    load3,
    rotate,
    rows3,
    rows4,
    scale,
    store3,
    sub,
)

#: steps that place a new contact of ellipses
PLACING = 12
#: cosine between normal and offset of a place that was found: no steps lead to one along a bend of loops
PLACED = 0.95
#: columns of a place: parameters, shifted offset (3), kind; then shifts (3 + 3), touch and arm
SHIFT, OTHER, TOUCH, ARM, COLUMNS = 6, 9, 12, 13, 14


@njit(**KERNEL)
def turn_sections(first, stop, nodes, contacts):
    """Turn the heights of the sections of nodes first..stop with their nodes."""
    qw, qx, qy, qz = rows4(nodes.rotation)
    start, turned = rows3(contacts.upright), rows3(contacts.turned)
    for k in range(U(stop - first)):
        i = U(first) + k
        x, y, z = rotate(qw[i], qx[i], qy[i], qz[i], at3(start, i))
        turned[0][i], turned[1][i], turned[2][i] = x, y, z


@njit(**INLINE)
def section_at(i, parameter, turned, square, excess):
    """Section of piece ``i`` at ``parameter``; ``turned`` (3 rows) heights of the nodes."""
    before, at, after = spline_weights(parameter)
    axis = combine(before, at3(turned, i - ONE), at, at3(turned, i))
    wide = before * square[i - ONE] + at * square[i] + after * square[i + ONE]
    more = before * excess[i - ONE] + at * excess[i] + after * excess[i + ONE]
    return combine(1.0, axis, after, at3(turned, i + ONE)), wide, more


@njit(**INLINE)
def _unit(v):
    return scale(1.0 / max(sqrt(dot(v, v)), 1e-9), v)


@njit(**INLINE)
def shift_to_sections(m, first, second, shift, other, touch, touched, grown, spin_a, spin_b, w):
    """Shift contact ``m`` of a block in the scratch ``w`` to its sections.

    Returns the new shifts, the radius of curvature of the first and the sum of both [mm]. ``spin_a``, ``spin_b`` are
    turns in this step where the yarns ``touched``: there what they close themselves is all that their depth grows by,
    but for what both have ``grown`` in shape.
    """
    offset = load3(w, GX + m, LANES)
    n = _unit(offset)
    h, a = osculating_circle(first, n)
    k, b = osculating_circle(second, n)
    moved = sub(add(shift, other), add(a, b))
    turned = add(cross(spin_a, combine(0.5, shift, 0.5, a)), cross(spin_b, combine(0.5, other, 0.5, b)))
    store3(w, GX + m, LANES, add(offset, add(moved, turned)))
    for row in (R0, R3, R6):
        store3(w, row + m, LANES, add(load3(w, row + m, LANES), add(a, b)))
    if touched > 0.0:
        gap = load3(w, GX + m, LANES)
        w[REACH + m] += sqrt(dot(gap, gap)) - sqrt(dot(offset, offset)) + grown
    else:
        w[REACH + m] += h + k - touch
    return a, b, h, h + k


@njit(**INLINE)
def _neighbour_place(i, s, alive):
    """Piece and parameter of the same place, on the neighbouring piece of the yarn where it lies there."""
    if s >= 1.0 and alive[i] > 0.0 and alive[i + 1] > 0.0:
        return i + 1, s - 1.0
    if s < 0.0 and i > 1 and alive[i - 1] > 0.0 and alive[i - 2] > 0.0:
        return i - 1, s + 1.0
    return i, s


@njit(**PART)
def _solve_place(i, j, place, position, contacts, alive):
    """Solve the place of one pair of ellipses, in place; returns its pieces."""
    x, y, z = rows3(position)
    turned, square, excess = rows3(contacts.turned), contacts.square, contacts.excess
    s, t, line = place[0], place[1], place[5]
    n, gap = _unit((place[2], place[3], place[4])), (place[2], place[3], place[4])
    first = section_at(U(i), s, turned, square, excess)
    second = section_at(U(j), t, turned, square, excess)
    a, b, h, k = gap, gap, 0.0, 0.0
    for step in range(PLACING):
        ax, ay, az, ux, uy, uz, px, py, pz = piece(x, y, z, i)
        bx, by, bz, vx, vy, vz, qx, qy, qz = piece(x, y, z, j)
        u = (ux + 2.0 * s * px, uy + 2.0 * s * py, uz + 2.0 * s * pz)
        v = (vx + 2.0 * t * qx, vy + 2.0 * t * qy, vz + 2.0 * t * qz)
        uv = cross(u, v)
        if line == POINT and dot(uv, uv) > PARALLEL_SIN2 * dot(u, u) * dot(v, v):
            uv = _unit(uv)
            n = uv if dot(uv, n) > 0.0 else scale(-1.0, uv)
        elif step > 0:
            free = u if line == SECOND_ALONG else v
            n = turned_normal(_unit(combine(1.0, n, -dot(n, free) / dot(free, free), free)), gap, first, second)
        first = section_at(U(i), s, turned, square, excess)
        second = section_at(U(j), t, turned, square, excess)
        h, a = support(first, n)
        k, b = support(second, n)
        gap = (
            ax - bx + s * (ux + s * px) - t * (vx + t * qx) - a[0] - b[0],
            ay - by + s * (uy + s * py) - t * (vy + t * qy) - a[1] - b[1],
            az - bz + s * (uz + s * pz) - t * (vz + t * qz) - a[2] - b[2],
        )
        if step < PLACING - 1:
            bend_a, bend_b = (2.0 * px, 2.0 * py, 2.0 * pz), (2.0 * qx, 2.0 * qy, 2.0 * qz)
            # either section moves with its own yarn, and is a circle of its curvature to the other
            own_a = dot(combine(1.0, a, osculating_circle(second, n)[0] - k, n), bend_a)
            own_b = dot(combine(1.0, b, osculating_circle(first, n)[0] - h, n), bend_b)
            s, t = closest_step(
                s, t, gap[0], gap[1], gap[2], u[0], u[1], u[2], v[0], v[1], v[2],
                bend_a[0], bend_a[1], bend_a[2], bend_b[0], bend_b[1], bend_b[2], own_a, own_b, line,
            )  # fmt: skip
            i, s = _neighbour_place(i, s, alive)
            j, t = _neighbour_place(j, t, alive)
    converged = dot(gap, n) > PLACED * sqrt(dot(gap, gap))
    gap = combine(1.0, gap, -h - k, n)
    h, a = osculating_circle(first, n)
    k, b = osculating_circle(second, n)
    gap = combine(1.0, gap, h + k, n)
    place[0], place[1], place[TOUCH], place[ARM] = s, t, h + k, h / (h + k)
    for axis in range(3):
        place[2 + axis], place[SHIFT + axis], place[OTHER + axis] = gap[axis], a[axis], b[axis]
    return i if converged else -1, j


@njit(**KERNEL)
def place_ellipses(pairs, places, found, position, contacts, alive, skin):
    """Move the places of pairs that :func:`knittest.kernels.pair_search.find_pairs` found to where ellipses touch.

    Pairs beyond the ``skin`` [mm] are marked by -1. ``contacts`` hold the sections of the nodes.
    """
    for share in range(found.size):
        for k in range(found[share]):
            i, j = pairs[share, k, 0], pairs[share, k, 1]
            if contacts.excess[i] == 0.0 and contacts.excess[j] == 0.0:
                continue
            place = places[share, k]
            i, j = _solve_place(i, j, place, position, contacts, alive)
            gap = sqrt(place[2] * place[2] + place[3] * place[3] + place[4] * place[4])
            inside = place[0] >= FIRST_END and place[0] <= LAST_END and place[1] >= FIRST_END and place[1] <= LAST_END
            pairs[share, k, 0], pairs[share, k, 1] = i if inside and gap < place[TOUCH] + skin else -1, j


@njit(**KERNEL)
def mark_ellipses(pairs, places, found, position, contacts, pieces):
    """Mark the pieces of pairs just found that bend along ellipses, as
    :func:`knittest.kernels.line_contact.mark_found` does.

    The circles that osculate the sections where centre-lines are nearest stand for them; none is placed yet. Returns
    how many marks are new.
    """
    x, turned, new = rows3(position), rows3(contacts.turned), 0
    for share in range(found.size):
        for k in range(found[share]):
            i, j, at = pairs[share, k, 0], pairs[share, k, 1], places[share, k]
            if contacts.excess[i] == 0.0 and contacts.excess[j] == 0.0:
                continue
            gap = (at[2], at[3], at[4])
            n = _unit(gap)
            shift = osculating_circle(section_at(U(i), at[0], turned, contacts.square, contacts.excess), n)[1]
            other = osculating_circle(section_at(U(j), at[1], turned, contacts.square, contacts.excess), n)[1]
            new += mark_line_contact((i, j, at[0], at[1]), sub(gap, other), sub(gap, shift), at[5], x, pieces)
    return new
