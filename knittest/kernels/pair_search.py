"""Pairs of spline pieces that are near each other: candidates by cells, bounds that spare most of them, closest points.

Every share of the pieces finds its own pairs, so that the shares may run at once and the order does not depend on it.
"""

from math import nan, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit, prange

from knittest.base.arrays import Index
from knittest.kernels.contact import FIRST_ALONG, FIRST_END, LAST_END, POINT, SECOND_ALONG, SIDE_BY_SIDE, closest_step
from knittest.kernels.line_contact import contact_kind
from knittest.kernels.vec import (
    ALLOCATING,
    GRID_ROWS,
    INLINE,
    KERNEL,
    PARALLEL,
    PART,
    PARTITIONS,
    place_of,
    row_near,
    rows3,
    rows4,
)

#: pieces within this angle of parallel (14 degrees) are line contacts, unless they bend apart: sin^2
PARALLEL_SIN2 = 0.06
#: Newton steps that place a new crossing, and how far beyond a piece they may leave it: it belongs to one of two
NEWTON_STEPS, BEYOND = 4, 1e-3
#: the same until the closest points move by less than this share of a piece
CONVERGED, MOST_STEPS = 1e-4, 40
#: the same where one parameter is held, whose copies in a periodic cell shall be found on the same pieces, and at ends
HELD_STEPS, HELD_BEYOND = 8, 1e-9
#: parameters at which pieces side by side are found
WITHIN = (0.0, 1.0)
#: rise of the distance to both sides beyond that of a regular wrap, over the smaller radius, from which a yarn along
#: another is held between middles
DIPS = 0.04
#: length of a piece, over the smaller radius, from which on it is held also where it begins
COARSE = 3.0
#: parameter beyond a piece up to which it is looked for a point on one beside it that is held at its middle, 0.5 away
BESIDE_HELD = 0.25
#: distance along both yarns [elements] from which on two places of a piece at the end of a yarn are two
APART = 0.3


class Cells(NamedTuple):
    """The grid of :func:`knittest.kernels.search.fill_cells`: cell ``of`` every piece (-1: none), ``shape`` (3,), where
    each begins (``head``) in the ``order`` of the pieces.
    """

    of: Index
    shape: Index
    head: Index
    order: Index


@njit(**PART)
def piece(x, y, z, i):
    """Coefficients c0, c1, c2 (each 3) of spline piece ``i``: c(s) = c0 + s c1 + s^2 c2."""
    ux, uy, uz = x[i] - x[i - 1], y[i] - y[i - 1], z[i] - z[i - 1]
    return (
        0.5 * (x[i] + x[i - 1]), 0.5 * (y[i] + y[i - 1]), 0.5 * (z[i] + z[i - 1]), ux, uy, uz,
        0.5 * (x[i + 1] - x[i] - ux), 0.5 * (y[i + 1] - y[i] - uy), 0.5 * (z[i + 1] - z[i] - uz),
    )  # fmt: skip


@njit(**INLINE)
def _reach_along(x, y, z, i, wx, wy, wz, half):
    """Bound of how far piece ``i`` reaches from its middle along ``w``, times the length of that; ``half`` its length
    on either side of the middle by the parameter.
    """
    chord = (x[i + 1] - x[i - 1]) * wx + (y[i + 1] - y[i - 1]) * wy + (z[i + 1] - z[i - 1]) * wz
    bow = (x[i + 1] + x[i - 1] - 2.0 * x[i]) * wx + (y[i + 1] + y[i - 1] - 2.0 * y[i]) * wy
    bow += (z[i + 1] + z[i - 1] - 2.0 * z[i]) * wz
    return half * (0.5 * abs(chord) + 0.5 * half * abs(bow))


