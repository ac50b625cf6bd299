"""Packs loads on single nodes into runs of neighbouring nodes, which the kernel adds without looking anything up."""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.drive_state import Loads

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def in_runs(start: Index, node: Index, dof: Index, table: Index, guides: Index, value: Array) -> Loads:
    """Runs of loads (n,) that are sorted by partition, dof, table and node; ``start`` (PARTITIONS + 1,) of the
    partitions; no table both loads and ``guides``.
    """
    begins = np.ones(len(node), np.bool_)
    begins[1:] = (np.diff(node) != 1) | (np.diff(dof) != 0) | (np.diff(table) != 0)
    begins[start[start < len(node)]] = True
    at = np.flatnonzero(begins)
    length = np.diff(np.append(at, len(node)))
    return Loads(np.searchsorted(at, start), node[at], length, at, dof[at], table[at], guides[at], value)
