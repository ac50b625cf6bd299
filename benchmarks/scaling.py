"""Time of a step and memory from 10,000 to a million beams and from 3,000 to 100,000 shells, on one thread.

    python benchmarks/scaling.py --steps 1000

Strips of yarns (variant 2, warp, mesh of the paper, gauge length four times the width) and blanks of forming (variant
1, shells from 6 mm down) are each built in a process of their own and make the same steps by turns, so that a machine
which others use treats all alike. Times are processor time, medians of the turns. Memory is resident memory of the
process (Linux' VmRSS and, at most, VmHWM) with the model less without it. Kernels are loaded before by a small model
that is dropped, and what the allocator keeps of freed memory goes back to the system before either is read; some 100 kB
are noise.
"""

import argparse
import ctypes
import gc
import multiprocessing
import statistics
import time
from dataclasses import dataclass
from math import sqrt
from multiprocessing.connection import Connection
from pathlib import Path

from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.models.boundary import Boundary, new_tally
from knittest.models.yarn_model import YarnModel
from knittest.runs.specimen import prepare
from knittest.solve.compilation import load_kernels
from knittest.solve.state import ModelStepper

BEAMS = (10_000, 30_000, 100_000, 300_000, 1_000_000)
#: sides of the shells [mm] of a blank of 330 mm
SIDES = (6.0, 3.3, 1.9, 1.04)
#: beams of variant 2 in a square millimetre of a strip
DENSITY = 4.45
#: models that load all that every model needs: beams, and side of the shells [mm]
FEW, COARSE = 2_000, 12.0
TURN = 100


@dataclass(frozen=True)
class Built:
    """Counts of a model, seconds to build it and bytes of its process that it holds, and held at most so far."""

    elements: int
    contacts: int
    build_s: float
    held: int
    most: int


def strip(beams: int) -> Run:
    """A strip of about so many beams."""
    width = sqrt(beams / DENSITY / 4.0)
    sets = [f"rig.gauge_length={4.0 * width:.1f}", f"rig.width={width:.1f}"]
    return resolve(variant="2", scale="meso", preset="paper", direction="warp", sets=sets)


def blank(side: float) -> Run:
    """A blank of forming of shells of ``side`` [mm]."""
    sets = [f"model.macro.element_size={side}"]
    return resolve(variant="1", scale="macro", preset="quick", test="forming", sets=sets)


def memory(field: str) -> int:
    """Bytes of this process by a field of Linux' status: VmRSS, held now; VmHWM, at most."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(field))


def settled() -> int:
    """Bytes that this process holds now, without what is freed already."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return memory("VmRSS")


def moving(run: Run) -> ModelStepper:
    """Model of ``run`` under its rig, a turn after its start."""
    prepared = prepare(run)
    model, dt = prepared.model, run.solver.safety * prepared.model.critical_step
    boundary = Boundary(model, dt)
    prepared.rig.constrain(boundary)
    stepping = ModelStepper(model, boundary.drive(), new_tally(boundary), dt)
    model.prepare()
    stepping.step(TURN)
    return stepping


def built(run: Run) -> tuple[ModelStepper, Built]:
    """Model of ``run`` at rest under its rig, and what it took beyond what a small model loads."""
    load_kernels(run, threads=1)
    moving(strip(FEW) if run.model.scale == "meso" else blank(COARSE))
    before, start = settled(), time.process_time()
    Path("/proc/self/clear_refs").write_text("5")  # forgets the most so far
    stepping = moving(run)
    model = stepping.model
    contacts = model.tracker.count if isinstance(model, YarnModel) else 0
    spent = time.process_time() - start
    most = memory("VmHWM") - before
    held = settled() - before
    return stepping, Built(len(model.mesh.cells), contacts, spent, held, most)


def serve(run: Run, pipe: Connection) -> None:
    """Build and say what it took; then answer each number of steps with their processor time [s], until None."""
    stepping, facts = built(run)
    pipe.send(facts)
    while (steps := pipe.recv()) is not None:
        start = time.process_time()
        stepping.step(steps)
        pipe.send(time.process_time() - start)


def measured(runs: list[Run], steps: int) -> list[tuple[Built, float]]:
    """Facts of each model and its median time of a step [s], the models by turns."""
    context, pipes, facts = multiprocessing.get_context("spawn"), [], []
    for run in runs:
        mine, other = context.Pipe()
        context.Process(target=serve, args=(run, other), daemon=True).start()
        other.close()  # so that a process that dies is seen
        pipes.append(mine)
        facts.append(mine.recv())
    times: list[list[float]] = [[] for _ in runs]
    for _ in range(max(1, steps // TURN)):
        for pipe, spent in zip(pipes, times, strict=True):
            pipe.send(TURN)
            spent.append(pipe.recv() / TURN)
    for pipe in pipes:
        pipe.send(None)
    return [(fact, statistics.median(mine)) for fact, mine in zip(facts, times, strict=True)]


def report(name: str, rows: list[tuple[Built, float]]) -> None:
    """Print a table, and how far times and memory are from linear: from the mean of all sizes."""
    print(f"| {name} | contacts each | step [ms] | each [ns] | each [kB] | while built [kB] | build [CPU s] |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for fact, step in rows:
        count = fact.elements
        memory_each = f"{fact.held / count / 1e3:.2f} | {fact.most / count / 1e3:.2f}"
        print(
            f"| {count:,} | {fact.contacts / count:.2f} | {1e3 * step:.3g} | {1e9 * step / count:.1f} | {memory_each} "
            f"| {fact.build_s:.1f} |"
        )
    for what, each in (
        ("time", [step / fact.elements for fact, step in rows]),
        ("memory", [fact.held / fact.elements for fact, _ in rows]),
    ):
        mean = statistics.fmean(each)
        print(f"{what}: {100 * (min(each) / mean - 1):+.0f} to {100 * (max(each) / mean - 1):+.0f} % of the mean")


def main() -> None:
    """Measure what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--beams", type=int, nargs="*", default=BEAMS)
    parser.add_argument("--sides", type=float, nargs="*", default=SIDES)
    asked = parser.parse_args()
    for name, runs in (("beams", [strip(n) for n in asked.beams]), ("shells", [blank(s) for s in asked.sides])):
        if runs:
            report(name, measured(runs, asked.steps))


if __name__ == "__main__":
    main()