@njit(**INLINE)
def _are_apart(x, y, z, i, j, half_i, half_j, gap):
    """Return whether a slab of thickness ``gap`` [mm] across the line of their middles separates pieces i and j, of
    length ``half_i`` and ``half_j`` on either side of the middle by the parameter.

    About the middle a piece is c(s) = m + (s - 1/2) (P[i+1] - P[i-1])/2 + (s - 1/2)^2 (P[i+1] - 2 P[i] + P[i-1])/2.
    """
    wx = 0.125 * (x[i - 1] + x[i + 1] - x[j - 1] - x[j + 1]) + 0.75 * (x[i] - x[j])
    wy = 0.125 * (y[i - 1] + y[i + 1] - y[j - 1] - y[j + 1]) + 0.75 * (y[i] - y[j])
    wz = 0.125 * (z[i - 1] + z[i + 1] - z[j - 1] - z[j + 1]) + 0.75 * (z[i] - z[j])
    length2 = wx * wx + wy * wy + wz * wz
    reach = _reach_along(x, y, z, i, wx, wy, wz, half_i) + _reach_along(x, y, z, j, wx, wy, wz, half_j)
    return length2 - reach > gap * sqrt(length2)


@njit(**PART)
def _closest(x, y, z, i, j, s, t, line, steps):
    """Closest points of pieces i and j from the parameters s, t on: (s, t, offset (3), last change of s and t).

    ``line`` may hold a parameter. At most ``steps`` are made.
    """
    ax, ay, az, ux, uy, uz, px, py, pz = piece(x, y, z, i)
    bx, by, bz, vx, vy, vz, qx, qy, qz = piece(x, y, z, j)
    wx, wy, wz, change = 0.0, 0.0, 0.0, 0.0
    for step in range(steps + 1):
        wx = ax - bx + s * (ux + s * px) - t * (vx + t * qx)
        wy = ay - by + s * (uy + s * py) - t * (vy + t * qy)
        wz = az - bz + s * (uz + s * pz) - t * (vz + t * qz)
        if step < steps:
            before_s, before_t = s, t
            s, t = closest_step(
                s, t, wx, wy, wz, ux + 2 * s * px, uy + 2 * s * py, uz + 2 * s * pz,
                vx + 2 * t * qx, vy + 2 * t * qy, vz + 2 * t * qz,
                2 * px, 2 * py, 2 * pz, 2 * qx, 2 * qy, 2 * qz, 0.0, 0.0, line,
            )  # fmt: skip
            change = abs(s - before_s) + abs(t - before_t)
    return s, t, wx, wy, wz, change


@njit(**PART)
def converge_point(x, y, z, i, j, s, t):
    """Closest points of pieces i and j from s, t on, at a point: (s, t, offset (3)), s is nan where they do not come to
    rest.
    """
    wx, wy, wz, change = 0.0, 0.0, 0.0, 1.0
    for _ in range(MOST_STEPS):
        s, t, wx, wy, wz, change = _closest(x, y, z, i, j, s, t, POINT, 1)
        if change < CONVERGED:
            return s, t, wx, wy, wz
    return nan, t, wx, wy, wz


@njit(**PART)
def reach_of(i, alive, pieces):
    """Least and largest parameter of piece ``i``: up to the last node at an end of its yarn, else as far as the next
    piece, and a little more.
    """
    first = FIRST_END if pieces.ends and (i < 2 or alive[i - 2] == 0.0) else -BEYOND
    last = LAST_END if pieces.ends and alive[i + 1] == 0.0 else 1.0 + BEYOND
    return first, last


@njit(**KERNEL)
def crossing(x, y, z, i, j):
    """Closest points of pieces i and j: (s, t, offset (3), kind); parameters may leave [0, 1).

    The Hessian of half the squared distance says whether they touch at a point: straight pieces by the angle between
    them, parallel ones by how they bend apart.
    """
    ax, ay, az, ux, uy, uz, px, py, pz = piece(x, y, z, i)
    bx, by, bz, vx, vy, vz, qx, qy, qz = piece(x, y, z, j)
    mx, my, mz = ux + px, uy + py, uz + pz
    nx, ny, nz = vx + qx, vy + qy, vz + qz
    mn = mx * nx + my * ny + mz * nz
    mm, nn = mx * mx + my * my + mz * mz, nx * nx + ny * ny + nz * nz
    wx = ax - bx + 0.5 * (ux + 0.5 * px - vx - 0.5 * qx)
    wy = ay - by + 0.5 * (uy + 0.5 * py - vy - 0.5 * qy)
    wz = az - bz + 0.5 * (uz + 0.5 * pz - vz - 0.5 * qz)
    first = max(mm + 2.0 * (wx * px + wy * py + wz * pz), 0.0)
    second = max(nn - 2.0 * (wx * qx + wy * qy + wz * qz), 0.0)
    apart = max(first * second - mm * nn, 0.0)
    line = SIDE_BY_SIDE if mn * mn - apart > (1.0 - PARALLEL_SIN2) * mm * nn else POINT
    s, t, wx, wy, wz, _ = _closest(x, y, z, i, j, 0.5, 0.5, line, NEWTON_STEPS)
    return s, t, wx, wy, wz, line


