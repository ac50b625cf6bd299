"""Pieces of yarns that lie along others that they bend round, and the transfer of contacts to the next search.

Bent about the axis of another, a yarn is as near to it all along: closest points run or split, and one contact would
let it penetrate beside. Such pieces are marked with the yarns they lie along, and pressed one by one at their middles.
"""

from typing import NamedTuple

from numba import njit

from knittest.base.arrays import Array, Flags, Index
from knittest.kernels.contact import FIRST_ALONG, POINT, SECOND_ALONG, SIDE_BY_SIDE, bend_of, tangent_of
from knittest.kernels.vec import KERNEL, PART, U, add, at3, dot, rows3

#: determinant of the second derivatives of half the squared distance, over both tangents squared, below which yarns at
#: a point wrap each other where one bends by more than 1 - BENDS over the distance; marks go on while a yarn bends by
#: more than 1 - UNWRAPS
WRAPS, BENDS, UNWRAPS = 0.02, 0.7, 0.85
#: the second yarn lies along the first if it bends by this more over the distance
SECOND_BENDS = 0.01
#: pieces marked on either side of one that bends round: they come to lie along before they touch
SPREAD = 2
#: yarns that a piece may lie along
MOST = 4


class Pieces(NamedTuple):
    """Pieces of yarns, (n_nodes,) each: ``radius`` and ``half_piece`` length [mm], the number of pieces along its yarn
    that it never touches (``exclude``), its ``chain``, whether it is ``cut`` off there: no two of those touch, and the
    piece of a periodic cell that it copies (``master``), by which ``along`` (n_nodes, :data:`MOST`) has the chains of
    those that it lies along, -1 for none. ``ends``: yarns end where their chains do; those of a periodic cell go on.
    """

    radius: Array
    half_piece: Array
    exclude: Index
    chain: Index
    cut: Flags
    master: Index
    along: Index
    ends: bool = True


@njit(**PART)
def _lies_along(i, j, pieces):
    """Return whether piece ``i`` lies along the yarn of piece ``j``, or a copy of either does."""
    row, yarn = pieces.along[pieces.master[i]], pieces.chain[pieces.master[j]]
    return row[0] == yarn or row[1] == yarn or row[2] == yarn or row[3] == yarn


@njit(**PART)
def contact_kind(i, j, pieces):
    """Kind of a contact of pieces ``i`` and ``j`` by their marks; :data:`POINT` where none lies along the other.

    Where both do, that of the lower master is held, whichever copy it is. A piece does not lie along its own image.
    """
    if pieces.master[i] == pieces.master[j]:
        return POINT
    first, second = _lies_along(i, j, pieces), _lies_along(j, i, pieces)
    if first and (not second or pieces.master[i] < pieces.master[j]):
        return FIRST_ALONG
    return SECOND_ALONG if second else POINT


@njit(**PART)
def is_other_kind(line, i, j, pieces):
    """Return whether a contact of the kind ``line`` of pieces ``i`` and ``j`` is one of another kind by their marks."""
    held = contact_kind(i, j, pieces)
    return held != line and (held != POINT or line >= FIRST_ALONG)


@njit(**PART)
def _mark_piece(i, j, pieces):
    """Mark piece ``i`` and those beside it as lying along the yarn of ``j``; returns how many marks are new."""
    new, yarn = 0, pieces.chain[pieces.master[j]]
    for k in range(max(i - SPREAD, 0), min(i + SPREAD + 1, pieces.chain.size)):
        if pieces.chain[k] != pieces.chain[i] or _lies_along(k, j, pieces):
            continue
        row = pieces.along[pieces.master[k]]
        for slot in range(MOST):
            if row[slot] < 0:
                row[slot] = yarn
                new += 1
                break
    return new


@njit(**PART)
def mark_line_contact(place, to_first, to_second, line, x, pieces):
    """Mark what bends round the other at ``place``, pieces i, j at s, t.

    ``to_first`` is the offset (3) [mm] from the centre of curvature of the second section to the first centre-line,
    ``to_second`` from the second centre-line to that of the first section: alike for circles. Returns how many marks
    are new.
    """
    i, j, s, t = place
    u, v = tangent_of(U(i), s, x), tangent_of(U(j), t, x)
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    first, second = 1.0 + dot(to_first, bend_of(U(i), x)) / uu, 1.0 - dot(to_second, bend_of(U(j), x)) / vv
    if line == FIRST_ALONG:
        return _mark_piece(i, j, pieces) if first < UNWRAPS else 0
    if line == SECOND_ALONG:
        return _mark_piece(j, i, pieces) if second < UNWRAPS else 0
    least = min(first, second)
    wraps = least < 0.0 or first * second - uv * uv / (uu * vv) < WRAPS
    if line == SIDE_BY_SIDE or least > BENDS or not wraps:
        return 0
    return _mark_piece(j, i, pieces) if second < first - SECOND_BENDS else _mark_piece(i, j, pieces)


