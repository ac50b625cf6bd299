"""Signals that stop a run: noted while a simulation can save itself, raised at once everywhere else."""

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
#: asked to stop by a user, a batch system or its warning before the time limit
STOPPING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGINT", "SIGUSR1") if hasattr(signal, name))


class Interrupted(KeyboardInterrupt):
    """Stopped by a signal; the message says how to go on. Not an ``Exception``, so that no library swallows it.

    ``folder`` is that of the run, once there is one.
    """

    folder: Path | None = None


class UntilSaved:
    """Handler of a whole process: a signal stops it, unless one has stopped its run, which is saved already."""

    def __init__(self) -> None:
        #: name of the signal that asked to stop, empty while none did
        self.asked = ""
        self.saved = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Raise :class:`Interrupted`; again if the last one was lost in a callback of a library."""
        if not self.saved:
            self.asked = signal.Signals(number).name
            raise Interrupted(f"stopped by {self.asked}")

    def install(self) -> None:
        """Take over the signals until the process ends."""
        for number in STOPPING:
            signal.signal(number, self)


class Interrupts:
    """A context manager that takes over the signals; only the first one counts, so nothing is cut off while saving."""

    def __init__(self) -> None:
        #: name of the signal that asked to stop, empty while none did
        self.asked = ""
        self._held: Callable[[], bool] = lambda: False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.signal(number, self._note) for number in STOPPING}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            if self.asked and isinstance(handler, UntilSaved):
                handler.saved = True
            signal.signal(number, handler)

    @contextmanager
    def held(self, when: Callable[[], bool]) -> Iterator[None]:
        """Only note signals inside the block ``when`` it holds; whoever is in it calls :meth:`check` to stop."""
        before, self._held = self._held, when
        try:
            yield
        finally:
            self._held = before

    @contextmanager
    def heard(self) -> Iterator[None]:
        """Inside a block that holds them, let signals stop this one; also one that was noted before."""
        with self.held(when=lambda: False):
            self.check()
            yield

    @contextmanager
    def deciding(self) -> Iterator[None]:
        """Let the signal be why the block ended, even where a library made an error of its own of it."""
        try:
            yield
        except KnittestError:
            raise
        except Exception as error:
            if self.asked:
                raise Interrupted(f"stopped by {self.asked}") from error
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
