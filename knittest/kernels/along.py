"""Pieces that lie along another yarn, around which they bend: which do, and which contacts give way to theirs.

A yarn that bends around another by the radius of their distance is as near to it all along: no closest point is left,
and one that was followed would run away and let the rest sink in. Such pieces have a contact each, at their middle.
"""

from numba import njit

from knittest.kernels.contact import FIRST_ALONG, SECOND_ALONG
from knittest.kernels.options import KERNEL

#: pieces beyond one that lies along another yarn that go on to do so
BESIDE_ALONG = 2


@njit(**KERNEL)
def mark_along(contacts, count, yarn, along):
    """Fill ``along`` (n,) with the yarn that pieces lie along by the tracked contacts, they or one near; -1: none.

    ``yarn`` (n,) of the nodes: a chain, with all its images in a periodic cell.
    """
    along[:] = -1
    for away in range(BESIDE_ALONG + 1):  # what lies along a yarn itself comes first, then what is beside it
        for c in range(count):
            line = contacts.line[c]
            if line != FIRST_ALONG and line != SECOND_ALONG:
                continue
            side = 0 if line == FIRST_ALONG else 1
            i, j = contacts.piece[side, c], contacts.piece[1 - side, c]
            for h in (i - away, i + away):
                if 0 <= h < yarn.size and along[h] < 0 and yarn[h] == yarn[i]:
                    along[h] = yarn[j]


@njit(**KERNEL)
def mark_found(pairs, places, found, yarn, along):
    """Fill ``along`` (n,) with the yarn along which every piece was found to lie; -1: none."""
    along[:] = -1
    for share in range(found.size):
        for k in range(found[share]):
            i, j, line = pairs[share, k, 0], pairs[share, k, 1], places[share, k, 5]
            if i >= 0 and line == FIRST_ALONG:
                along[i] = yarn[j]
            if i >= 0 and line == SECOND_ALONG:
                along[j] = yarn[i]
