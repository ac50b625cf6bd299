"""Arrays of the fibres' bending in the plane of the shells as a NamedTuple: stencils of nodes, in blocks."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.options import PARTITIONS

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: stencils of a block; one row is one quantity of its stencils
BLOCK = 64
#: rows of weights of a member: warp and weft fibre [1/mm], their second derivatives [1/mm^2]
WEIGHTS = 4
#: how a weight of a row of members is spread: not at all, the same for all stencils of the block, or each its own
NOWHERE, SAME, OWN_EACH = 0, 1, 2


class Bends(NamedTuple):
    """Stencils in blocks of 64 of equal size, padded with dead copies of the last one of a block.

    A stencil gives both fibres and their second derivatives at its node as sums of weights times positions of its
    members. ``member`` (n_rows, 64) node numbers, block b owns rows first[b] to first[b + 1]; ``weight``
    (n_rows * 4 * 64,), see :data:`WEIGHTS`, and how each is ``spread`` (n_rows, 4), see :data:`SAME`; ``force``
    (n_rows * 3 * 64,) [N] on each member; ``node_start`` (n_nodes + 1,) and ``node_entry`` say where in ``force`` the
    entries of a node are. ``natural`` (2, n) curvature of warp and weft at rest [1/mm], ``stiffness`` (2, n) bending
    stiffness per width times area [N mm^3], ``alive`` (n,) 1 until a shell round the node breaks, n = 64 n_blocks.
    Shells round stencil s are around[around_start[s]] to around[around_start[s + 1]]. ``broken`` (PARTITIONS,) is above
    0 once a partition has lost a shell.
    """

    member: NDArray[np.int32]
    first: Index
    weight: Array
    spread: NDArray[np.int8]
    force: Array
    node_start: Index
    node_entry: Index
    natural: Array
    stiffness: Array
    alive: Array
    around: NDArray[np.int32]
    around_start: Index
    broken: Array


def no_bends() -> Bends:
    """Shells whose fibres do not bend in the plane."""
    none, start = np.zeros(0), np.zeros(1, np.int64)
    return Bends(
        np.zeros((0, BLOCK), np.int32), start, none, np.zeros((0, WEIGHTS), np.int8), none.copy(),
        start.copy(), start[:0].copy(), np.zeros((2, 0)), np.zeros((2, 0)), none.copy(), np.zeros(0, np.int32),
        start.copy(), np.zeros(PARTITIONS),
    )  # fmt: skip
