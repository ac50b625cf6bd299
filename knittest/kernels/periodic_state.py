"""Images of nodes in a periodic cell, and the lattice that they follow, as a NamedTuple."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: numbers of the lattice: components of its two vectors, then the curvature
LATTICE, CURVATURE = 7, 6
#: columns of ``Images.map``: shift (3), its rate (3), turn, its rate, sine and cosine of the turn, arc that is bent
SHIFT, SHIFT_RATE, TURN, TURN_RATE, SINE, COSINE, ARC = 0, 3, 6, 7, 8, 9, 10
MAP = 11


class Images(NamedTuple):
    """Nodes that are images of others; a model that is not periodic has none.

    Node ``ghost`` follows node ``master``, (n_ghosts,), by the map of its image; its start is turned by ``gauge``
    (4, n_ghosts) from that of its master. ``of`` (n_nodes,) image of every node, 0 for the cell itself; ``times``
    (n_images, 2) how often the lattice vectors lie between; ``map`` (n_images, MAP) where that is now. ``cut`` (n_cut,
    2): beams from a node of the cell to an image, with their section.

    ``lattice`` (7,): both vectors of the fabric laid flat [mm], and its curvature [1/mm] along the first of ``axes``
    (3, 3), rows: along, normal, and the axis of bending. ``rate`` (7,) theirs in the last step, that of ``table``, or
    free with ``inv_mass`` [1/g] where that is not 0; ``pull`` (7,): derivatives of the elastic energy of the cell by
    them, whose sums go to the ``group`` of the reactions (-1: to none).
    """

    ghost: Index
    master: Index
    gauge: Array
    of: Index
    times: Array
    map: Array
    cut: Index
    lattice: Array
    rate: Array
    table: Index
    inv_mass: Array
    axes: Array
    pull: Array
    group: Index
