"""The parent's side of a process that runs trials: started when needed, watched, killed when it hangs."""

import os
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
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import IO, Any

from knittest.base.errors import ResourceError
from knittest.base.files import PACKAGE
from knittest.config.run import Run
from knittest.runs.options import RunOptions
from knittest.studies.trials.trial import Record, Trial, code_digest
from knittest.studies.trials.work import SAID, Task

#: hears the share of a trial that is done, None while kernels are compiled
Heard = Callable[[float | None], None]
#: hears lines of the log of a trial, an event and its fields; from any thread
Note = Callable[[Trial, str, dict[str, object]], None]

#: seconds to import, to compile kernels on a slow machine, and to save a checkpoint when stopped
START_LIMIT, COMPILE_LIMIT, GRACE = 300.0, 3600.0, 15.0
#: how often a trial is tried whose process died or found no room, and the pause before it is tried again [s]
ATTEMPTS, PAUSE = 3, 1.0
#: what may change from one attempt to the next
AGAIN = ("crashed", "blocked")
THREAD_VARIABLES = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Child:
    """One process that runs trials with ``threads`` threads, one at a time, and is replaced when it dies.

    One thread uses it; :meth:`stop` and :meth:`kill` may come from another. ``note`` hears what it logs and says, and
    the process inherits the file descriptors ``holding``.
    """

    def __init__(self, threads: int = 1, note: Note = lambda *_: None, holding: Sequence[int] = ()) -> None:
        self.threads, self._note, self._holding = threads, note, holding
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection
        self._errors: IO[bytes]
        self._stopped = self._greeted = False
        self._lock = threading.Lock()  # so that no process begins after the stop

    @property
    def pid(self) -> int | None:
        """Process id, while there is a process."""
        process = self._process
        return None if process is None else process.pid

    def run(self, trial: Trial, folder: Path, limit: float, options: RunOptions, heard: Heard | None = None) -> Record:
        """Run ``trial`` in ``folder`` in at most ``limit`` seconds, several times if its process dies.

        Raises :class:`ResourceError` when the code of knittest is not that of this process.
        """
        earlier: list[str] = []
        while True:
            record = self._attempt(Task(trial, folder, options), limit, heard)
            if record.status not in AGAIN or len(earlier) + 1 >= ATTEMPTS or self._stopped:
                return replace(record, earlier=tuple(earlier))
            earlier.append(f"{record.status}: {record.reason}")
            self._note(trial, SAID, {"text": f"{record.reason}; tried again"})
            clock.sleep(PAUSE)

    def compile(self, run: Run, heard: Heard | None = None) -> None:
        """Compile the kernels that ``run`` needs, if that was never done; a failure shows when they are used."""
        try:
            self._start()
            self._connection.send(run)
            self._wait_for(("compiled",), COMPILE_LIMIT, heard)
        except (EOFError, OSError):
            self._bury()

    def stop(self) -> None:
        """Ask the process to end, with a checkpoint if it runs a trial; no other one begins."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                self._process.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """End the process for good, and what it started itself."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                _kill_group(self._process)
                self._process.wait()

    def close(self) -> None:
        """Let go of what is left of a process that was ended."""
        self._bury()

    def _attempt(self, task: Task, limit: float, heard: Heard | None) -> Record:
        start, key = clock.monotonic(), task.trial.key
        try:
            self._start()
            self._connection.send(task)
            note = partial(self._note, task.trial)
            what, value = self._wait_for(("started", "record"), COMPILE_LIMIT, heard, note)
            start = clock.monotonic()
            if what == "started":
                try:
                    what, value = self._wait_for(("record",), limit, heard, note)
                except TimeoutError:
                    self._end()
                    return Record(key, "timeout", f"not done after {limit:g} s", seconds=limit, limit=limit)
        except (EOFError, OSError) as error:
            return Record(key, "crashed", self._bury() or str(error), seconds=clock.monotonic() - start)
        record: Record = value
        if record.status in ("error", "blocked"):
            self._end()  # what it has in memory is not to be trusted
        return record

    def begin(self) -> None:
        """Start the process if there is none, without waiting for it; raises ``EOFError`` after a stop."""
        with self._lock:
            if self._stopped:
                raise EOFError("stopped")
            if self._process is not None:
                return
            self._greeted = False
            self._connection, theirs = Pipe()
            self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
            command = [sys.executable, "-P", "-m", "knittest.studies.trials.work", str(theirs.fileno())]
            self._process = subprocess.Popen(
                command, pass_fds=[theirs.fileno(), *self._holding], env=self._environment(), start_new_session=True,
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._errors,
            )  # fmt: skip
            theirs.close()

    def _start(self) -> None:
        self.begin()
        if self._greeted:
            return
        self._greeted = True
        if self._wait_for(("code",), START_LIMIT)[1] != code_digest():
            self._end()
            raise ResourceError("the code of knittest changed while it ran; run the same command again")

    def _environment(self) -> dict[str, str]:
        path = os.pathsep.join([str(PACKAGE.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
        return os.environ | {"PYTHONPATH": path} | dict.fromkeys(THREAD_VARIABLES, str(self.threads))

    def _wait_for(
        self,
        wanted: tuple[str, ...],
        limit: float,
        heard: Heard | None = None,
        note: Callable[[str, dict[str, object]], None] | None = None,
    ) -> tuple[str, Any]:
        """The first message that is ``wanted``; raises ``TimeoutError``, or ``EOFError`` when the process is gone."""
        end = clock.monotonic() + limit
        while self._connection.poll(max(end - clock.monotonic(), 0.0)):
            what, value = self._connection.recv()
            if what in wanted:
                return what, value
            if what == "at" and heard is not None:
                heard(value)
            if what == "log" and note is not None:
                note(*value)
        raise TimeoutError(f"no answer in {limit:g} s")

    def _end(self) -> None:
        """Ask the process to end, with a checkpoint if it runs a trial, and make sure of it."""
        if self._process is not None:
            self._process.send_signal(signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(GRACE)
            self._bury()

    def _bury(self) -> str:
        """Let go of the process, dead or not; how it died and its last words."""
        with self._lock:
            process, self._process = self._process, None
        if process is None:
            return ""
        with suppress(subprocess.TimeoutExpired):
            process.wait(1.0)  # its connection ends a moment before
        alone = process.poll()
        _kill_group(process)
        process.wait()
        self._connection.close()
        words = _last_words(self._errors)
        self._errors.close()
        return _obituary(alone) + (f": {words}" if words else "")


def _kill_group(process: "subprocess.Popen[bytes]") -> None:
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)


def _obituary(code: int | None) -> str:
    if code is None:
        return "its process gave no answer"
    return f"its process was killed by {signal.Signals(-code).name}" if code < 0 else f"its process ended with {code}"


def _last_words(errors: IO[bytes]) -> str:
    errors.seek(0)
    lines = errors.read().decode("utf-8", "replace").strip().splitlines()
    return lines[-1] if lines else ""
