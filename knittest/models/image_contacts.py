"""One contact of a periodic cell is tracked wherever it touches a node of the cell; all its copies go on as one."""

import numpy as np

from knittest.base.arrays import Array, Flags, Index
from knittest.kernels.search import MERGE
from knittest.kernels.state import TURN, Contacts, Images

#: state of a contact: numbers, and vectors that point from piece j to piece i
NUMBERS = ("slipping", "reach", "twist", "couple", "accepted")
VECTORS = ("spring", "offset", "force")
#: numbers of the kinds of contacts, and of those the other way round: yarns side by side hold the parameter of piece i,
#: so that they are another contact then, while a yarn along another is held whichever it is
LINES = np.array([[0.0, 1.0, 2.0, 3.0], [0.0, 4.0, 3.0, 2.0]])


def masters(images: Images) -> Index:
    """Node that every node is, or is an image of, (n_nodes,)."""
    found = np.arange(images.of.size)
    found[images.ghost] = images.master
    return found


def share_states(contacts: Contacts, count: int, images: Images, master: Index) -> None:
    """Let all copies of a contact among the first ``count`` go on from the state of the one that is loaded.

    A copy whose piece comes to touch the cell as the contact slides is found later than the others, and would start
    from its gap without friction: both yarns would feel different forces, and make momentum and energy of their own.
    ``master`` as :func:`masters` gives it.
    """
    if count < 2:
        return
    swapped, of, key = _crossings(contacts, count, images, master)
    crossing = _numbers(contacts, count, images, master, swapped, key)
    fresh = (contacts.force[:, :count] == 0.0).all(axis=0)
    # of those without force one that knows the overlap of the start goes before those that do not, and one that
    # inherited its depth before those that begin at their gap
    depth = contacts.reach[:count] - np.linalg.norm(contacts.offset[:, :count], axis=0)
    accepted = contacts.accepted[:count]
    best = np.lexsort(
        (np.arange(count), np.where(fresh, -depth, 0.0), np.where(fresh, -accepted, 0.0), fresh, crossing)
    )
    source = best[np.unique(crossing[best], return_index=True)[1]][crossing]
    copies = np.flatnonzero(source != np.arange(count))
    _copy(contacts, source[copies], copies, swapped[source[copies]] != swapped[copies], of, images)


def _numbers(contacts: Contacts, count: int, images: Images, master: Index, swapped: Flags, key: Array) -> Index:
    """Number of the crossing of every contact, (count,), from its ``key``.

    A contact at the beginning of a piece is one at the end of the piece before it too: copies may be found on either.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    begins = contacts.parameter[:, :count] < MERGE
    rows, owner = [key], [np.arange(count)]
    for before in ((1, 0), (0, 1), (1, 1)):
        flipped, _, other = _crossings(contacts, count, images, master, before)
        there = np.flatnonzero(begins[np.flatnonzero(before)].all(axis=0) & (flipped == swapped))
        rows.append(other[:, there])
        owner.append(there)
    every, of = np.hstack(rows), np.concatenate(owner)
    order = np.lexsort(every)
    equal = np.ones(order.size - 1, np.bool_)
    for column, most in zip(every, (MERGE, MERGE, *[0.0] * (len(every) - 2)), strict=True):
        equal &= np.abs(np.diff(column[order])) <= most
    first, second = of[order[:-1][equal]], of[order[1:][equal]]
    graph = coo_array((np.ones(first.size), (first, second)), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def _crossings(
    contacts: Contacts, count: int, images: Images, master: Index, before: tuple[int, int] = (0, 0)
) -> tuple[Flags, Index, Array]:
    """Contacts whose pieces are the other way round than in their crossing, (count,), the image that its first yarn is
    in, and (7, count) what copies of one crossing have in common: both parameters, kind, images between, masters.

    Sides with 1 in ``before`` are taken from the piece before their own.
    """
    back = np.array(before)[:, None]
    piece, parameter, every = contacts.piece[:, :count] - back, contacts.parameter[:, :count] + back, np.arange(count)
    node = master[piece]
    apart = images.times[images.of[piece[1]]] - images.times[images.of[piece[0]]]
    backward = (apart[:, 0] < 0.0) | ((apart[:, 0] == 0.0) & (apart[:, 1] < 0.0))
    swapped = (node[0] > node[1]) | ((node[0] == node[1]) & backward)
    first = swapped.astype(np.int64)
    apart[swapped] *= -1.0
    line = LINES[first, contacts.line[:count].astype(np.int64)]
    s, t = parameter[first, every], parameter[1 - first, every]
    key = np.array([t, s, line, apart[:, 0], apart[:, 1], node[1 - first, every], node[first, every]])
    return swapped, images.of[piece[first, every]], key


def _copy(contacts: Contacts, source: Index, copies: Index, swapped: Flags, of: Index, images: Images) -> None:
    """Copy what ``source`` remembers to ``copies``, with the images that they are in, ``swapped`` end for end."""
    sign = np.where(swapped, -1.0, 1.0)
    for name in NUMBERS:
        row = getattr(contacts, name)
        row[copies] = row[source]
    side = np.where(swapped, [[1], [0]], [[0], [1]])
    theirs = contacts.parameter[side, source]
    contacts.parameter[:, copies] = theirs + np.rint(contacts.parameter[:, copies] - theirs)  # on their own piece
    contacts.arm[copies] = np.where(swapped, 1.0 - contacts.arm[source], contacts.arm[source])
    for name in VECTORS:
        rows = getattr(contacts, name)
        rows[:, copies] = sign * _rotate_to_images(rows[:, source], of[source], of[copies], images)
    tangents = [
        _rotate_to_images(r[:, source], of[source], of[copies], images)
        for r in (contacts.tangent, contacts.other_tangent)
    ]
    contacts.tangent[:, copies] = np.where(swapped, tangents[1], tangents[0])
    contacts.other_tangent[:, copies] = np.where(swapped, tangents[0], tangents[1])
    if contacts.touch.size:
        contacts.touch[copies] = contacts.touch[source]
        shifts = [
            _rotate_to_images(rows[:, source], of[source], of[copies], images)
            for rows in (contacts.shift, contacts.other)
        ]
        contacts.shift[:, copies] = np.where(swapped, -shifts[1], shifts[0])
        contacts.other[:, copies] = np.where(swapped, -shifts[0], shifts[1])


def _rotate_to_images(vectors: Array, before: Index, after: Index, images: Images) -> Array:
    """``vectors`` (3, n) of contacts of the images ``before`` as they are in the images ``after``."""
    axis = images.axes[2][:, None]
    turn = images.map[after, TURN] - images.map[before, TURN]
    along = axis * (axis * vectors).sum(axis=0)
    across = np.cross(axis, vectors, axis=0)
    return np.asarray(along + np.cos(turn) * (vectors - along) + np.sin(turn) * across)
