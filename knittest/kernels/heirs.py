"""Contacts that go on: which of the last search a found one inherits from, each by one heir at most.

``lists`` are the contacts by their first piece: number of the first one of each, and of the one that follows each.
"""

from numba import njit

from knittest.kernels.contact import BESIDE, FIRST_ALONG, POINT, SECOND_ALONG
from knittest.kernels.options import PART

#: distance along both yarns [elements] within which a found crossing is the tracked one
SAME = 0.9
#: the same along a yarn that is held there: at the middles of pieces, and where one begins or its yarn ends
HELD = 0.25


@njit(**PART)
def push(contacts, c, lists):
    """Put contact ``c`` into the ``lists``."""
    head, following = lists
    following[c] = head[contacts.piece[0, c]]
    head[contacts.piece[0, c]] = c


@njit(**PART)
def tracked(contacts, lists, chain, place, near):
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
def _of_another_kind(contacts, lists, chain, taken, place):
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
            if was + line == POINT + BESIDE:
                held = own_first and own_second
            one_pair = chain[first] == chain[i] and chain[contacts.piece[1, c]] == chain[j]
            if was != line and held and one_pair and not taken[c]:
                return c
            c = following[c]
    return -1


@njit(**PART)
def predecessor(contacts, lists, chain, taken, place):
    """Number of the contact that the one found at ``place`` goes on from, which is ``taken`` then, or -1."""
    c = tracked(contacts, lists, chain, place, SAME)
    if c < 0 or taken[c]:
        c = _of_another_kind(contacts, lists, chain, taken, place)
    if c < 0 or taken[c]:
        return -1
    taken[c] = True
    return c
