"""Builds the arrays of the shells from a mesh: element constants in blocks, and who touches which node."""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.shell_state import BLOCK, CORNER_ROWS, STATE_ROWS, STRENGTH, Array, Index, Shells

#: lean of a fibre against a side [rad], of a square, at which its part in the hourglass control has fallen to 1 / e: a
#: net of squares shaken by 0.15 of a side each way locks at 8 deg (force 17 % too large), little at 1 deg (4 %)
LEAN = float(np.deg2rad(0.5))


def build_shells(position: Array, conn: NDArray[np.integer], warp: Array) -> Shells:
    """Shells at rest in ``position`` (n_nodes, 3) [mm] with corners ``conn`` (n_el, 4).

    ``warp`` is the direction of the warp, (3,) or (n_el, 3), projected onto each element; the weft crosses it at a
    right angle, so that warped elements are free of shear.
    """
    n_el, n_blocks = len(conn), -(-len(conn) // BLOCK)
    rows = np.zeros((n_blocks * BLOCK, STATE_ROWS))
    rows[:n_el] = _element_constants(position[conn], warp)
    rows[n_el:, :-1] = rows[n_el - 1, :-1]
    padded = np.concatenate([conn, np.repeat(conn[-1:], len(rows) - n_el, axis=0)]).astype(np.int32)
    node_start, node_entry = _incidence(np.asarray(conn), len(position))
    return Shells(
        conn=np.ascontiguousarray(padded),
        state=np.ascontiguousarray(rows.reshape(n_blocks, BLOCK, STATE_ROWS).transpose(0, 2, 1)).ravel(),
        corner=np.zeros(n_blocks * CORNER_ROWS * BLOCK),
        node_start=node_start,
        node_entry=node_entry,
        fail_time=np.where(np.arange(len(rows)) < n_el, np.inf, np.nan),
    )


def set_strength(shells: Shells, strength: Array) -> None:
    """Set the strength of each element over the laminate's fracture strains [-], (n_el,)."""
    blocks = shells.state.reshape(-1, STATE_ROWS, BLOCK)
    rows = blocks[:, int(STRENGTH) // BLOCK]
    block, lane = np.divmod(np.arange(len(strength)), BLOCK)
    rows[block, lane] = strength


def _element_constants(corners: Array, warp: Array) -> Array:
    """Rows ALPHA_A to ALIVE of elements with ``corners`` (n_el, 4, 3), (n_el, 22)."""
    x31, x42 = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    pattern = corners[:, 0] - corners[:, 1] + corners[:, 2] - corners[:, 3]
    normal = np.cross(x31, x42)
    area = 0.5 * np.linalg.norm(normal, axis=1)
    normal /= 2.0 * area[:, None]
    along = np.broadcast_to(warp, normal.shape)
    along = along - np.sum(along * normal, axis=1)[:, None] * normal
    along /= np.linalg.norm(along, axis=1)[:, None]
    shape = (np.sum(x31**2, axis=1) + np.sum(x42**2, axis=1)) / (4.0 * area)
    columns = [_on_diagonals(v, x31, x42, normal) for v in (along, np.cross(normal, along), pattern)]
    hold = area[:, None] * _hourglass_shares(columns[0], columns[1])
    initial_warp = np.sum(normal * pattern, axis=1)
    one = np.ones(len(area))
    return np.column_stack([*columns, initial_warp, area, shape, normal, along, hold, one, 0.0 * one, one])


def _hourglass_shares(warp: Array, weft: Array) -> Array:
    """Twelve times the mean squares [1/mm^2] of what the hourglass pattern of the corners does, a unit of it along a
    fibre: stretch of warp and weft, and shear by a unit along warp and weft, (n, 4).

    A fibre a = a1 s1 + a2 s2 on the sides s1, s2 feels p (a1 eta + a2 xi) of the pattern p xi eta. Where it lies along
    a side, that varies across it: the sides stretch, as in bending in the plane. Where it leans, it varies along the
    fibre too, which locks nets: yarns may kink within a shell. Only shear resists there.
    """
    first, second = (np.array([f[:, 0] - f[:, 1], f[:, 0] + f[:, 1]]) for f in (warp, weft))
    across = (first[0] * second[1] + first[1] * second[0]) ** 2
    shares = []
    for fibre, other in ((first, second), (second, first)):
        along = (2.0 * fibre[0] * fibre[1]) ** 2
        aligned = np.exp(-along / (across + along) / (2.0 * LEAN) ** 2)
        shares.append((aligned * (fibre**2).sum(axis=0), (1.0 - aligned) * (other**2).sum(axis=0)))
    return np.column_stack([*(s[0] for s in shares), *(s[1] for s in shares)])


def _on_diagonals(vector: Array, x31: Array, x42: Array, normal: Array) -> Array:
    """Components (n, 2) with vector = alpha x31 + beta x42 in the plane across ``normal``."""
    double_area = np.sum(np.cross(x31, x42) * normal, axis=1)
    alpha = np.sum(np.cross(vector, x42) * normal, axis=1) / double_area
    beta = np.sum(np.cross(x31, vector) * normal, axis=1) / double_area
    return np.column_stack([alpha, beta])


def _incidence(conn: NDArray[np.integer], n_nodes: int) -> tuple[Index, Index]:
    """For each node, where in ``corner`` its entries begin, in the order of elements (compressed rows)."""
    element, corner = np.divmod(np.arange(conn.size), 4)
    block, lane = np.divmod(element, BLOCK)
    entry = (block * CORNER_ROWS + corner * 6) * BLOCK + lane
    order = np.argsort(conn.ravel(), kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(conn.ravel(), minlength=n_nodes))])
    return start.astype(np.int64), entry[order].astype(np.int64)
