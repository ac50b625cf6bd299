"""Pools in which trials run: processes of this machine, or workers of a Dask cluster that see the same folder."""

import asyncio
import logging
import queue
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed, wait
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from knittest.base.errors import InputError, KnittestError, ResourceError
from knittest.base.machine import available_cores
from knittest.runs.options import RunOptions
from knittest.studies.trials.child import GRACE, Child, Note
from knittest.studies.trials.trial import Record, Trial, code_digest

if TYPE_CHECKING:
    from distributed import Client
    from distributed import Future as DaskFuture


#: gets the share of a trial that is done (0 to 1), None while its kernels are compiled; from any thread
Watch = Callable[[Trial, float | None], None]
#: folder of a trial
Place = Callable[[Trial], Path]


class Pool(Protocol):
    """Runs trials, several at a time."""

    def run(
        self, trials: Sequence[Trial], place: Place, limit: float, options: RunOptions, watch: Watch
    ) -> Iterator[Record]:
        """Yield records of ``trials`` as they end, each run in its ``place`` in at most ``limit`` seconds."""

    def close(self) -> None:
        """End all processes of this machine; running trials save a checkpoint."""


class LocalPool:
    """Pool of ``workers`` processes with ``threads`` threads each, by default all cores; the rest as :class:`Child`."""

    def __init__(
        self, workers: int | None = None, threads: int | None = None, note: Note = lambda *_: None,
        holding: Sequence[int] = (),
    ) -> None:  # fmt: skip
        workers = workers or max(available_cores() // (threads or 1), 1)
        threads = threads or max(available_cores() // workers, 1)
        self.children = [Child(threads, note, holding) for _ in range(workers)]
        self._idle: queue.SimpleQueue[Child] = queue.SimpleQueue()
        for child in self.children:
            self._idle.put(child)
        self._watchers = ThreadPoolExecutor(workers, thread_name_prefix="trials")
        self._futures: list[Future[Record]] = []

    def run(
        self, trials: Sequence[Trial], place: Place, limit: float, options: RunOptions, watch: Watch
    ) -> Iterator[Record]:
        """See :meth:`Pool.run`; one process compiles the kernels before the others begin."""
        for child in self.children[: len(trials)]:
            child.begin()
        if len(self.children) > 1:
            for trial in {t.run.model.scale: t for t in trials}.values():
                self.children[0].compile(trial.run, partial(watch, trial))
        for future in as_completed(self.submit(trials, place, limit, options, watch)):
            yield future.result()

    def submit(
        self, trials: Sequence[Trial], place: Place, limit: float, options: RunOptions, watch: Watch
    ) -> list[Future[Record]]:
        """Start ``trials`` as far as processes are idle; futures of their records, in their order."""

        def one(trial: Trial) -> Record:
            child = self._idle.get()
            try:
                watch(trial, 0.0)
                return child.run(trial, place(trial), limit, options, partial(watch, trial))
            finally:
                self._idle.put(child)

        self._futures = [self._watchers.submit(one, trial) for trial in trials]
        return self._futures

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


CONNECT_LIMIT = 10  # s
_thread_data = threading.local()


class DaskPool:
    """Dask cluster with a scheduler at ``address``, one trial a thread; raises :class:`InputError` if none answers."""

    def __init__(self, address: str, threads: int | None = None) -> None:
        self._address, self._threads = address, threads or 1
        self._client = _connect(address)
        self._futures: dict[DaskFuture, Trial] = {}

    def run(
        self, trials: Sequence[Trial], place: Place, limit: float, options: RunOptions, watch: Watch
    ) -> Iterator[Record]:
        """See :meth:`Pool.run`; raises :class:`InputError` for unfit workers, :class:`ResourceError` after a loss."""
        from distributed import as_completed

        for trial in trials:
            order = (trial, place(trial).resolve(), limit, options, self._threads, code_digest())
            self._futures[self._client.submit(_run_on_worker, *order, pure=False)] = trial
        with self._client.as_current():
            completed = as_completed(list(self._futures), raise_errors=False)
        try:
            for future in completed:
                yield self._record(future)
        except KnittestError:
            raise
        except Exception as error:
            raise self._connection_error(error) from error

    def close(self) -> None:
        """See :meth:`Pool.close`; trials that run on the cluster run to their end, and are found in their folders."""
        try:
            self._client.cancel(list(self._futures), force=True)
            self._client.close(CONNECT_LIMIT)
        except Exception as error:  # the cluster is gone: nothing is left to close
            logging.getLogger(__name__).debug("closing the client: %s", error)

    def _record(self, future: "DaskFuture") -> Record:
        from distributed import KilledWorker

        trial = self._futures.pop(future)
        if future.cancelled():
            raise self._connection_error("its tasks were cancelled")
        error = future.exception()
        if error is None:
            record: Record = future.result()
            return record
        if isinstance(error, KilledWorker):
            return Record(trial.key, "crashed", "all workers that ran it were lost")
        if isinstance(error, KnittestError):
            raise error
        raise ResourceError(f"--dask {self._address}: a worker failed: {type(error).__name__}: {error}")

    def _connection_error(self, why: object) -> ResourceError:
        remedy = "finished runs are kept; run the same command again to resume"
        return ResourceError(f"--dask {self._address}: the scheduler is lost ({why}); {remedy}")


def _connect(address: str) -> "Client":
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--dask: Dask is not installed: pip install 'knittest[distributed]'") from None
    for name in [n for n in logging.root.manager.loggerDict if n.partition(".")[0] == "distributed"]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # the exceptions have the same messages
    try:
        asyncio.run(_reach(address))
        return Client(address, timeout=CONNECT_LIMIT, set_as_default=False)
    except (OSError, ValueError) as error:
        why = str(error) or "the handshake failed"
        raise InputError(f"--dask {address}: no scheduler answers: {why}; start one with: dask scheduler") from None


async def _reach(address: str) -> None:
    """Connect to the scheduler once: a ``Client`` would wait without end for a server of another kind."""
    from distributed.comm import connect
    from distributed.security import Security

    comm = await asyncio.wait_for(
        connect(address, timeout=CONNECT_LIMIT, **Security().get_connection_args("client")), CONNECT_LIMIT + 1.0
    )
    comm.abort()


def _run_on_worker(trial: Trial, folder: Path, limit: float, options: RunOptions, threads: int, code: str) -> Record:
    """Run ``trial`` on a worker, in the process of this thread."""
    here = f"the Dask worker on {socket.gethostname()}"
    if code_digest() != code:
        raise InputError(f"{here} has another version of knittest: install the same version on all workers")
    if not folder.parent.is_dir():
        raise InputError(f"{here} cannot see {folder.parent}: choose a shared folder with --out")
    if getattr(_thread_data, "child", None) is None:
        _thread_data.child = Child(threads)
    child: Child = _thread_data.child
    return child.run(trial, folder, limit, options)