@njit(**INLINE)
def stretch_of(parameters):
    """Length of a piece over that between two middles of elements, by :func:`reach_of`: 2 at the ends of yarns."""
    return 2.0 if parameters[0] == FIRST_END or parameters[1] == LAST_END else 1.0


@njit(**INLINE)
def _moves_away(wx, wy, wz, ux, uy, uz, ax, ay, az, vx, vy, vz, radius):
    """Return whether a yarn is farther from another half an element on, by more than in a regular wrap.

    ``w`` offset from the other yarn's tangent ``v`` [mm], ``u`` tangent [mm] and ``a`` second derivative of its own.
    Round a straight yarn, turning by the angle q a piece, it is (3/4 + cos(q)/4) / cos(q/2) times as far in between.
    """
    near, uu = sqrt(wx * wx + wy * wy + wz * wz), ux * ux + uy * uy + uz * uz
    regular = near
    if wx * ax + wy * ay + wz * az < 0.0:
        nx, ny, nz = ux + ax, uy + ay, uz + az
        cosine = max((ux * nx + uy * ny + uz * nz) / sqrt(uu * (nx * nx + ny * ny + nz * nz)), -0.5)
        regular *= (0.75 + 0.25 * cosine) / sqrt(0.5 + 0.5 * cosine)
    wx, wy, wz = wx + 0.5 * ux + 0.125 * ax, wy + 0.5 * uy + 0.125 * ay, wz + 0.5 * uz + 0.125 * az
    along = wx * vx + wy * vy + wz * vz
    far2 = wx * wx + wy * wy + wz * wz - along * along / max(vx * vx + vy * vy + vz * vz, 1e-30)
    return far2 > (regular + DIPS * radius) ** 2


@njit(**PART)
def _is_nearer_between(x, y, z, own, other, at, wx, wy, wz, radius):
    """Return whether piece ``own`` is nearer to the piece ``other``, at its parameter ``at``, at its start than at the
    middles before and after, at which it is held.

    ``w`` offset from ``other`` [mm]. A coarse yarn that snaps round another may come through between two middles.
    """
    _, _, _, ux, uy, uz, ax, ay, az = piece(x, y, z, own)
    _, _, _, _, _, _, bx, by, bz = piece(x, y, z, own - 1)
    _, _, _, vx, vy, vz, qx, qy, qz = piece(x, y, z, other)
    vx, vy, vz = vx + 2.0 * at * qx, vy + 2.0 * at * qy, vz + 2.0 * at * qz
    return _moves_away(wx, wy, wz, ux, uy, uz, 2.0 * ax, 2.0 * ay, 2.0 * az, vx, vy, vz, radius) and _moves_away(
        wx, wy, wz, -ux, -uy, -uz, 2.0 * bx, 2.0 * by, 2.0 * bz, vx, vy, vz, radius
    )


@njit(**INLINE)
def tip_of(parameters):
    """Parameter of the last node of a piece at an end of its yarn, by :func:`reach_of`; else that of its middle."""
    if parameters[0] == FIRST_END:
        return FIRST_END
    return LAST_END if parameters[1] == LAST_END else 0.5


@njit(**INLINE)
def _limits_of(line, parameters):
    """Least and largest parameter at which a contact of the kind ``line`` is found, from those by :func:`reach_of`."""
    if line == POINT:
        return parameters
    if line == SIDE_BY_SIDE:
        return WITHIN
    first = FIRST_END if parameters[0] == FIRST_END else -HELD_BEYOND
    return first, LAST_END if parameters[1] == LAST_END else 1.0 + HELD_BEYOND


