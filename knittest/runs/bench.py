"""Throughput of the kernels and the time of a run by part; medians of repeated measurements."""

import statistics
import time as clock
from collections.abc import Callable, Iterator

import numpy as np

from knittest.base.machine import processor_ticks, steal_share
from knittest.config.run import Run
from knittest.kernels.explicit import SCRATCH
from knittest.kernels.threading import best_threads
from knittest.kernels.vec import PARTITIONS
from knittest.models.boundary import Boundary, new_tally
from knittest.models.yarn_model import YarnModel
from knittest.runs.specimen import prepare
from knittest.solve.compilation import load_kernels
from knittest.solve.simulation import simulate

STEPS, REPEATS = 50, 5


def _median_time(call: Callable[[], object]) -> float:
    call()
    times = []
    for _ in range(REPEATS):
        start = clock.perf_counter()
        call()
        times.append(clock.perf_counter() - start)
    return statistics.median(times)


def _stepping_call(run: Run, contact: bool) -> tuple[Callable[[], object], int, int]:
    """A call that advances a new model by STEPS without motion, and its numbers of elements and yarn contacts."""
    meso = run.model.meso.model_copy(update={"contact": contact})
    prepared = prepare(run.model_copy(update={"model": run.model.model_copy(update={"meso": meso})}))
    model = prepared.model
    scratch, dt = np.zeros((PARTITIONS, SCRATCH)), run.solver.safety * model.critical_step
    boundary = Boundary(model, dt)
    prepared.rig.constrain(boundary)
    drive, tally = boundary.drive(), new_tally(boundary)
    model.prepare()
    contacts = model.tracker.count if contact and isinstance(model, YarnModel) else 0
    return lambda: model.advance(STEPS, 0.0, dt, drive, tally, scratch), len(model.mesh.cells), contacts


def kernel_lines(yarns: Run, loops: Run, shells: Run) -> Iterator[str]:
    """Element steps per second by kernel, on one thread and on all, and the processor time that the host took."""
    import numba

    for run in (yarns, shells):
        load_kernels(run, threads=best_threads(None))
    cases = [
        ("beams", yarns, False), ("beams and contact", yarns, True),
        ("loops and contact", loops, True), ("shells of forming", shells, False),
    ]  # fmt: skip
    heads = (f"{'kernel':<20}", f"{'elements':>10}", f"{'contacts each':>15}", f"{'threads':>9}")
    yield "".join((*heads, f"{'ns/element-step':>17}", f"{'M element-steps/s':>19}"))
    before = processor_ticks()
    for name, run, contact in cases:
        call, elements, contacts = _stepping_call(run, contact)
        for threads in sorted({1, best_threads(None)}):
            numba.set_num_threads(threads)
            seconds = _median_time(call) / STEPS / elements
            each = f"{contacts / elements:.2f}" if contact else "-"
            yield f"{name:<20}{elements:>10}{each:>15}{threads:>9}{1e9 * seconds:>17.1f}{1e-6 / seconds:>19.1f}"
    taken = steal_share(before, processor_ticks())
    share = "not known" if taken is None else f"{100.0 * taken:.1f} %"
    yield f"processor time taken by the host: {share}"


def run_lines(run: Run) -> Iterator[str]:
    """Wall time of a tensile run by part, with compiled kernels and cached relaxed cell."""
    prepare(run)
    start = clock.perf_counter()
    prepared = prepare(run)
    built = clock.perf_counter()
    _, cost = simulate(prepared.model, prepared.rig, run.solver, run.output)
    end = clock.perf_counter()
    search = prepared.model.search_seconds()
    elements = len(prepared.model.mesh.cells)
    what = f"{run.fabric.name} {run.direction}, preset {run.model.preset}"
    yield f"run: {what}, {elements} elements, {cost.steps} steps"
    whole = end - start
    for name, seconds in (
        ("geometry and arrays", built - start),
        ("contact search", search),
        ("steps", cost.advance_s - search),
        ("energies, frames", end - built - cost.advance_s),
    ):
        yield f"  {name:<22}{seconds:8.2f} s {100.0 * seconds / whole:6.1f} %"
    yield f"  {'whole':<22}{whole:8.2f} s, {1e-6 * cost.steps * elements / whole:.1f} M element-steps/s overall"
