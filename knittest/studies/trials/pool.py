"""Pool of processes of this machine, in which trials run."""

import queue
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed, wait
from functools import partial
from pathlib import Path
from typing import Protocol

from knittest.export.provenance import cores
from knittest.runs.options import RunOptions
from knittest.studies.trials.child import GRACE, Child, Note
from knittest.studies.trials.record import Record
from knittest.studies.trials.trial import Trial

#: hears how much of a trial is done (0 to 1), or None while its kernels are compiled; from any thread
Watch = Callable[[Trial, float | None], None]
#: folder of a trial
Place = Callable[[Trial], Path]


class Pool(Protocol):
    """Runs trials, several at a time."""

    def run(
        self, trials: Sequence[Trial], place: Place, limit: float, options: RunOptions, watch: Watch
    ) -> Iterator[Record]:
        """Records of ``trials`` as they end, each run in its ``place`` in at most ``limit`` seconds."""

    def close(self) -> None:
        """End all processes of this machine; trials under way are saved."""


class LocalPool:
    """``workers`` processes with ``threads`` threads each, by default this machine's cores shared among them.

    For ``note`` and ``holding`` see :class:`Child`.
    """

    def __init__(
        self,
        workers: int | None = None,
        threads: int | None = None,
        note: Note = lambda *_: None,
        holding: Sequence[int] = (),
    ) -> None:
        workers = workers or max(cores() // (threads or 1), 1)
        threads = threads or max(cores() // workers, 1)
        #: the processes, for who watches them
        self.children = [Child(threads, note, holding) for _ in range(workers)]
        self._idle: queue.SimpleQueue[Child] = queue.SimpleQueue()
        for child in self.children:
            self._idle.put(child)
        self._watchers = ThreadPoolExecutor(workers, thread_name_prefix="trials")
        self._futures: list[Future[Record]] = []

    def run(
        self, trials: Sequence[Trial], place: Place, limit: float, options: RunOptions, watch: Watch
    ) -> Iterator[Record]:
        """See :meth:`Pool.run`; kernels are compiled by one process before the others begin."""

        def one(trial: Trial) -> Record:
            child = self._idle.get()
            try:
                watch(trial, 0.0)
                return child.run(trial, place(trial), limit, options, partial(watch, trial))
            finally:
                self._idle.put(child)

        for child in self.children[: len(trials)]:
            child.begin()
        if len(self.children) > 1:
            for trial in {t.run.model.scale: t for t in trials}.values():
                self.children[0].compile(trial.run, partial(watch, trial))
        self._futures = [self._watchers.submit(one, trial) for trial in trials]
        for future in as_completed(self._futures):
            yield future.result()

    def close(self) -> None:
        """See :meth:`Pool.close`."""
        self._watchers.shutdown(wait=False, cancel_futures=True)
        for child in self.children:
            child.stop()
        wait([f for f in self._futures if not f.cancelled()], timeout=GRACE)
        for child in self.children:
            child.kill()
        self._watchers.shutdown()
        for child in self.children:
            child.close()
