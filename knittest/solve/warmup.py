"""Compiles the kernels of a scale on a tiny model, so that a user sees compilation as such, once."""

import fcntl
import hashlib
import os
import subprocess
import sys
import threading
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

import numpy as np

from knittest.base.cache import VARIABLE, cache_root
from knittest.config.run import Output, Run, Scale
from knittest.fabric.strip import YarnPath
from knittest.fabric.variability import YarnDraws
from knittest.kernels import CODE_FOLDER
from knittest.materials.laminate import laminate
from knittest.models.boundary import Boundary
from knittest.models.explicit_model import ExplicitModel
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import build_meso
from knittest.models.readings import Readings
from knittest.models.table import ramp
from knittest.models.tool import plane
from knittest.solve.observer import SILENT, Observer
from knittest.solve.simulate import simulate
from knittest.solve.threads import check_layer

#: kernels of the macro scale with self-contact
MACRO_CONTACT = "macro-contact"
_warm: set[str] = set()


def kernels_of(run: Run) -> str:
    """Name of the kernels that ``run`` needs: its scale, and whether shells touch each other."""
    return MACRO_CONTACT if run.model.scale == "macro" and run.model.macro.self_contact else run.model.scale


def compiled_before(kernels: str) -> bool:
    """Tell whether the cache on disk holds all of ``kernels`` for this processor and these versions."""
    marker = _marker(kernels)
    return marker is not None and marker.is_file()


def warm(run: Run, observer: Observer = SILENT) -> float:
    """Compile, or load from the cache, what ``run`` needs; returns the seconds it took (0 the second time).

    A process that compiles a kernel links other copies of its helpers than one that loads it from the cache, and its
    results differ in the last bits. So a process of its own compiles, and every run, also a resumed one, loads.
    """
    kernels = kernels_of(run)
    if kernels in _warm:
        return 0.0
    check_layer()
    ready, kept = compiled_before(kernels), CODE_FOLDER is not None
    once = "once per installation" if kept else "nothing is cached"
    observer.phase(f"loading the {kernels} kernels" if ready else f"compiling the {kernels} kernels ({once})")
    start = clock.perf_counter()
    if kept and not ready:
        _compile_apart(kernels)
    _exercise(kernels)
    _warm.add(kernels)
    return clock.perf_counter() - start


def _compile_apart(kernels: str) -> None:
    """Fill the cache from another process; if that fails, the kernels are compiled here, which says what is wrong.

    That process ends with this one, however this one ends: its input is a pipe that nobody else holds. Of many that
    start at once one compiles, the others wait for it.
    """
    with _alone(kernels):
        if not compiled_before(kernels):
            _compile_in_child(kernels)


def compile_all() -> float:
    """Compile what the cache lacks of all kernels, the two scales side by side; returns the seconds it took."""
    check_layer()
    start = clock.perf_counter()
    if CODE_FOLDER is not None:
        with _alone("meso"), nullcontext() if compiled_before("meso") else _compiling("meso"):
            for kernels in ("macro", MACRO_CONTACT):  # the second loads what the first has compiled
                if not compiled_before(kernels):
                    _compile_apart(kernels)
    return clock.perf_counter() - start


@contextmanager
def _alone(kernels: str) -> Iterator[None]:
    """Wait for whoever compiles ``kernels`` into this cache; the lock goes with its process."""
    assert CODE_FOLDER is not None
    try:
        lock = (CODE_FOLDER / f"{kernels}.lock").open("w")
    except OSError:
        yield
        return
    with lock:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _compile_in_child(kernels: str) -> None:
    with _compiling(kernels):
        pass


@contextmanager
def _compiling(kernels: str) -> Iterator[None]:
    """Another process fills the cache meanwhile: waited for at the end, ended by whatever goes wrong before."""
    environment = os.environ | {VARIABLE: str(cache_root())}
    work = f"from knittest.solve import warmup; warmup.end_with_parent(); warmup.fill_cache({kernels!r})"
    command = [sys.executable, "-P", "-c", work]
    pipe, quiet = subprocess.PIPE, subprocess.DEVNULL
    try:
        compiler = subprocess.Popen(command, env=environment, stdin=pipe, stdout=quiet, stderr=quiet)
    except OSError:
        yield
        return
    try:
        yield
        compiler.wait()
    finally:
        compiler.kill()
        compiler.communicate()


def end_with_parent() -> None:
    """Let this process end when its input does."""

    def watch() -> None:
        sys.stdin.buffer.read()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def fill_cache(kernels: str) -> None:
    """Compile all of ``kernels`` into the cache, then mark it as complete."""
    _exercise(kernels)
    marker = _marker(kernels)
    if marker is not None:
        marker.touch()


def _marker(kernels: str) -> Path | None:
    """Named after all that makes Numba compile anew, in the folder of the sources loaded; None where there is none."""
    import numba
    from llvmlite import binding

    host = (binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
    key = repr((numba.__version__, binding.llvm_version_info, sys.version_info[:2], *host))
    name = f"{kernels}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.complete"
    return None if CODE_FOLDER is None else CODE_FOLDER / name


def _exercise(kernels: str) -> None:
    """Simulate a tiny model of a shipped fabric with everything that a run calls."""
    from knittest.config.loading import resolve

    line = ["fabric.macro.shear.kind=linear", "fabric.macro.shear.stiffness=0.05"]  # no curve to be read
    contact = ["model.macro.self_contact=true"] if kernels == MACRO_CONTACT else []
    scale: Scale = "meso" if kernels == "meso" else "macro"
    run = resolve(variant="1", scale=scale, sets=[*line, *contact])
    model = _crossing_yarns(run) if run.model.scale == "meso" else _small_strip(run)
    brief = run.solver.model_copy(update={"target_step": None})
    simulate(model, _Tug(), brief, Output(samples=20, frames=1))


class _Tug:
    """Pulls a little over a plane."""

    duration = 0.02
    coordinate, force = "strain_pct", "force_n"
    marks: tuple[float, ...] = ()
    averaged_from = np.inf

    def constrain(self, boundary: Boundary) -> None:
        along = boundary.model.position()[:, 1]
        boundary.grip(np.flatnonzero(along <= along.min() + 1e-6), "y")
        boundary.grip(np.flatnonzero(along >= along.max() - 1e-6), "y", ramp(1e-3, 0.01))
        boundary.load([0], "z", 0.0)
        boundary.add_tool(plane((0.0, 0.0, -10.0), (0.0, 0.0, 1.0)))

    def ring_time(self, wave_speed: float) -> float:
        return 10.0 / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        return {"strain_pct": time, "force_n": float(readings.reaction[1])}

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        return False


def _crossing_yarns(run: Run) -> ExplicitModel:
    along = np.arange(-5.0, 5.01, 0.5)
    zero, above = np.zeros_like(along), np.full_like(along, run.fabric.reinforcing.beam_diameter_mm)
    paths = [
        YarnPath("warp", 0, np.column_stack([zero, along, zero])),
        YarnPath("weft", 0, np.column_stack([along, zero, above])),
    ]
    one = YarnDraws(np.full(1, 0.1), np.zeros(1), np.ones(1), np.full(1, 0.5))
    return build_meso(run, paths, {"warp": one, "weft": one, "knit": one})


def _small_strip(run: Run) -> ExplicitModel:
    line = (np.array([0.0, 100.0]), np.array([0.0, 2e4]))
    card = laminate(run.fabric, {"warp": line, "weft": line})
    contact = self_contact(run.fabric, run.model.macro, run.solver.safety)
    return build_strip(run.fabric, card, "warp", StripShape(5.0, 5.0, 5.0, 5.0), contact)
