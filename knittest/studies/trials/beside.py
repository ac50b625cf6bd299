"""Runs of one command in parallel, and specimens of an ensemble in parallel, each in a process of its own."""

import math
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from pathlib import Path
from types import TracebackType
from typing import Self

import numba

from knittest.base.errors import OUT_OF_MEMORY, InputError, KnittestError, NumericalError, ResourceError
from knittest.base.progress import Progress, tell
from knittest.config.run import Run
from knittest.laboratory.report_base import TESTS
from knittest.runs.execute import name_of, specimen_name
from knittest.runs.opening import Opened, Place, StoppedRun
from knittest.runs.options import RunOptions
from knittest.solve.compiling import compiled
from knittest.studies.trials.child import GRACE, Child
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.trial import Record, Status, Trial
from knittest.studies.trials.work import SAID

#: seconds between two looks at how far a run is, and those that a run may take, eleven days
LOOK, FOREVER = 0.2, 1e6
ERRORS: Mapping[Status, type[KnittestError]] = {
    "failed": NumericalError, "invalid": InputError, "blocked": ResourceError,
    "crashed": ResourceError,
}  # fmt: skip


class Beside:
    """Runs ``runs``, by their folders, beside this process, of ``threads`` threads each; a context manager, which stops
    those that are under way when it is left, with a checkpoint.
    """

    def __init__(self, runs: Mapping[Path, tuple[Run, Place]], options: RunOptions, threads: int) -> None:
        self._children = {folder: Child(threads, _tell) for folder in runs}
        self._shares = dict.fromkeys(runs, 0.0)
        self._runs, self._options = runs, options
        self._futures: dict[Path, Future[Record]] = {}

    def wait(self, folder: Path, progress: Progress) -> Path:
        """Return ``folder`` once its run is completed, showing how far it is; raise the error that ended it."""
        run, _ = self._runs[folder]
        name, future = run.direction or run.rig.kind, self._futures[folder]
        if future.done():
            progress.done()
        else:
            progress.phase(f"{name}: running in parallel", until_failure=TESTS[run.rig.kind].ends_at_failure)
        while not future.done():
            wait_for([future], LOOK)
            progress.update(self._shares[folder], math.nan, math.nan, math.nan)
        record = future.result()
        raise_what_ended(record, name)
        progress.ended(f"{name}, beside", record.seconds)
        return folder

    def __enter__(self) -> Self:
        self._watchers = ThreadPoolExecutor(max(len(self._children), 1), thread_name_prefix="beside")
        for folder, child in self._children.items():
            self._futures[folder] = self._watchers.submit(self._run, folder, child)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for child in self._children.values():
            child.stop()
        wait_for(self._futures.values(), timeout=GRACE)
        for child in self._children.values():
            child.kill()
        self._watchers.shutdown()
        for child in self._children.values():
            child.close()

    def _run(self, folder: Path, child: Child) -> Record:
        def heard(share: float | None) -> None:
            self._shares[folder] = share or 0.0

        run, place = self._runs[folder]
        stopped = place if isinstance(place, StoppedRun) else None  # a new one is gone on with if its process dies
        return child.run(Trial(run, folder.name, folder.name, place=stopped), folder, FOREVER, self._options, heard)


def raise_what_ended(record: Record, name: str) -> None:
    """Raise the error that ended the run of ``record``, if one did, with the words that it had, and ``name``."""
    if record.status in ("completed", "refused"):
        return
    often = f", {len(record.earlier) + 1} times" if record.status == "crashed" and record.earlier else ""
    short = "; fewer --threads run fewer at a time, in less memory" if _of_memory(record) else ""
    raise ERRORS.get(record.status, KnittestError)(f"{name}: {record.reason}{often}{short}")


def _of_memory(record: Record) -> bool:
    """Tell whether memory may have been short: the system kills the process that takes most of it."""
    return record.reason == OUT_OF_MEMORY or (record.status == "crashed" and "SIGKILL" in record.reason)


def _tell(trial: Trial, event: str, fields: Mapping[str, object]) -> None:
    """Tell the user what a process beside says; its run's log it writes itself."""
    if event == SAID:
        tell_of(trial.label, fields)


def tell_of(name: str, said: Mapping[str, object]) -> None:
    """Tell the user what the process of ``name`` said."""
    tell(f"{name}: {str(said['text']).removeprefix('knittest: ')}")


# Specimens of an ensemble side by side, each in a process of one thread, which takes the least time of processors.


def run_ahead(run: Run, opened: Opened, progress: Progress) -> None:
    """Run the specimens of ``run`` that are left in processes of their own, and keep them among its checkpoints.

    Does nothing where this process is as good: for one thread, one specimen, or shells, whose run is over before a
    process has begun. Raises the error that ended a specimen.
    """
    if run.model.scale != "meso":
        return
    left = [k for k in range(run.variability.specimens) if not opened.checkpoints.is_finished(k)]
    for numbers, threads in rounds(left, numba.get_num_threads()):
        _Round(run, opened, progress).run(numbers, threads)


def rounds(left: Sequence[int], threads: int) -> list[tuple[Sequence[int], int]]:
    """Specimens that run at a time, and the threads of each: one while there are as many left as threads, after that
    an equal share. The last one, if it is alone, is not among them: it has this process, with all threads.
    """
    if threads < 2:
        return []
    whole = len(left) - len(left) % threads
    shares = [(left[:whole], 1), (left[whole:], threads // max(len(left) - whole, 1))]
    return [(numbers, each) for numbers, each in shares if len(numbers) > 1]


class _Round:
    """Specimens of one round, and how far they are."""

    def __init__(self, run: Run, opened: Opened, progress: Progress) -> None:
        self._run, self._opened, self._progress = run, opened, progress
        self._shares: dict[str, float] = {}
        self._lock = threading.Lock()

    def run(self, numbers: Sequence[int], threads: int) -> None:
        """Run the specimens ``numbers``, as many at a time as this process has ``threads`` for."""
        run, name, workers = self._run, name_of(self._run), min(len(numbers), numba.get_num_threads() // threads)
        compiled(run, lambda text: self._progress.phase(f"{name}: {text}"), threads)
        text = f"{name}: running {len(numbers)} specimens of {run.variability.specimens}, {workers} at a time"
        self._progress.phase(text, until_failure=TESTS[run.rig.kind].ends_at_failure)
        trials = [Trial(run, str(k), specimen_name(run, k), specimen=k) for k in numbers]
        self._shares = {trial.key: 0.0 for trial in trials}
        pool = LocalPool(workers, threads, self._note, (self._opened.folder.lock,))
        try:
            for record in pool.run(trials, self._place, FOREVER, RunOptions(), self._watch):
                raise_what_ended(record, specimen_name(run, int(record.key)))
                self._share(record.key, 1.0)
        finally:
            pool.close()

    def _place(self, trial: Trial) -> Path:
        return self._opened.folder.path

    def _watch(self, trial: Trial, share: float | None) -> None:
        self._share(trial.key, share or 0.0)

    def _share(self, key: str, share: float) -> None:
        with self._lock:
            self._shares[key] = share
            self._progress.update(sum(self._shares.values()) / len(self._shares), math.nan, math.nan, math.nan)

    def _note(self, trial: Trial, event: str, fields: dict[str, object]) -> None:
        """Log what the process of ``trial`` logs and says, and tell what it says."""
        with self._lock:
            self._opened.folder.log(event, **{"number": trial.specimen} | fields)
        if event == SAID:
            tell_of(trial.label, fields)
