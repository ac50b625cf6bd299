"""Runs of one command in parallel, and specimens of an ensemble in parallel, each in a process of its own."""

import math
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import wait as wait_for
from pathlib import Path
from typing import Self

import numba

from knittest.base.errors import OUT_OF_MEMORY, InputError, KnittestError, NumericalError, ResourceError
from knittest.base.progress import Progress, tell
from knittest.config.run import Run
from knittest.laboratory.report_base import TESTS
from knittest.runs.execute import run_label, specimen_name
from knittest.runs.opened_run import OpenedRun, RunPlace, StoppedRun
from knittest.runs.options import RunOptions
from knittest.solve.compilation import compile_missing
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.trial import Record, Status, Trial
from knittest.studies.trials.worker import MESSAGE

#: seconds between two updates of the progress, and those that a run may take, eleven days
LOOK, FOREVER = 0.2, 1e6
ERRORS: Mapping[Status, type[KnittestError]] = {
    "failed": NumericalError, "invalid": InputError, "blocked": ResourceError, "crashed": ResourceError,
}  # fmt: skip


class ParallelRuns:
    """Runs ``runs``, by folder, in parallel to this process with ``threads`` threads each; a context manager.

    Leaving it stops the runs that have not ended, with a checkpoint.
    """

    def __init__(self, runs: Mapping[Path, tuple[Run, RunPlace]], options: RunOptions, threads: int) -> None:
        self._runs, self._options = runs, options
        self._shares: dict[str, float] = {}
        self._pool = LocalPool(max(len(runs), 1), threads, _relay)

    def __enter__(self) -> Self:
        trials = [  # a new run is resumed if its process dies
            Trial(run, str(folder), folder.name, place=place if isinstance(place, StoppedRun) else None)
            for folder, (run, place) in self._runs.items()
        ]
        submitted = self._pool.submit(trials, lambda trial: Path(trial.key), FOREVER, self._options, self._watch)
        self._futures = dict(zip(self._runs, submitted, strict=True))
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.close()

    def wait(self, folder: Path, progress: Progress) -> Path:
        """Show the progress of the run in ``folder`` to its end, and return ``folder``; raise the error of the run."""
        run, _ = self._runs[folder]
        name, future = run.direction or run.rig.kind, self._futures[folder]
        if future.done():
            progress.finish()
        else:
            progress.phase(f"{name}: running in parallel", until_failure=TESTS[run.rig.kind].ends_at_failure)
        while not future.done():
            wait_for([future], LOOK)
            progress.update(self._shares.get(str(folder), 0.0), math.nan, math.nan, math.nan)
        record = future.result()
        raise_run_error(record, name)
        progress.report_done(f"{name}, in parallel", record.seconds)
        return folder

    def _watch(self, trial: Trial, share: float | None) -> None:
        self._shares[trial.key] = share or 0.0


def raise_run_error(record: Record, name: str) -> None:
    """Raise the error that ended the run of ``record``, if any, with its message after ``name``."""
    if record.status in ("completed", "refused"):
        return
    often = f", {len(record.earlier) + 1} times" if record.status == "crashed" and record.earlier else ""
    killed = record.status == "crashed" and "SIGKILL" in record.reason  # as by the system when memory is short
    hint = "; fewer --threads run fewer at a time, in less memory" if killed or record.reason == OUT_OF_MEMORY else ""
    raise ERRORS.get(record.status, KnittestError)(f"{name}: {record.reason}{often}{hint}")


def _relay(trial: Trial, event: str, fields: Mapping[str, object]) -> None:
    """Show a message of the process of ``trial``, whose run writes its own log."""
    if event == MESSAGE:
        tell(f"{trial.label}: {str(fields['text']).removeprefix('knittest: ')}")


# Specimens of an ensemble in parallel, each in a process of one thread, which takes the least processor time.


def run_specimens_in_parallel(run: Run, opened: OpenedRun, progress: Progress) -> None:
    """Run the specimens of ``run`` that are not finished in processes of their own, and keep them as its checkpoints.

    Does nothing where this process is as good: for one thread, one specimen, or a macro model, which ends before a
    process has started. Raises the error that ended a specimen.
    """
    if run.model.scale != "meso":
        return
    left = [k for k in range(run.variability.specimens) if not opened.checkpoints.is_finished(k)]
    for numbers, threads in specimen_rounds(left, numba.get_num_threads()):
        _run_round(run, opened, progress, numbers, threads)


def specimen_rounds(left: Sequence[int], threads: int) -> list[tuple[Sequence[int], int]]:
    """Group the specimens ``left`` into rounds, each with the threads of a specimen.

    A specimen has one thread while there are as many specimens as threads, then an equal share. A single last one is
    not in a round: this process runs it with all threads.
    """
    if threads < 2:
        return []
    whole = len(left) - len(left) % threads
    shares = [(left[:whole], 1), (left[whole:], threads // max(len(left) - whole, 1))]
    return [(numbers, each) for numbers, each in shares if len(numbers) > 1]


def _run_round(run: Run, opened: OpenedRun, progress: Progress, numbers: Sequence[int], threads: int) -> None:
    """Run the specimens ``numbers``, as many at a time as this process has ``threads`` for."""
    name, workers, lock = run_label(run), min(len(numbers), numba.get_num_threads() // threads), threading.Lock()
    shares = {str(k): 0.0 for k in numbers}

    def show(trial: Trial, share: float | None) -> None:
        with lock:
            shares[trial.key] = share or 0.0
            progress.update(sum(shares.values()) / len(shares), math.nan, math.nan, math.nan)

    def note(trial: Trial, event: str, fields: dict[str, object]) -> None:
        with lock:
            opened.folder.log(event, **{"number": trial.specimen} | fields)
        _relay(trial, event, fields)

    compile_missing(run, lambda text: progress.phase(f"{name}: {text}"), threads)
    text = f"{name}: running {len(numbers)} specimens of {run.variability.specimens}, {workers} at a time"
    progress.phase(text, until_failure=TESTS[run.rig.kind].ends_at_failure)
    trials = {str(k): Trial(run, str(k), specimen_name(run, k), specimen=k) for k in numbers}
    pool = LocalPool(workers, threads, note, (opened.folder.lock,))
    try:
        for record in pool.run(list(trials.values()), lambda _: opened.folder.path, FOREVER, RunOptions(), show):
            raise_run_error(record, trials[record.key].label)
            show(trials[record.key], 1.0)
    finally:
        pool.close()
