"""Arrays of the shells as NamedTuples, how they are built from a mesh, and the scratch of a block of shells."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from knittest.base.arrays import Array, Index
from knittest.kernels.vec import INLINE, U, add, load3, rotate, rows3, rows4, store3

#: elements of a block; one row of a block is one quantity of its elements
BLOCK = 64
# rows of the element constants: fibres from diagonals (warp alpha, beta; weft alpha, beta), distortion (c31, c42),
# initial warp [mm], reference area [mm^2], hourglass shape factor [-], initial unit vectors along the normal (3) and
# the warp fibre (3), hourglass shape factors of the membrane [-] along warp and weft, where the fibre (2) and where
# shear resists (2), strength over the laminate's [-], slip of the shear friction [rad], 1 while alive
(
    ALPHA_A, BETA_A, ALPHA_B, BETA_B, C31, C42, WARP, AREA, SHAPE, NORMAL_X, NORMAL_Y, NORMAL_Z,
    FIBRE_X, FIBRE_Y, FIBRE_Z, ALONG_A, ALONG_B, LEAN_A, LEAN_B, STRENGTH, SLIP, ALIVE,
) = (np.uintp(BLOCK * k) for k in range(22))  # fmt: skip
STATE_ROWS = 22
CORNER_ROWS = 24


class Laminate(NamedTuple):
    """Three layers at -layer_offset, 0 and +layer_offset [mm]; warp and weft are entries 0 and 1.

    ``outer`` (2,): stiffness E t of each outer layer [N/mm]. Middle layer: force per width
    compression min(e, 0) + sum_k slope[k] max(e - knee[k], 0) [N/mm], ``compression`` (2,), ``knee``, ``slope``
    (2, n_hinges). Shear S(gamma) [N/mm] under growing shear, odd: E(g) =
    sum_k shear_slope[k] (max(g - shear_knee[k], 0) + min(g + shear_knee[k], 0)), (n_shear,). The share
    ``shear_friction`` of it is friction: a slider of the limit shear_friction |E| behind a spring ``shear_stick``
    [N/mm], in parallel to the elastic rest. ``twist`` [N mm] for twisting, ``transverse`` (2,) for transverse shear
    [N/mm], hourglass stiffnesses of the membrane where fibres lie along the sides (2,) and where they lean against them
    [N/mm], of bending [N mm] and of transverse shear [N/mm], ``drilling`` stiffness of turns about the normal against
    the fibres [N/mm], ``fail_strain`` (2,) of the membrane.
    ``coupling_membrane`` [N/mm]: force of one direction over the strain of the other, and ``coupling_bending`` [N mm]
    likewise, 0 without Poisson coupling. ``in_plane`` (2,) bending stiffness of the yarns in the
    plane, per width [N mm].
    With a law of two strains (:mod:`knittest.kernels.biaxial`) the membrane force is the gradient of ``energy``: its
    control values [N/mm], (cells + 3, cells + 3); ``energy_range`` (2, 5), ``contraction`` (2, cells + 3) [-],
    ``compression_coupling`` [N/mm]; ``energy_tangents`` (2, 2): stiffness of warp and weft that bounds all tangents,
    and all jumps of them where a direction slackens [N/mm]. The hinges are then the law of strips that contract freely.
    """

    layer_offset: float
    outer: Array
    compression: Array
    knee: Array
    slope: Array
    shear_knee: Array
    shear_slope: Array
    shear_friction: float
    shear_stick: float
    twist: float
    transverse: Array
    hourglass_fibre: Array
    hourglass_shear: float
    hourglass_bending: float
    hourglass_transverse: float
    drilling: float
    fail_strain: Array
    coupling_membrane: float = 0.0
    coupling_bending: float = 0.0
    in_plane: Array = np.zeros(2)
    energy: Array | None = None
    energy_range: Array = np.zeros((2, 5))
    contraction: Array = np.zeros((2, 0))
    compression_coupling: float = 0.0
    energy_tangents: Array = np.zeros((2, 2))


class Shells(NamedTuple):
    """Shells in blocks of 64, padded with dead copies of the last one.

    ``conn`` (n_blocks * 64, 4) node numbers; ``state`` (n_blocks * 22 * 64,) the rows above, block by block; ``corner``
    (n_blocks * 24 * 64,) force (3) [N] and moment (3) [N mm] of corner 1, 2, 3, 4; ``node_start`` (n_nodes + 1,) and
    ``node_entry`` say where in ``corner`` the entries of a node begin; ``fail_time`` (n_blocks * 64,) [ms], inf while
    alive, nan for padding.
    """

    conn: NDArray[np.int32]
    state: Array
    corner: Array
    node_start: Index
    node_entry: Index
    fail_time: Array


@njit(**INLINE)
def state_index(e):
    """Index of the first state row of element ``e``; add a row constant to it."""
    return U(e // BLOCK) * U(STATE_ROWS * BLOCK) + U(e % BLOCK)


@njit(**INLINE)
def fibres_of(state, s):
    """Fibres on the diagonals (alpha_a, beta_a, alpha_b, beta_b) [1/mm] of the element at state index ``s``."""
    return state[s + ALPHA_A], state[s + BETA_A], state[s + ALPHA_B], state[s + BETA_B]


@njit(**INLINE)
def distortion_of(state, s):
    """Distortion (c31, c42) [-]."""
    return state[s + C31], state[s + C42]


@njit(**INLINE)
def normal_of(state, s):
    """Initial unit normal."""
    return state[s + NORMAL_X], state[s + NORMAL_Y], state[s + NORMAL_Z]


@njit(**INLINE)
def warp_of(state, s):
    """Initial unit vector along the warp."""
    return state[s + FIBRE_X], state[s + FIBRE_Y], state[s + FIBRE_Z]


@njit(**INLINE)
def hold_of(state, s, laminate):
    """Stiffness [N/mm] of the hourglass pattern of the membrane along warp and weft."""
    fibre, shear = laminate.hourglass_fibre, laminate.hourglass_shear
    warp = state[s + ALONG_A] * fibre[0] + state[s + LEAN_A] * shear
    return warp, state[s + ALONG_B] * fibre[1] + state[s + LEAN_B] * shear


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
    columns = [_diagonal_components(v, x31, x42, normal) for v in (along, np.cross(normal, along), pattern)]
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


def _diagonal_components(vector: Array, x31: Array, x42: Array, normal: Array) -> Array:
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


LANES = np.uintp(BLOCK)
ROW2, ROW3 = np.uintp(2 * BLOCK), np.uintp(3 * BLOCK)
# Rows of the scratch: four rows a corner for positions (the last unused), four for rotations, the first three of which
# become the director; strains of warp and weft, shear angle, forces of the middle layer in warp and weft, shear force,
# energy that shear friction took.
X, D, STRAIN_A, STRAIN_B, ANGLE, MIDDLE_A, MIDDLE_B, SHEAR, RUBBED = (
    np.uintp(BLOCK * k) for k in (0, 16, *range(32, 39))
)
CORNERS = tuple(np.uintp(4 * BLOCK * k) for k in range(4))
SCRATCH = BLOCK * 39
#: first row of each corner in the output
OUT = tuple(np.uintp(6 * BLOCK * k) for k in range(4))


@njit(**INLINE)
def corners(w, i):
    """Positions or directors of the four corners of a lane."""
    return (
        load3(w, i + CORNERS[0], LANES), load3(w, i + CORNERS[1], LANES), load3(w, i + CORNERS[2], LANES),
        load3(w, i + CORNERS[3], LANES),
    )  # fmt: skip


@njit(**INLINE)
def gather(block, nodes, conn, w):
    """Positions and rotations of the corners of a block."""
    x, y, z = rows3(nodes.position)
    qw, qx, qy, qz = rows4(nodes.rotation)
    for k in range(BLOCK):
        for c in range(4):
            n = U(conn[block * BLOCK + k, c])
            i = U(c) * CORNERS[1] + U(k)
            store3(w, X + i, LANES, (x[n], y[n], z[n]))
            store3(w, D + i, LANES, (qw[n], qx[n], qy[n]))
            w[D + i + ROW3] = qz[n]


@njit(**INLINE)
def rotate_vector(w, i, vector):
    """``vector`` as the rotation at ``i`` turns it."""
    return rotate(w[i], w[i + LANES], w[i + ROW2], w[i + ROW3], vector)


@njit(**INLINE)
def add_to_corner(corner, i, force, moment):
    """Add to the force and moment of a corner in the output."""
    store3(corner, i, LANES, add(load3(corner, i, LANES), force))
    store3(corner, i + ROW3, LANES, add(load3(corner, i + ROW3, LANES), moment))
