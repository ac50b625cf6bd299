"""Threads of this process, as the user asked for them, on a layer that Numba can have, and memory for its libraries."""

import os
from contextlib import suppress

from knittest.base.errors import InputError, ResourceError
from knittest.base.files import excerpt

LAYERS = "omp, tbb, workqueue, default, safe, forksafe or threadsafe"
#: address space [GB] below which libraries of compiled code abort, or wait for ever, whatever their settings
LEAST_MEMORY = 1.0


def use_threads(wanted: int | None) -> int:
    """Use ``wanted`` threads (default: all cores), one if the threading layer is too slow for small steps.

    Returns how many; raises :class:`InputError` as :func:`check_layer` does, :class:`ResourceError` where the memory
    of this process is limited to less than its libraries need.
    """
    with suppress(ImportError):  # Windows
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY * 1e9:
            raise ResourceError(
                f"the memory of this process is limited to {limit / 1e9:.2f} GB; numerical libraries need "
                f"{LEAST_MEMORY:g} GB; raise the limit (ulimit -v)"
            )
    import numba

    from knittest.kernels.threading import best_threads

    check_layer()
    count = best_threads(wanted)
    numba.set_num_threads(count)
    return count


def check_layer() -> None:
    """Raise :class:`InputError` for a threading layer, chosen in the environment, that Numba does not have here."""
    chosen = os.environ.get("NUMBA_THREADING_LAYER")
    if chosen is None:
        return
    from knittest.kernels.threading import threading_layer

    try:
        threading_layer()
    except ValueError as error:
        why = str(error).splitlines()[0].rstrip(".")
        raise InputError(
            f"NUMBA_THREADING_LAYER={excerpt(chosen)}: {why}; expected an installed one of {LAYERS}, or unset it"
        ) from None
