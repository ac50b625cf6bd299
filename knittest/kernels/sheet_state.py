"""Arrays of the contact of sheets with themselves and each other, as NamedTuples."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class SheetMesh(NamedTuple):
    """Topology of the shells, which stays: ``neighbour`` (n_el, 4) is 4 e + k if corners c, c + 1 of a shell are edge k
    of shell e, -1 at an edge that is free; ``owner`` (n_nodes,) partition of each node; ``stiffness`` (n_nodes,)
    penalty of each [N/mm]. Shells that a node never touches: ``near`` from near_start[node] to near_start[node + 1].
    """

    neighbour: NDArray[np.int32]
    owner: Index
    stiffness: Array
    near_start: Index
    near: NDArray[np.int32]


class SheetContacts(NamedTuple):
    """A node against a shell, in the first ``count`` columns, sorted by node.

    ``node``, ``shell`` and the place ``uv`` (2, n) in [0, 1] on it, from corner 1 towards 2 and 4; ``side`` of the
    shell's normal on which the node belongs, 1 or -1; stretch of the sticking ``spring`` (2, n) in units of the shell's
    sides, so that it turns with the shell; ``slipping`` 1 while the contact slips; ``reach`` [mm] distance at which it
    touches, ``gap`` [mm] its distance, ``cut`` [mm] what the reach lost since it was found; ``force`` [N] and
    ``moment`` [N mm] on the node, (3, n); ``owners`` bits of the partitions whose nodes it loads, 0 where it does not
    touch; ``damping`` [N] is the viscous part of the last force.
    """

    node: Index
    shell: Index
    uv: Array
    side: Array
    spring: Array
    slipping: Array
    reach: Array
    gap: Array
    force: Array
    moment: Array
    owners: Index
    damping: Array
    cut: Array


class SheetLaw(NamedTuple):
    """``thickness`` [mm]; ``viscous`` coefficient over penalty [ms]; Coulomb coefficients before and while slipping."""

    thickness: float
    viscous: float
    static: float
    kinetic: float


def empty_contacts(capacity: int) -> SheetContacts:
    """Room for ``capacity`` contacts."""
    pair, triple = [np.zeros((2, capacity)) for _ in range(2)], [np.zeros((3, capacity)) for _ in range(2)]
    one, whole = [np.zeros(capacity) for _ in range(6)], [np.zeros(capacity, np.int64) for _ in range(3)]
    return SheetContacts(
        whole[0], whole[1], pair[0], one[0], pair[1], one[1], one[2], one[3], triple[0], triple[1], whole[2],
        one[4], one[5],
    )  # fmt: skip


#: a model whose sheets do not see each other
NO_MESH = SheetMesh(
    np.zeros((0, 4), np.int32), np.zeros(0, np.int64), np.zeros(0), np.zeros(1, np.int64), np.zeros(0, np.int32)
)
NO_LAW = SheetLaw(0.0, 0.0, 0.0, 0.0)
