"""Chooses threads: a step is short, so only a layer that forks and joins in microseconds pays."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

import numba
from numba import config, njit, prange

from knittest.kernels.options import PARALLEL


@njit(**PARALLEL)
def _fork(out):
    for i in prange(out.size):
        out[i] = i


def threading_layer() -> str:
    """Name of the layer Numba uses: omp, tbb or workqueue (55 us a fork, measured; omp 1 us)."""
    import numpy as np

    _fork(np.zeros(2))
    return str(numba.threading_layer())


def best_threads(wanted: int | None) -> int:
    """Threads to use: ``wanted`` or all cores this process may use, one if only the slow workqueue layer is there."""
    available = min(int(config.NUMBA_NUM_THREADS), len(os.sched_getaffinity(0)))
    threads = min(wanted or available, int(config.NUMBA_NUM_THREADS))
    return threads if threads == 1 or threading_layer() != "workqueue" else 1


@contextmanager
def limited(threads: int) -> Iterator[None]:
    """Use ``threads`` inside, as many as before after."""
    before = numba.get_num_threads()
    numba.set_num_threads(min(threads, int(config.NUMBA_NUM_THREADS)))
    try:
        yield
    finally:
        numba.set_num_threads(before)
