"""Specimens of an ensemble side by side, each in a process of one thread, which takes the least time of processors."""

import math
import threading
from collections.abc import Sequence
from pathlib import Path

import numba

from knittest.base.progress import Progress
from knittest.config.run import Run
from knittest.runs.opening import Opened
from knittest.runs.options import RunOptions
from knittest.studies.trials.beside import FOREVER, raise_what_ended
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.trial import Trial


def run_ahead(run: Run, opened: Opened, options: RunOptions, progress: Progress) -> None:
    """Run the specimens of ``run`` that are left, as many at a time as there are threads, and keep them in its folder.

    Does nothing where one process is as good: for one thread, one specimen, or shells, whose run is over before a
    process has begun. Raises the error that ended a specimen.
    """
    threads = numba.get_num_threads()
    left = _left(run, opened)
    if run.model.scale != "meso" or min(threads, len(left)) < 2:
        return
    progress.phase(f"{run.direction or run.rig.kind}: {len(left)} specimens, {min(threads, len(left))} at a time")
    trials = [Trial(run, f"{number:04d}", f"specimen {number + 1}", specimen=number) for number in left]
    shares, lock = dict.fromkeys(left, 0.0), threading.Lock()

    def watch(trial: Trial, share: float | None) -> None:
        with lock:
            shares[int(trial.key)] = share or 0.0
            progress.update(sum(shares.values()) / len(shares), math.nan, math.nan, math.nan)

    def place(trial: Trial) -> Path:
        return opened.folder.specimens / trial.key

    pool = LocalPool(min(threads, len(left)), 1)
    try:
        for record in pool.run(trials, place, FOREVER, options, watch):
            raise_what_ended(record)
            watch(trials[left.index(int(record.key))], 1.0)
            opened.folder.log("specimen", number=int(record.key), seconds=round(record.seconds, 3))
    finally:
        pool.close()


def _left(run: Run, opened: Opened) -> Sequence[int]:
    """Numbers of the specimens that were not begun in this folder's own process."""
    begun = opened.checkpoints.found[0] if opened.checkpoints.found else None
    numbers = [number for number in range(run.variability.specimens) if number != begun]
    return [number for number in numbers if opened.checkpoints.finished(number) is None]
