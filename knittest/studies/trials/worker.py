"""Process that runs trials, one after the other, for a :class:`knittest.studies.trials.child.Child`.

It keeps imports and kernels from trial to trial. When its parent is gone it saves a checkpoint and ends.
"""

import faulthandler
import io
import os
import pickle
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
from pathlib import Path
from typing import IO, Any, TextIO

from knittest.base.errors import OUT_OF_MEMORY, InputError, NumericalError, ResourceError, is_out_of_memory
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.base.progress import Progress
from knittest.config.run import Run
from knittest.runs.options import RunOptions
from knittest.solve.threads import use_threads
from knittest.studies.trials.trial import Record, Status, Trial, code_digest, record_of

#: sends a message to the parent: its kind and its value
Send = Callable[[str, object], None]
#: event in the log: a line on standard error
MESSAGE = "said"
#: seconds between two messages on the progress of a trial
PROGRESS_INTERVAL = 0.5


@dataclass(frozen=True)
class Task:
    """Order to run ``trial`` in ``folder`` with ``options``."""

    trial: Trial
    folder: Path
    options: RunOptions


class Messages:
    """Objects of Python in both directions, by pipes that every operating system has."""

    def __init__(self, incoming: IO[bytes], outgoing: IO[bytes]) -> None:
        self._incoming, self._outgoing = incoming, outgoing
        self._lock = threading.Lock()

    def send(self, message: object) -> None:
        """Send ``message`` whole, from any thread; raises ``OSError`` when no process reads any more."""
        content = pickle.dumps(message)
        with self._lock:
            if self._outgoing.closed:
                raise BrokenPipeError("stopped")
            self._outgoing.write(content)
            self._outgoing.flush()

    def receive(self) -> Any:
        """Wait for the next message; raises ``EOFError`` when there will be none."""
        return pickle.load(self._incoming)

    def end(self) -> None:
        """Send nothing more, so that the reader ends."""
        with self._lock, suppress(OSError):
            self._outgoing.close()

    def close(self) -> None:
        """Close both directions."""
        self.end()
        self._incoming.close()


def serve(messages: Messages) -> None:
    """Do the tasks that come in, a :class:`Task` to run or a :class:`Run` whose kernels to compile, until none can."""
    tasks: queue.SimpleQueue[Task | Run] = queue.SimpleQueue()

    def send(what: str, value: object) -> None:
        messages.send((what, value))

    threading.Thread(target=_listen, args=(messages, tasks), daemon=True).start()
    send("code", code_digest())
    use_threads(None)
    with redirect_stderr(_StandardError(sys.stderr, send)):
        while True:
            task = tasks.get()
            if isinstance(task, Run):
                _load_kernels(task, send)
                send("compiled", None)
            else:
                send("record", perform(task, send))


def perform(task: Task, send: Send) -> Record:
    """Run the trial of ``task``; its record has any error. Only a signal raises."""
    from knittest.runs.execute import execute, execute_specimen
    from knittest.studies.trials.trial import TrialFolder

    start = clock.perf_counter()
    key, run, specimen = task.trial.key, task.trial.run, task.trial.specimen
    try:
        with Interrupts() as interrupts:
            _load_kernels(run, send)  # before the clock of the time limit starts
            send("started", None)
            start = clock.perf_counter()
            if specimen is not None:
                execute_specimen(run, specimen, task.folder, interrupts, partial(_send_log, send), _ProgressRelay(send))
                return Record(key, "completed", seconds=clock.perf_counter() - start)
            place = task.trial.place or TrialFolder(task.folder)
            outcome = execute(run, place, interrupts, task.options, _ProgressRelay(send))
    except Exception as error:
        return Record(key, *_classify(error), seconds=clock.perf_counter() - start)
    return record_of(key, outcome.summary, clock.perf_counter() - start)


def main() -> None:
    """Serve the process at the other end of standard input and output; whatever else is printed goes nowhere."""
    faulthandler.enable()
    with open(os.dup(sys.stdout.fileno()), "wb") as outgoing, open(os.devnull, "wb") as nowhere:  # noqa: PTH123
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
        _serve_until_stopped(Messages(sys.stdin.buffer, outgoing))


def _serve_until_stopped(messages: Messages) -> None:
    try:
        serve(messages)
    except (Interrupted, OSError):  # stopped, or the parent is gone
        sys.exit(1)


class _ProgressRelay(Progress):
    """Sends the progress of a trial to the parent, and shows nothing."""

    def __init__(self, send: Send) -> None:
        super().__init__(quiet=True)
        self._send, self._sent_at = send, 0.0

    def update(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """See :meth:`Progress.update`."""
        if not isnan(time_ms) and clock.monotonic() - self._sent_at >= PROGRESS_INTERVAL:  # not while it comes to rest
            self._sent_at = clock.monotonic()
            with suppress(OSError):  # the parent is gone: the signal that follows ends the run
                self._send("at", fraction)


class _StandardError(io.TextIOBase):
    """Standard error of this process; its lines, warnings and notes to the user, go to the parent as well."""

    def __init__(self, stream: TextIO, send: Send) -> None:
        self._stream, self._send, self._begun = stream, send, ""

    def write(self, text: str) -> int:
        """Write ``text`` and send the lines that are complete."""
        *lines, self._begun = (self._begun + text).split("\n")
        for line in filter(None, lines):
            with suppress(OSError):  # the parent is gone
                _send_log(self._send, MESSAGE, text=line)
        return self._stream.write(text)

    def flush(self) -> None:
        """See :meth:`io.IOBase.flush`."""
        self._stream.flush()


def _send_log(send: Send, event: str, **fields: object) -> None:
    """Send a line of the log, which the parent writes."""
    send("log", (event, fields))


def _listen(messages: Messages, tasks: "queue.SimpleQueue[Task | Run]") -> None:
    """Pass tasks on; when the parent is gone, stop with a checkpoint, as a user would."""
    try:
        while True:
            tasks.put(messages.receive())
    except (EOFError, OSError):
        if os.name == "posix":
            os.kill(os.getpid(), signal.SIGTERM)  # wakes the main thread
        else:  # where os.kill would end the process at once
            signal.raise_signal(signal.SIGTERM)


def _load_kernels(run: Run, send: Send) -> None:
    """Load the kernels that ``run`` needs, or compile them and say so."""
    from knittest.solve.compilation import load_kernels, missing_kernels

    if missing_kernels(run):
        send("at", None)
    load_kernels(run)


def _classify(error: Exception) -> tuple[Status, str]:
    """Status and reason of a trial that ended with ``error``; a bug has its place in the code."""
    if is_out_of_memory(error):
        return "blocked", OUT_OF_MEMORY
    statuses: dict[type, Status] = {NumericalError: "failed", InputError: "invalid", ResourceError: "blocked"}
    for kind, status in statuses.items():
        if isinstance(error, kind):
            return status, str(error)
    last = traceback.extract_tb(error.__traceback__)[-1]
    return "error", f"{type(error).__name__}: {error} ({Path(last.filename).name}:{last.lineno})"


if __name__ == "__main__":
    main()
