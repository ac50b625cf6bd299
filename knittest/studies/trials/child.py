"""Parent side of a process that runs trials: started when needed, watched, killed when it hangs."""

import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time as clock
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import IO, Any

from knittest.base.errors import ResourceError
from knittest.base.files import PACKAGE
from knittest.config.run import Run
from knittest.runs.options import RunOptions
from knittest.studies.trials.trial import Record, Trial, code_digest
from knittest.studies.trials.worker import MESSAGE, Messages, Task

#: gets the share of a trial that is done, None while kernels are compiled
ProgressCallback = Callable[[float | None], None]
#: gets lines of the log of a trial, an event and its fields; from any thread
Note = Callable[[Trial, str, dict[str, object]], None]

#: seconds to import, to compile kernels on a slow machine, and to save a checkpoint after a stop
START_LIMIT, COMPILE_LIMIT, GRACE = 300.0, 3600.0, 15.0
#: attempts at a trial whose process died or had no room, and the pause between two of them [s]
ATTEMPTS, PAUSE = 3, 1.0
#: statuses that may change with another attempt
RETRIED_STATUSES = ("crashed", "blocked")
THREAD_VARIABLES = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Child:
    """Process that runs trials one at a time with ``threads`` threads, and is replaced when it dies.

    One thread uses it; :meth:`stop` and :meth:`kill` may come from another. ``note`` gets its log lines and messages;
    the process inherits the file descriptors ``holding``, except on Windows. It ends when its input ends.
    """

    def __init__(self, threads: int = 1, note: Note = lambda *_: None, holding: Sequence[int] = ()) -> None:
        self.threads, self._note, self._holding = threads, note, holding
        self._process: subprocess.Popen[bytes] | None = None
        self._messages: Messages
        self._received: queue.SimpleQueue[tuple[str, Any] | None]
        self._errors: IO[bytes]
        self._stopped = self._greeted = False
        self._lock = threading.Lock()  # so that no process begins after the stop

    def run(
        self, trial: Trial, folder: Path, limit: float, options: RunOptions, heard: ProgressCallback | None = None
    ) -> Record:
        """Run ``trial`` in ``limit`` [s], again if its process dies; raises :class:`ResourceError` for changed code."""
        earlier: list[str] = []
        while True:
            record = self._attempt(Task(trial, folder, options), limit, heard)
            if record.status not in RETRIED_STATUSES or len(earlier) + 1 >= ATTEMPTS or self._stopped:
                return replace(record, earlier=tuple(earlier))
            earlier.append(f"{record.status}: {record.reason}")
            self._note(trial, MESSAGE, {"text": f"{record.reason}; trying again"})
            clock.sleep(PAUSE)

    def compile(self, run: Run, heard: ProgressCallback | None = None) -> None:
        """Compile the kernels that ``run`` needs, unless they are kept; a failure shows when they are used."""
        try:
            self._start()
            self._messages.send(run)
            self._wait_for(("compiled",), COMPILE_LIMIT, heard)
        except (EOFError, OSError):
            self.close()

    def stop(self) -> None:
        """Ask the process to end, with a checkpoint if it runs a trial; no other process begins."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                self._messages.end()

    def kill(self) -> None:
        """Kill the process and all that it started."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                _kill_group(self._process)
                self._process.wait()

    def close(self) -> str:
        """Release the process, dead or alive; returns how it died and the last line of its standard error."""
        with self._lock:
            process, self._process = self._process, None
        if process is None:
            return ""
        with suppress(subprocess.TimeoutExpired):
            process.wait(1.0)  # its connection ends a moment before
        code = process.poll()
        _kill_group(process)
        process.wait()
        self._messages.close()
        self._errors.seek(0)
        words = self._errors.read().decode("utf-8", "replace").strip().splitlines()[-1:]
        self._errors.close()
        how = "did not answer" if code is None else f"exited with {code}"
        if code is not None and code < 0:
            how = f"was killed by {signal.Signals(-code).name}"
        return ": ".join([f"its process {how}", *words])

    def _attempt(self, task: Task, limit: float, heard: ProgressCallback | None) -> Record:
        start, key = clock.monotonic(), task.trial.key
        try:
            self._start()
            self._messages.send(task)
            note = partial(self._note, task.trial)
            what, value = self._wait_for(("started", "record"), COMPILE_LIMIT, heard, note)
            start = clock.monotonic()
            if what == "started":
                try:
                    what, value = self._wait_for(("record",), limit, heard, note)
                except TimeoutError:
                    self._end()
                    return Record(key, "timeout", f"not finished after {limit:g} s", seconds=limit, limit=limit)
        except (EOFError, OSError) as error:
            return Record(key, "crashed", self.close() or str(error), seconds=clock.monotonic() - start)
        record: Record = value
        if record.status in ("error", "blocked"):
            self._end()  # its memory is not to be trusted
        return record

    def begin(self) -> None:
        """Start the process if there is none, without waiting for it; raises ``EOFError`` after a stop."""
        with self._lock:
            if self._stopped:
                raise EOFError("stopped")
            if self._process is not None:
                return
            self._greeted = False
            self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
            path = os.pathsep.join([str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "knittest.studies.trials.worker"],
                pass_fds=self._holding if os.name == "posix" else (), start_new_session=True,
                env=os.environ | {"PYTHONPATH": path} | dict.fromkeys(THREAD_VARIABLES, str(self.threads)),
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
            )  # fmt: skip
            assert self._process.stdin is not None and self._process.stdout is not None
            self._messages = Messages(self._process.stdout, self._process.stdin)
            self._received = queue.SimpleQueue()
            threading.Thread(target=_receive_all, args=(self._messages, self._received), daemon=True).start()

    def _start(self) -> None:
        self.begin()
        if self._greeted:
            return
        self._greeted = True
        if self._wait_for(("code",), START_LIMIT)[1] != code_digest():
            self._end()
            raise ResourceError("the code of knittest changed while it ran; run the same command again")

    def _wait_for(
        self, wanted: tuple[str, ...], limit: float, heard: ProgressCallback | None = None,
        note: Callable[[str, dict[str, object]], None] | None = None,
    ) -> tuple[str, Any]:  # fmt: skip
        """Return the first ``wanted`` message; raises ``TimeoutError``, or ``EOFError`` when the process is gone."""
        end = clock.monotonic() + limit
        while True:
            try:
                message = self._received.get(timeout=max(end - clock.monotonic(), 0.0))
            except queue.Empty:
                raise TimeoutError(f"no answer in {limit:g} s") from None
            if message is None:
                raise EOFError
            what, value = message
            if what in wanted:
                return what, value
            if what == "at" and heard is not None:
                heard(value)
            if what == "log" and note is not None:
                note(*value)

    def _end(self) -> None:
        """Ask the process to end, with a checkpoint if it runs a trial, and kill it if it does not."""
        if self._process is not None:
            self._messages.end()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(GRACE)
            self.close()


def _receive_all(messages: Messages, received: "queue.SimpleQueue[tuple[str, Any] | None]") -> None:
    """Put all messages that come in into ``received``, and None at their end."""
    try:
        with suppress(EOFError, OSError, ValueError, pickle.UnpicklingError):  # the process died, perhaps in a message
            while True:
                received.put(messages.receive())
    finally:
        received.put(None)


def _kill_group(process: "subprocess.Popen[bytes]") -> None:
    with suppress(OSError):
        if os.name == "posix":
            os.killpg(process.pid, signal.SIGKILL)
        else:  # what it started ends when its input does
            process.kill()
