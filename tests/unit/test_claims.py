"""Shares of a parallel loop: each goes to one thread, whichever asks first."""

import numpy as np
from numba import njit, prange

from knittest.kernels.threading import claim, next_partition
from knittest.kernels.vec import PARALLEL, PARTITIONS


@njit(**{**PARALLEL, "cache": False})
def _take_all(threads, sweeps, claimed, taken):
    for sweep in range(sweeps):
        for thread in prange(threads):
            for k in range(PARTITIONS):
                p = next_partition(k, thread, threads)
                if claim(claimed, p, sweep + 1):
                    taken[thread, p] += 1


def test_every_share_is_taken_once_a_sweep():
    """However many threads ask, also more than there are."""
    for threads in (1, 2, 5, 3 * PARTITIONS):
        claimed, taken = np.zeros(PARTITIONS, np.int64), np.zeros((threads, PARTITIONS), np.int64)
        _take_all(threads, 500, claimed, taken)
        assert (taken.sum(axis=0) == 500).all(), threads


def test_a_thread_asks_for_its_own_shares_first():
    halves = [{int(next_partition.py_func(k, thread, 2)) for k in range(PARTITIONS // 2)} for thread in range(2)]
    assert halves[0] | halves[1] == set(range(PARTITIONS))
    assert {int(next_partition.py_func(k, 1, 2)) for k in range(PARTITIONS)} == set(range(PARTITIONS))
