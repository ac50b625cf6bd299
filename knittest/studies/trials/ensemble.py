"""Specimens of an ensemble side by side, each in a process of one thread, which takes the least time of processors."""

import math
import threading
from collections.abc import Sequence
from pathlib import Path

import numba

from knittest.base.progress import Progress
from knittest.config.run import Run
from knittest.laboratory.registry import TESTS
from knittest.runs.execute import name_of, specimen_name
from knittest.runs.opening import Opened
from knittest.runs.options import RunOptions
from knittest.solve.warmup import compiled
from knittest.studies.trials.beside import FOREVER, raise_what_ended, tell_of
from knittest.studies.trials.pool import LocalPool
from knittest.studies.trials.trial import Trial
from knittest.studies.trials.work import SAID


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
