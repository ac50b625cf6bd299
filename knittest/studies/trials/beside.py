"""Runs of one command side by side: the first in the process of the command, the others each in one of their own."""

import math
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as NotYet
from concurrent.futures import wait as wait_for
from pathlib import Path
from types import TracebackType
from typing import Self

from knittest.base.errors import InputError, KnittestError, NumericalError, ResourceError
from knittest.base.progress import Progress
from knittest.config.run import Run
from knittest.laboratory.registry import TESTS
from knittest.runs.options import RunOptions
from knittest.studies.trials.child import GRACE, Child
from knittest.studies.trials.record import Record, Status
from knittest.studies.trials.trial import Trial

#: seconds between two looks at how far a run is, and those that a run may take, eleven days
LOOK, FOREVER = 0.2, 1e6
ERRORS: Mapping[Status, type[KnittestError]] = {
    "failed": NumericalError, "invalid": InputError, "blocked": ResourceError,
}  # fmt: skip


class Beside:
    """Runs ``runs`` in their folders beside this process, of ``threads`` threads each; a context manager, which stops
    those that are under way when it is left, with a checkpoint.
    """

    def __init__(self, runs: Mapping[Path, Run], options: RunOptions, threads: int) -> None:
        self._children = {folder: Child(threads) for folder in runs}
        self._shares = dict.fromkeys(runs, 0.0)
        self._runs, self._options = runs, options
        self._futures: dict[Path, Future[Record]] = {}

    def wait(self, folder: Path, progress: Progress) -> Path:
        """Return ``folder`` once its run is completed, showing how far it is; raise the error that ended it."""
        run = self._runs[folder]
        to_failure = TESTS[run.rig.kind].ends_at_failure
        progress.phase(f"{run.direction or run.rig.kind}: running beside", until_failure=to_failure)
        while True:
            try:
                record = self._futures[folder].result(LOOK)
            except NotYet:
                progress.update(self._shares[folder], math.nan, math.nan, math.nan)
                continue
            raise_what_ended(record)
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

        run = self._runs[folder]
        return child.run(Trial(run, folder.name, folder.name), folder, FOREVER, self._options, heard)


def raise_what_ended(record: Record) -> None:
    """Raise the error that ended the run of ``record``, if one did, with its words."""
    if record.status not in ("completed", "refused"):
        raise ERRORS.get(record.status, KnittestError)(f"{record.key}: {record.reason}")