@njit(**PART)
def _first_place(x, y, z, i, j, held, at_end):
    """Closest points of pieces i and j from their middles on: (s, t, offset (3), kind); ``held`` by their marks.

    Where a yarn ends (``at_end``) pieces that are not side by side are one at a point, which has its place sought.
    """
    if held != POINT:
        s, t, wx, wy, wz, _ = _closest(x, y, z, i, j, 0.5, 0.5, held, HELD_STEPS)
        return s, t, wx, wy, wz, held
    s, t, wx, wy, wz, line = crossing(x, y, z, i, j)
    if at_end and not (line != POINT and s >= 0.0 and s <= 1.0 and t >= 0.0 and t <= 1.0):
        s, t, wx, wy, wz, _ = _closest(x, y, z, i, j, s, t, POINT, HELD_STEPS)
        line = POINT
    return s, t, wx, wy, wz, line


@njit(**PART)
def _second_point(x, y, z, i, j, tips, first):
    """Another place where pieces i and j are near at a point: (s, t, offset (3)), s is nan where there is none.

    Looked for from the ``tips`` of the pieces, as a piece at an end is long enough to be near in two places.
    """
    s, t, wx, wy, wz, _ = _closest(x, y, z, i, j, tips[0], tips[1], POINT, HELD_STEPS)
    same = abs(s - first[0]) < APART and abs(t - first[1]) < APART
    return nan if same else s, t, wx, wy, wz


@njit(**PART)
def _held_place(x, y, z, i, j, line, number, tips, radius, coarse):
    """Closest points where a piece that lies along another is held beside its middle: (s, t, offset (3)), s is nan
    where it is not.

    By ``number`` where its yarn ends (1), where it begins (2) if it is ``coarse`` or nearer there
    (:func:`_is_nearer_between`), and
    where the last piece of a yarn would end (3) if it is coarse.
    """
    holds_first = line == FIRST_ALONG
    own, other, tip = (i, j, tips[0]) if holds_first else (j, i, tips[1])
    held = tip if number == 1 else number - 2.0
    if (number == 1 and tip == 0.5) or (number == 3 and not (coarse and tip == LAST_END)):
        return nan, 0.0, 0.0, 0.0, 0.0
    if number == 2 and tip == FIRST_END and not coarse:
        return nan, 0.0, 0.0, 0.0, 0.0
    s, t = (held, 0.5) if holds_first else (0.5, held)
    s, t, wx, wy, wz, _ = _closest(x, y, z, i, j, s, t, line, HELD_STEPS)
    if number == 2 and not coarse:
        sign, at = (1.0, t) if holds_first else (-1.0, s)
        if not _is_nearer_between(x, y, z, own, other, at, sign * wx, sign * wy, sign * wz, radius):
            s = nan
    return s, t, wx, wy, wz


@njit(**PART)
def _limits_beside_held(parameters, i, j, is_first, pieces):
    """Limits of a point on piece i, of which the yarn's pieces beside it may be held along that of piece j.

    Those are held at their middles: what is nearer between there and this piece is found from here.
    ``is_first`` where i is the lower one of the pair.
    """
    first, last = parameters
    own = FIRST_ALONG if is_first else SECOND_ALONG
    if first == -BEYOND and (contact_kind(i - 1, j, pieces) if is_first else contact_kind(j, i - 1, pieces)) == own:
        first = -BESIDE_HELD
    if last == 1.0 + BEYOND and (contact_kind(i + 1, j, pieces) if is_first else contact_kind(j, i + 1, pieces)) == own:
        last = 1.0 + BESIDE_HELD
    return first, last


@njit(**ALLOCATING)
def _sort_by_cell(position, pieces, alive, cells):
    """Position and extent [mm] of the pieces in the order of the cells, (4, n): a cell's are neighbours there."""
    used = cells.head[-1]
    sorted_ = np.empty((4, used))
    for k in range(used):
        i = cells.order[k]
        for axis in range(3):
            sorted_[axis, k] = position[axis, i]
        sorted_[3, k] = pieces.radius[i] + pieces.half_piece[i] * stretch_of(reach_of(i, alive, pieces))
    return sorted_


