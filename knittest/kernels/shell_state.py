"""Arrays of the shells as NamedTuples: laminate, element constants in blocks, incidence of nodes and corners."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from knittest.kernels.options import INLINE, U

Array = NDArray[np.float64]
Index = NDArray[np.int64]

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
