"""The process that runs trials, one after the other, for a :class:`knittest.studies.trials.child.Child`.

It keeps imports and kernels from trial to trial. When its parent is gone it saves a checkpoint and ends.
"""

import faulthandler
import io
import os
import queue
import signal
import sys
import threading
import time as clock
import traceback
from collections.abc import Callable
from contextlib import redirect_stderr, suppress
from dataclasses import dataclass
from functools import partial
from math import isnan
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TextIO

from knittest.base.errors import OUT_OF_MEMORY, InputError, NumericalError, ResourceError, is_out_of_memory
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.progress import Progress
from knittest.config.run import Run
from knittest.runs.options import RunOptions
from knittest.solve.threads import use_threads
from knittest.studies.trials.trial import Record, Status, Trial, code_digest, record_of

#: sends a message, its kind and its value, to the parent
Told = Callable[[str, object], None]
#: event in the log: a line that was said on standard error
SAID = "said"
#: seconds between two messages on how far a trial is
BEAT = 0.5


@dataclass(frozen=True)
class Task:
    """Task of a process: run ``trial`` in ``folder``, keeping ``options``."""

    trial: Trial
    folder: Path
    options: RunOptions


def serve(connection: Connection) -> None:
    """Do the tasks that come in, a :class:`Task` to run or a :class:`Run` whose kernels to compile, until none can."""
    tasks: queue.SimpleQueue[Task | Run] = queue.SimpleQueue()

    lock = threading.Lock()

    def told(what: str, value: object) -> None:
        with lock:
            connection.send((what, value))

    threading.Thread(target=_listen, args=(connection, tasks), daemon=True).start()
    told("code", code_digest())
    use_threads(None)
    with redirect_stderr(_Heard(sys.stderr, told)):
        while True:
            task = tasks.get()
            if isinstance(task, Run):
                _warm(task, told)
                told("compiled", None)
            else:
                told("record", perform(task, told))


def perform(task: Task, told: Told) -> Record:
    """Run the trial of ``task`` here; whatever goes wrong with it is in the record. Only a signal comes through."""
    from knittest.runs.execute import execute, execute_specimen
    from knittest.studies.trials.trial import TrialFolder

    start = clock.perf_counter()
    key = task.trial.key
    try:
        with Interrupts() as interrupts:
            _warm(task.trial.run, told)  # before the clock of the time limit starts
            told("started", None)
            start = clock.perf_counter()
            run, specimen = task.trial.run, task.trial.specimen
            if specimen is not None:
                execute_specimen(run, specimen, task.folder, interrupts, partial(_tell_log, told), _Relay(told))
                return Record(key, "completed", seconds=clock.perf_counter() - start)
            place = task.trial.place or TrialFolder(task.folder)
            outcome = execute(run, place, interrupts, task.options, _Relay(told))
    except Exception as error:
        status, reason = _judged(error)
        return Record(key, status, reason, seconds=clock.perf_counter() - start)
    return record_of(key, outcome.summary, clock.perf_counter() - start)


def main() -> None:
    """Serve the connection whose file descriptor is the first argument."""
    faulthandler.enable()
    try:
        serve(Connection(int(sys.argv[1])))
    except (Interrupted, OSError):  # stopped, or nobody reads any more
        sys.exit(1)


class _Relay(Progress):
    """Passes on how far a trial is, and shows nothing."""

    def __init__(self, told: Told) -> None:
        super().__init__(quiet=True)
        self._told, self._told_at = told, 0.0

    def update(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """See :meth:`Progress.update`."""
        if not isnan(time_ms) and clock.monotonic() - self._told_at >= BEAT:  # not while it comes to rest
            self._told_at = clock.monotonic()
            with suppress(OSError):  # the parent is gone: the signal that follows ends the run
                self._told("at", fraction)


class _Heard(io.TextIOBase):
    """Standard error of this process, whose lines the parent hears as well: warnings, and notes to the user."""

    def __init__(self, stream: TextIO, told: Told) -> None:
        self._stream, self._told, self._begun = stream, told, ""

    def write(self, text: str) -> int:
        """Write ``text`` and pass on what is whole lines by now."""
        *lines, self._begun = (self._begun + text).split("\n")
        for line in filter(None, lines):
            with suppress(OSError):  # nobody is there any more
                _tell_log(self._told, SAID, text=line)
        return self._stream.write(text)

    def flush(self) -> None:
        """See :meth:`io.IOBase.flush`."""
        self._stream.flush()


def _tell_log(told: Told, event: str, **fields: object) -> None:
    """Pass on a line of the log that the parent writes."""
    told("log", (event, fields))


def _listen(connection: Connection, tasks: "queue.SimpleQueue[Task | Run]") -> None:
    """Pass tasks on; when the parent is gone, stop as a user would stop a run: with a checkpoint."""
    try:
        while True:
            tasks.put(connection.recv())
    except (EOFError, OSError):
        os.kill(os.getpid(), signal.SIGTERM)


def _warm(run: Run, told: Told) -> None:
    """Load the kernels that ``run`` needs, or compile them and say so."""
    from knittest.solve.compiling import lacking, warm

    if lacking(run):
        told("at", None)
    warm(run)


def _judged(error: Exception) -> tuple[Status, str]:
    if is_out_of_memory(error):
        return "blocked", OUT_OF_MEMORY
    statuses: dict[type, Status] = {NumericalError: "failed", InputError: "invalid", ResourceError: "blocked"}
    found = next((status for kind, status in statuses.items() if isinstance(error, kind)), None)
    return (found, str(error)) if found else ("error", _located(error))


def _located(error: Exception) -> str:
    """Error with its place in the code, for a bug report."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"


if __name__ == "__main__":
    main()
