"""Forces of a test from motions and reaction impulses of the nodes that it moves, in a run of another solver."""

from typing import NamedTuple

import numpy as np

from knittest.base.history import Array
from knittest.experiment.time_history import NodeHistory


class Reactions(NamedTuple):
    """Means between two times, (n,) each: middle ``time`` [ms], ``force`` (n, 2) [N] along x and y on all nodes, their
    ``work`` [mJ], and displacement ``moved`` (n, n_nodes, 2) [mm].
    """

    time: Array
    force: Array
    work: Array
    moved: Array


def reactions_of(history: NodeHistory) -> Reactions:
    """Differentiate the impulses of ``history``; forces act on the specimen: their total work is positive."""
    step = np.diff(history.time)
    force = np.diff(history.impulse, axis=0) / step[:, None, None]
    work = (force * np.diff(history.displacement, axis=0)).sum(axis=(1, 2))
    sign = 1.0 if work.sum() >= 0.0 else -1.0
    time, moved = (0.5 * (a[1:] + a[:-1]) for a in (history.time, history.displacement))
    return Reactions(time, sign * force.sum(axis=1), sign * work, moved)
