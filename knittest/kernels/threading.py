"""Threads of the kernels: the layer that runs them, and the shares of a loop that each of them takes."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numba
from numba import config, njit, prange, types
from numba.core import cgutils
from numba.extending import intrinsic

from knittest.base.machine import available_cores
from knittest.kernels.vec import INLINE, PARALLEL, PARTITIONS, SHARED_OUT

# Shares of a parallel loop for whichever thread is free: expensive and cheap ones, busy and idle cores even out.


@intrinsic
def _exchange(typingctx: Any, array: Any, index: Any, value: Any) -> Any:
    """Put ``value`` into ``array[index]`` (int64) at once for all threads; returns what was there."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        kind = signature.args[0]
        place = cgutils.get_item_pointer(
            context, builder, kind, context.make_array(kind)(context, builder, args[0]), [args[1]]
        )
        return builder.atomic_rmw("xchg", place, args[2], "monotonic")

    return types.int64(array, types.intp, types.int64), codegen


@njit(**INLINE)
def claim(claimed, p, sweep):
    """Return whether the caller is the first to ask for partition ``p`` in a ``sweep``, numbered in rising order.

    ``claimed`` (PARTITIONS,) holds the last sweep of each, 0 at the start. A look first spares the others' cache.
    """
    return claimed[p] != sweep and _exchange(claimed, p, sweep) != sweep


@njit(**INLINE)
def next_partition(k, thread, threads):
    """The ``k``-th partition that one of ``threads`` asks for: its own first, then what others have left."""
    return SHARED_OUT[(k + PARTITIONS * thread // threads) % PARTITIONS]


# Chooses threads: a step is short, so only a layer that forks and joins in microseconds pays.


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
    available = min(int(config.NUMBA_NUM_THREADS), available_cores())
    threads = min(wanted or available, int(config.NUMBA_NUM_THREADS))
    return threads if threads == 1 or threading_layer() != "workqueue" else 1


@contextmanager
def limit_threads(threads: int) -> Iterator[None]:
    """Use ``threads`` inside, as many as before after."""
    before = numba.get_num_threads()
    numba.set_num_threads(min(threads, int(config.NUMBA_NUM_THREADS)))
    try:
        yield
    finally:
        numba.set_num_threads(before)
