"""Kernels that a run needs: compiled once per installation, which is said, and loaded before the run."""

import time as clock
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

from knittest.config.run import Run
from knittest.kernels import CODE_FOLDER
from knittest.solve.compiling import compiled_before, compiling
from knittest.solve.exercise import Exercise
from knittest.solve.kernel_sets import ALL, kernels_of
from knittest.solve.observer import SILENT, Observer
from knittest.solve.threads import check_layer

_warm: set[str] = set()


def lacking(run: Run, threads: int = 1) -> tuple[str, ...]:
    """Names of the kernels that ``run`` needs and the cache has not."""
    return tuple(k for k in kernels_of(run, threads) if k not in _warm and not compiled_before(k))


@contextmanager
def compiling_for(run: Run) -> Iterator[None]:
    """Let another process compile meanwhile what ``run`` needs of one thread, if anything, for :func:`warm` to load."""
    missing = () if CODE_FOLDER is None else lacking(run)
    with compiling(*missing) if missing else nullcontext():
        yield


def warm(run: Run, observer: Observer = SILENT, threads: int = 1) -> float:
    """Compile, or load from the cache, what ``run`` needs on ``threads``; returns the seconds (0 the second time)."""
    wanted = [k for k in kernels_of(run, threads) if k not in _warm]
    if not wanted:
        return 0.0
    check_layer()
    start = clock.perf_counter()
    if not compiled(run, observer.phase, threads):
        observer.phase(f"loading the {run.model.scale} kernels")
    for kernels in wanted:
        Exercise(kernels).whole()
        _warm.add(kernels)
    return clock.perf_counter() - start


def compiled(run: Run, phase: Callable[[str], None], threads: int = 1) -> bool:
    """Compile what the cache lacks of what ``run`` needs on ``threads``, if anything, as a ``phase``; tell whether."""
    missing, kept = lacking(run, threads), CODE_FOLDER is not None
    if not missing:
        return False
    once = "once per installation" if kept else "nothing is cached"
    phase(f"compiling the {run.model.scale} kernels ({once})")
    if kept:
        with compiling(*missing):
            pass
    return True


def compile_all() -> float:
    """Compile what the cache lacks of all kernels, the two scales side by side; returns the seconds it took."""
    check_layer()
    start = clock.perf_counter()
    if CODE_FOLDER is not None:
        with compiling(*ALL["meso"]), compiling(*ALL["macro"]):
            pass
    return clock.perf_counter() - start
