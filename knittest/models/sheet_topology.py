"""Neighbours of shells: across edges, and within a distance along the sheet."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from knittest.base.errors import InputError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def edge_neighbours(cells: Index) -> NDArray[np.int32]:
    """For edge c of shell e, from corner c to c + 1: 4 e' + c' of the same edge of its neighbour, -1 at a free edge.

    ``cells`` (n_el, 4). Raises :class:`InputError` for more than two shells at an edge, or neighbours that turn in
    opposite senses: such a surface has no sides.
    """
    start, end = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    key = np.minimum(start, end) * (int(cells.max()) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    if (count > 2).any():
        edge = order[first[np.argmax(count)]]
        raise InputError(f"more than two shells meet between nodes {start[edge]} and {end[edge]}: expected one or two")
    one, other = order[first[count == 2]], order[first[count == 2] + 1]
    if (wrong := start[one] == start[other]).any():
        a, b = one[np.argmax(wrong)] // 4, other[np.argmax(wrong)] // 4
        raise InputError(f"shells {a} and {b} turn in opposite senses: expected the corners of all in one sense")
    found = np.full(cells.size, -1)
    found[one], found[other] = other, one
    return np.ascontiguousarray(found.reshape(cells.shape).astype(np.int32))


def near_shells(points: Array, cells: Index, distance: float) -> tuple[Index, NDArray[np.int32]]:
    """Shells that each node can reach along the sheet without leaving a ball of radius ``distance`` [mm] round it.

    ``points`` (n, 3) [mm], ``cells`` (n_el, 4). Starts (n + 1,) and shell numbers as compressed rows; those round the
    node are always among them.
    """
    n, n_el = len(points), len(cells)
    incidence = sparse.csr_matrix((np.ones(4 * n_el), (cells.ravel(), np.repeat(np.arange(n_el), 4))), (n, n_el))
    adjacent = (incidence @ incidence.T).astype(bool)
    ball, size = sparse.identity(n, dtype=bool, format="csr"), 0
    while ball.nnz > size:
        size = ball.nnz
        pairs = (ball @ adjacent).tocoo()
        inside = np.linalg.norm(points[pairs.row] - points[pairs.col], axis=1) <= distance
        inside |= pairs.row == pairs.col
        rows = (np.ones(int(inside.sum()), bool), (pairs.row[inside], pairs.col[inside]))
        ball = sparse.csr_matrix(rows, (n, n))
    near = sparse.csr_matrix(ball.astype(float) @ incidence)
    return near.indptr.astype(np.int64), near.indices.astype(np.int32)
