"""Shares of a parallel loop for whichever thread is free: expensive and cheap ones, busy and idle cores even out."""

from typing import Any

from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

from knittest.kernels.options import INLINE, PARTITIONS, SHARED_OUT


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
    """Tell whether the caller is the first to ask for partition ``p`` in a ``sweep``, a number above that of the last.

    ``claimed`` (PARTITIONS,) holds the last sweep of each, 0 at the start. A look first spares the others' cache.
    """
    return claimed[p] != sweep and _exchange(claimed, p, sweep) != sweep


@njit(**INLINE)
def in_turn(k, thread, threads):
    """The ``k``-th partition that one of ``threads`` asks for: its own first, then what others have left."""
    return SHARED_OUT[(k + PARTITIONS * thread // threads) % PARTITIONS]