@njit(**PART)
def _pairs_of(first, last, position, pieces, alive, moved, cells, by_cell, skin, pairs, places):
    """Pairs that pieces first..last are in; see :func:`find_pairs`. Returns their number."""
    x, y, z = rows3(position)
    px, py, pz, extent = rows4(by_cell)
    radius, half_piece, exclude, chain, cut = (
        pieces.radius, pieces.half_piece, pieces.exclude, pieces.chain, pieces.cut,
    )  # fmt: skip
    cell_of, shape, head, order = cells
    found = 0
    for q in range(first, last):
        if not moved[q] or cell_of[q] < 0 or alive[q - 1] * alive[q] == 0.0:
            continue
        place = place_of(cell_of[q], shape)
        ends = reach_of(q, alive, pieces)
        xq, yq, zq, reach = x[q], y[q], z[q], radius[q] + half_piece[q] * stretch_of(ends) + skin
        for row in range(GRID_ROWS):
            start, stop = row_near(place, shape, row)
            for k in range(head[start], head[stop]):
                dx, dy, dz, near = px[k] - xq, py[k] - yq, pz[k] - zq, extent[k] + reach
                if dx * dx + dy * dy + dz * dz > near * near:
                    continue
                i, j = min(q, order[k]), max(q, order[k])
                # a pair of two moved pieces is looked at once, from the lower one
                if i == j or (i != q and moved[i]) or (chain[j] == chain[i] and j - i <= exclude[i]):
                    continue
                if cut[i] and cut[j]:
                    continue
                gap = radius[i] + radius[j] + skin
                if alive[i - 1] * alive[i] * alive[j - 1] * alive[j] == 0.0:
                    continue
                of_i, of_j = reach_of(i, alive, pieces), reach_of(j, alive, pieces)
                if _are_apart(x, y, z, i, j, 0.5 * stretch_of(of_i), 0.5 * stretch_of(of_j), gap):
                    continue
                tips = tip_of(of_i), tip_of(of_j)
                at_end = tips[0] != 0.5 or tips[1] != 0.5
                s, t, wx, wy, wz, line = _first_place(x, y, z, i, j, contact_kind(i, j, pieces), at_end)
                of_i, of_j = _limits_of(line, of_i), _limits_of(line, of_j)
                places_of = 1
                if line >= FIRST_ALONG:
                    places_of = 4
                elif line == POINT:
                    of_i, of_j = (
                        _limits_beside_held(of_i, i, j, True, pieces),
                        _limits_beside_held(of_j, j, i, False, pieces),
                    )
                    places_of = 2 if at_end else 1
                for number in range(places_of):
                    if number > 0 and line == POINT:
                        s, t, wx, wy, wz = _second_point(x, y, z, i, j, tips, (s, t))
                    elif number > 0:
                        least = min(radius[i], radius[j])
                        coarse = 2.0 * half_piece[i if line == FIRST_ALONG else j] > COARSE * least
                        s, t, wx, wy, wz = _held_place(x, y, z, i, j, line, number, tips, least, coarse)
                    # found twice, a crossing is tracked once
                    inside = s >= of_i[0] and s <= of_i[1] and t >= of_j[0] and t <= of_j[1]
                    if not inside or wx * wx + wy * wy + wz * wz > gap * gap:
                        continue
                    if found < pairs.shape[0]:
                        pairs[found, 0], pairs[found, 1] = i, j
                        places[found, 0], places[found, 1], places[found, 5] = s, t, line
                        places[found, 2], places[found, 3], places[found, 4] = wx, wy, wz
                    found += 1
    return found


@njit(**PARALLEL)
def find_pairs(position, pieces, alive, moved, cells, skin, pairs, places, found):
    """Pairs of pieces, one of them ``moved``, whose closest points lie on them with a gap below ``skin`` [mm].

    ``position`` (3, n_nodes) [mm]. Fills ``pairs`` (PARTITIONS, capacity, 2) with the pieces i < j, ``places``
    (PARTITIONS, capacity, 6) with parameters s, t, offset (3) [mm] and kind, and ``found`` (PARTITIONS,) with the
    number that each share needs, which may exceed the capacity.
    """
    by_cell, n = _sort_by_cell(position, pieces, alive, cells), moved.size
    for k in prange(PARTITIONS):
        first, last = n * k // PARTITIONS, n * (k + 1) // PARTITIONS
        found[k] = _pairs_of(
            first, last, position, pieces, alive, moved, cells, by_cell, skin, pairs[k], places[k]
        )  # fmt: skip
