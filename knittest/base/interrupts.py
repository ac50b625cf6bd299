"""Signals that stop a run: noted while a simulation can save itself, raised at once otherwise."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, Self

from knittest.base.errors import KnittestError

#: process status of a run that a signal stopped: temporary failure, try again (sysexits.h)
INTERRUPTED = 75
#: signals of a user, a batch system or its warning before the time limit
STOPPING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGINT", "SIGUSR1") if hasattr(signal, name))


class Interrupted(KeyboardInterrupt):
    """Stop by a signal, no ``Exception`` that a library may swallow; ``folder`` is that of the run, if there is one."""

    folder: Path | None = None


class ProcessSignalHandler:
    """Handler of a whole process: a signal stops it, unless its run was stopped and is already saved."""

    def __init__(self) -> None:
        #: name of the signal that came; empty without
        self.asked = ""
        self.saved = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise :class:`Interrupted`, also again if a library swallowed the last one."""
        if not self.saved:
            self.asked = signal.Signals(number).name
            raise Interrupted(f"stopped by {self.asked}")

    def install(self) -> None:
        """Handle the signals until the process ends."""
        for number in STOPPING:
            signal.signal(number, self)


class Interrupts:
    """Context manager that handles the signals; only the first one counts, so that saving is never cut off."""

    def __init__(self) -> None:
        #: name of the signal that came; empty without
        self.asked = ""
        self._held: Callable[[], bool] = lambda: False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in STOPPING}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            if self.asked and isinstance(handler, ProcessSignalHandler):
                handler.saved = True
            signal.signal(number, handler)

    @contextmanager
    def hold_signals(self, when: Callable[[], bool]) -> Iterator[None]:
        """Only note signals inside the block while ``when`` is true; the block calls :meth:`check` to stop."""
        before, self._held = self._held, when
        try:
            yield
        finally:
            self._held = before

    @contextmanager
    def allow_signals(self) -> Iterator[None]:
        """Let signals stop this block inside one that holds them; also a signal that was noted before."""
        with self.hold_signals(when=lambda: False):
            self.check()
            yield

    @contextmanager
    def translate_errors(self) -> Iterator[None]:
        """Raise :class:`Interrupted` for an error that a library made of a signal."""
        try:
            yield
        except KnittestError:
            raise
        except Exception:
            self.check()
            raise

    def check(self) -> None:
        """Raise :class:`Interrupted` if a signal was noted."""
        if self.asked:
            raise Interrupted(f"stopped by {self.asked}")

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            return
        self.asked = signal.Signals(number).name
        if not self._held():
            self.check()
