"""Kernels that a run needs, compiled into the cache by processes of their own, so that every run loads the same
code.

A process that compiles a kernel links other copies of its helpers than one that loads it from the cache, and its
results differ in the last bits. So the process of a run never compiles, and which of those here compiles what is fixed.
"""

import hashlib
import os
import subprocess
import sys
import threading
import time as clock
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from pathlib import Path

from filelock import lock_descriptor

from knittest.base.cache import VARIABLE, cache_root
from knittest.base.machine import available_cores
from knittest.config.run import Run
from knittest.kernels import CODE_FOLDER
from knittest.solve.state import SILENT, Observer
from knittest.solve.threads import check_layer
from knittest.solve.tiny_models import ALL, THREADS, TinyModel, has_feature, kernels_of

Compiler = subprocess.Popen[bytes]

#: message of the second process when its part of the step is compiled
LINKED = b"linked"


def is_compiled(kernels: str) -> bool:
    """Return whether the cache on disk holds all of ``kernels`` for this processor and these versions."""
    marker = _marker(kernels)
    return marker is not None and marker.is_file()


@contextmanager
def compile_in_background(*kernels: str) -> Iterator[None]:
    """Another process compiles what the cache lacks of ``kernels`` meanwhile: waited for at the end, ended by whatever
    goes wrong before, and when this process ends, however it does.
    """
    compiler = _process(f"fill_cache({', '.join(map(repr, kernels))})")
    if compiler is None:
        yield
        return
    try:
        yield
        compiler.wait()
    finally:
        compiler.kill()
        compiler.communicate()


def fill_cache(*kernels: str) -> None:
    """Compile what the cache lacks of ``kernels``; of many processes that want to one does, the others wait for it."""
    for one in kernels:
        with _wait_for_compiler(one):
            if not is_compiled(one):
                _compile_kernels(one)


def _compile_kernels(kernels: str) -> None:
    """Compile all of ``kernels``, beside a second process where there is a core for it, and mark them as complete."""
    if not has_feature(kernels, THREADS):  # those add little to what is compiled before
        stages = TinyModel(kernels)
        with _second_process(kernels) as second:
            stages.elements()
            if second is not None and second.stdout is not None:
                second.stdout.readline()  # LINKED, or its end
            stages.step()
            if second is not None:
                second.wait()
    TinyModel(kernels).run_all()
    marker = _marker(kernels)
    if marker is not None:
        marker.touch()


@contextmanager
def _second_process(kernels: str) -> Iterator[Compiler | None]:
    two_cores = available_cores() > 1
    second = _process(f"compile_node_kernels({kernels!r})") if two_cores else None
    try:
        yield second
    finally:
        if second is not None:
            second.kill()
            second.communicate()


def compile_node_kernels(kernels: str) -> None:
    """Compile what the step of ``kernels`` links last, say so, then what it does not need."""
    stages = TinyModel(kernels)
    stages.nodes()
    sys.stdout.buffer.write(LINKED + b"\n")
    sys.stdout.buffer.flush()
    stages.run_between_steps()


def _process(call: str) -> Compiler | None:
    """A process that does ``call`` of this module and ends with this one; None where there is no room for it."""
    environment = os.environ | {VARIABLE: str(cache_root())}
    work = f"from knittest.solve import compilation; compilation.end_with_parent(); compilation.{call}"
    command, pipe = [sys.executable, "-P", "-c", work], subprocess.PIPE
    try:
        return subprocess.Popen(command, env=environment, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)
    except OSError:
        return None


def end_with_parent() -> None:
    """Let this process end when its input does, a pipe that nobody but its parent holds."""

    def watch() -> None:
        sys.stdin.buffer.read()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _wait_for_compiler(kernels: str) -> Iterator[None]:
    """Wait for whoever compiles ``kernels`` into this cache; the lock goes with its process."""
    assert CODE_FOLDER is not None
    try:
        lock = (CODE_FOLDER / f"{kernels}.lock").open("w")
    except OSError:
        yield
        return
    with lock:
        with suppress(OSError):  # a file system without locks
            lock_descriptor(lock.fileno())
        yield


def _marker(kernels: str) -> Path | None:
    """File whose name holds all that makes Numba compile again; None without a cache."""
    import numba
    from llvmlite import binding

    host = (binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
    key = repr((numba.__version__, binding.llvm_version_info, sys.version_info[:2], *host))
    name = f"{kernels}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.complete"
    return None if CODE_FOLDER is None else CODE_FOLDER / name


_warm: set[str] = set()


def missing_kernels(run: Run, threads: int = 1) -> tuple[str, ...]:
    """Kernels that ``run`` needs and the cache lacks."""
    return tuple(k for k in kernels_of(run, threads) if k not in _warm and not is_compiled(k))


@contextmanager
def compile_run_in_background(*runs: Run) -> Iterator[None]:
    """Let other processes, one for each scale, compile meanwhile what ``runs`` need of one thread, if anything, for
    :func:`load_kernels` to load.
    """
    with ExitStack() as stack:
        for missing in dict.fromkeys(missing_kernels(run) for run in runs if CODE_FOLDER is not None):
            stack.enter_context(compile_in_background(*missing) if missing else nullcontext())
        yield


def load_kernels(run: Run, observer: Observer = SILENT, threads: int = 1) -> float:
    """Compile, or load from the cache, what ``run`` needs on ``threads``; returns the seconds (0 the second time)."""
    wanted = [k for k in kernels_of(run, threads) if k not in _warm]
    if not wanted:
        return 0.0
    check_layer()
    start = clock.perf_counter()
    if not compile_missing(run, observer.phase, threads):
        observer.phase(f"loading the {run.model.scale} kernels")
    for kernels in wanted:
        TinyModel(kernels).run_all()
        _warm.add(kernels)
    return clock.perf_counter() - start


def compile_missing(run: Run, phase: Callable[[str], None], threads: int = 1) -> bool:
    """Compile as a ``phase`` what the cache lacks of what ``run`` needs on ``threads``; returns whether it had to."""
    missing, kept = missing_kernels(run, threads), CODE_FOLDER is not None
    if not missing:
        return False
    once = "once for this kind of test" if kept else "no cache"
    phase(f"compiling the {run.model.scale} kernels ({once})")
    if kept:
        with compile_in_background(*missing):
            pass
    return True


def compile_all() -> float:
    """Compile what the cache lacks of all kernels, the two scales side by side; returns the seconds it took."""
    check_layer()
    start = clock.perf_counter()
    if CODE_FOLDER is not None:
        with compile_in_background(*ALL["meso"]), compile_in_background(*ALL["macro"]):
            pass
    return clock.perf_counter() - start
