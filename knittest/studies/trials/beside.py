"""Runs of one command side by side: the first in the process of the command, the others each in one of their own."""

import math
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from pathlib import Path
from types import TracebackType
from typing import Self

from knittest.base.errors import OUT_OF_MEMORY, InputError, KnittestError, NumericalError, ResourceError
from knittest.base.notes import tell
from knittest.base.progress import Progress
from knittest.config.run import Run
from knittest.laboratory.registry import TESTS
from knittest.runs.opening import Place, StoppedRun
from knittest.runs.options import RunOptions
from knittest.studies.trials.child import GRACE, Child
from knittest.studies.trials.record import Record, Status
from knittest.studies.trials.trial import Trial
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