@njit(**KERNEL)
def mark_tracked(contacts, count, position, pieces):
    """Mark the pieces that lie along others by the first ``count`` contacts; returns how many marks are new."""
    x, offset, new = rows3(position), rows3(contacts.offset), 0
    shift, other = rows3(contacts.shift), rows3(contacts.other)
    for c in range(count):
        place = (contacts.piece[0, c], contacts.piece[1, c], contacts.parameter[0, c], contacts.parameter[1, c])
        to_first = to_second = at3(offset, c)
        if contacts.touch.size > 0:
            to_first, to_second = add(to_first, at3(shift, c)), add(to_second, at3(other, c))
        new += mark_line_contact(place, to_first, to_second, contacts.line[c], x, pieces)
    return new


@njit(**KERNEL)
def mark_found(pairs, places, found, position, excess, pieces):
    """Mark the pieces that lie along others by pairs of circles just found; returns how many marks are new.

    ``excess`` (n_nodes,) of the sections says which are ellipses; empty if none is.
    """
    x, new = rows3(position), 0
    for share in range(found.size):
        for k in range(found[share]):
            i, j, at = pairs[share, k, 0], pairs[share, k, 1], places[share, k]
            if excess.size > 0 and (excess[i] != 0.0 or excess[j] != 0.0):
                continue
            place = (i, j, at[0], at[1])
            offset = (at[2], at[3], at[4])
            new += mark_line_contact(place, offset, offset, at[5], x, pieces)
    return new


@njit(**KERNEL)
def flag_other_kinds(contacts, count, pieces, moved):
    """Flag as ``moved`` the pieces of the first ``count`` contacts that are another kind by marks: found anew."""
    for c in range(count):
        i, j = contacts.piece[0, c], contacts.piece[1, c]
        if is_other_kind(contacts.line[c], i, j, pieces):
            moved[i] = moved[j] = True


# Contacts that continue: the one of the last search that a found contact inherits from; each has one heir at most.
#
# ``lists`` are the contacts by their first piece: number of the first one of each, and of the one that follows each.

#: distance along both yarns [elements] within which a found crossing is the tracked one
SAME = 0.9
#: the same along a yarn that is held there: at the middles of pieces, and where one begins or its yarn ends
HELD = 0.25


@njit(**PART)
def add_to_lists(contacts, c, lists):
    """Put contact ``c`` into the ``lists``."""
    head, following = lists
    following[c] = head[contacts.piece[0, c]]
    head[contacts.piece[0, c]] = c


@njit(**PART)
def find_tracked(contacts, lists, chain, place, near):
    """Number of the contact of the kind within ``near`` elements of ``place``, pieces i, j at s, t and kind, or -1."""
    head, following = lists
    i, j, s, t, line = place
    near_first = HELD if line == FIRST_ALONG else near
    near_second = HELD if line == SECOND_ALONG else near
    for first in range(max(i - 1, 0), min(i + 2, chain.size)):
        c = head[first]
        while c >= 0:
            if (
                contacts.line[c] == line
                and chain[contacts.piece[0, c]] == chain[i]
                and chain[contacts.piece[1, c]] == chain[j]
                and abs(contacts.piece[0, c] + contacts.parameter[0, c] - i - s) < near_first
                and abs(contacts.piece[1, c] + contacts.parameter[1, c] - j - t) < near_second
            ):
                return c
            c = following[c]
    return -1


@njit(**PART)
def _find_other_kind(contacts, lists, chain, taken, place):
    """Number of the contact of another kind at ``place`` whose piece is the one that the one or the other holds, or -1.

    Between a point and one beside both pieces are to be the same. None that is ``taken``.
    """
    head, following = lists
    i, j, s, t, line = place
    for first in range(max(i - 1, 0), min(i + 2, chain.size)):
        c = head[first]
        while c >= 0:
            was = contacts.line[c]
            holds_second = (was if line == POINT else line) == SECOND_ALONG
            near_first = abs(contacts.piece[0, c] + contacts.parameter[0, c] - i - s) < SAME
            near_second = abs(contacts.piece[1, c] + contacts.parameter[1, c] - j - t) < SAME
            own_first, own_second = contacts.piece[0, c] == i, contacts.piece[1, c] == j
            held = near_first and own_second if holds_second else own_first and near_second
            if was + line == POINT + SIDE_BY_SIDE:
                held = own_first and own_second
            one_pair = chain[first] == chain[i] and chain[contacts.piece[1, c]] == chain[j]
            if was != line and held and one_pair and not taken[c]:
                return c
            c = following[c]
    return -1


@njit(**PART)
def predecessor(contacts, lists, chain, taken, place):
    """Number of the contact that the one found at ``place`` goes on from, which is ``taken`` then, or -1."""
    c = find_tracked(contacts, lists, chain, place, SAME)
    if c < 0 or taken[c]:
        c = _find_other_kind(contacts, lists, chain, taken, place)
    if c < 0 or taken[c]:
        return -1
    taken[c] = True
    return c
