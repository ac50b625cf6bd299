"""One contact of a periodic cell is tracked wherever it touches a node of the cell; all its copies go on as one."""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.periodic_state import TURN, Images
from knittest.kernels.search import MERGE
from knittest.kernels.state import Contacts

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: what a contact remembers: numbers, and vectors that point from piece j to piece i
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
    order = np.lexsort(key)
    changes = np.zeros(count, np.bool_)
    for column, most in zip(key, (MERGE, MERGE, *[0.0] * (len(key) - 2)), strict=True):
        changes[1:] |= np.abs(np.diff(column[order])) > most
    crossing = np.empty(count, np.int64)
    crossing[order] = np.cumsum(changes)
    fresh = (contacts.force[:, :count] == 0.0).all(axis=0)
    # of those that look back on no step one that inherited its depth goes before those that did not
    depth = contacts.reach[:count] - np.linalg.norm(contacts.offset[:, :count], axis=0)
    best = np.lexsort((np.arange(count), np.where(fresh, -depth, 0.0), fresh, crossing))
    source = best[np.unique(crossing[best], return_index=True)[1]][crossing]
    copies = np.flatnonzero(source != np.arange(count))
    _copy(contacts, source[copies], copies, swapped[source[copies]] != swapped[copies], of, images)


def _crossings(contacts: Contacts, count: int, images: Images, master: Index) -> tuple[NDArray[np.bool_], Index, Array]:
    """Contacts whose pieces are the other way round than in their crossing, (count,), the image that its first yarn is
    in, and (7, count) what copies of one crossing have in common: both parameters, kind, images between, masters.
    """
    piece, every = contacts.piece[:, :count], np.arange(count)
    node = master[piece]
    apart = images.times[images.of[piece[1]]] - images.times[images.of[piece[0]]]
    backward = (apart[:, 0] < 0.0) | ((apart[:, 0] == 0.0) & (apart[:, 1] < 0.0))
    swapped = (node[0] > node[1]) | ((node[0] == node[1]) & backward)
    first = swapped.astype(np.int64)
    apart[swapped] *= -1.0
    line = LINES[first, contacts.line[:count].astype(np.int64)]
    s, t = contacts.parameter[first, every], contacts.parameter[1 - first, every]
    key = np.array([t, s, line, apart[:, 0], apart[:, 1], node[1 - first, every], node[first, every]])
    return swapped, images.of[piece[first, every]], key


def _copy(
    contacts: Contacts, source: Index, copies: Index, swapped: NDArray[np.bool_], of: Index, images: Images
) -> None:
    """Copy what ``source`` remembers to ``copies``, with the images that they are in, ``swapped`` end for end."""
    sign = np.where(swapped, -1.0, 1.0)
    for name in NUMBERS:
        row = getattr(contacts, name)
        row[copies] = row[source]
    side = np.where(swapped, [[1], [0]], [[0], [1]])
    contacts.parameter[:, copies] = contacts.parameter[side, source]
    contacts.arm[copies] = np.where(swapped, 1.0 - contacts.arm[source], contacts.arm[source])
    for name in VECTORS:
        rows = getattr(contacts, name)
        rows[:, copies] = sign * _turned(rows[:, source], of[source], of[copies], images)
    tangents = [
        _turned(r[:, source], of[source], of[copies], images) for r in (contacts.tangent, contacts.other_tangent)
    ]
    contacts.tangent[:, copies] = np.where(swapped, tangents[1], tangents[0])
    contacts.other_tangent[:, copies] = np.where(swapped, tangents[0], tangents[1])
    if contacts.touch.size:
        contacts.touch[copies] = contacts.touch[source]
        shifts = [_turned(rows[:, source], of[source], of[copies], images) for rows in (contacts.shift, contacts.other)]
        contacts.shift[:, copies] = np.where(swapped, -shifts[1], shifts[0])
        contacts.other[:, copies] = np.where(swapped, -shifts[0], shifts[1])


def _turned(vectors: Array, before: Index, after: Index, images: Images) -> Array:
    """``vectors`` (3, n) of contacts of the images ``before`` as they are in the images ``after``."""
    axis = images.axes[2][:, None]
    turn = images.map[after, TURN] - images.map[before, TURN]
    along = axis * (axis * vectors).sum(axis=0)
    across = np.cross(axis, vectors, axis=0)
    return np.asarray(along + np.cos(turn) * (vectors - along) + np.sin(turn) * across)
