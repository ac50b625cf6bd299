"""Progress of a run on standard error: a bar on a terminal, plain lines in a pipe, nothing when quiet; in a notebook a
line of the cell.
"""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from types import TracebackType
from typing import Generic, Self, TextIO, TypeVar

from knittest.base.displays import Display, Status, display_on

D = TypeVar("D")


class OnDisplay(Generic[D]):
    """Base of what is shown on a display of type ``D``, or on none; a closed stream silences it, never the run."""

    _display: D | None = None

    def _safely(self, act: Callable[[D], None]) -> None:
        if self._display is None:
            return
        try:
            act(self._display)
        except (OSError, ValueError):  # a closed pipe, a closed file
            self._display = None


class Progress(OnDisplay[Display]):
    """Phases of a run and the progress within one; a context manager.

    :meth:`phase` ends the phase before it and names the next one, ``compiling kernels (once, about 20 s)``;
    :meth:`update` turns the phase into one with a known end.
    """

    def __init__(
        self,
        *,
        quiet: bool = False,
        stream: TextIO | None = None,
        interval: float = 5.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Show on ``stream`` (standard error, or the cell of a notebook); ``interval`` [s] lies between plain lines."""
        self._clock = clock
        if not quiet:
            self._display = display_on(stream, interval)
        self._phase: str | None = None
        self._until_failure = False
        self._began = 0.0
        self._first: tuple[float, float] | None = None  # clock and fraction of the phase's first update
        self._shown = -math.inf
        self._last: Status | None = None  # of the phase

    def phase(self, text: str, *, until_failure: bool = False) -> None:
        """Begin a phase, which a failure of the specimen may end; the one before it ends with the time it took."""
        self._end_phase()
        self._phase, self._began, self._first, self._shown = text, self._clock(), None, -math.inf
        self._last, self._until_failure = None, until_failure
        self._safely(lambda display: display.begin(text))

    def update(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Report the share done (0 to 1), simulated time [ms], time step [us] and kinetic energy over work [-].

        The last three are NaN where only the share is known.
        """
        now = self._clock()
        if self._first is None:
            self._first = (now, fraction)
        eta = self._eta(now, fraction)
        status = self._last = Status(fraction, time_ms, step_us, kinetic_ratio, eta, self._until_failure)
        if self._display is None or now - self._shown < self._display.interval:
            return
        self._shown = now
        self._safely(lambda display: display.show(self._phase or "running", status))

    def ended(self, text: str, seconds: float) -> None:
        """Tell that ``text``, which went on elsewhere, took ``seconds``; a phase that waited for it is over."""
        self._phase = None
        self.say(f"{text}: done in {seconds:.1f} s")

    def say(self, text: str) -> None:
        """Tell ``text``, in the middle of a phase or between two."""
        self._safely(lambda display: display.say(text))

    def done(self) -> None:
        """End the last phase and take the bar away."""
        self._end_phase()
        self._safely(lambda display: display.close())

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None:
            self._phase = None  # it did not end, so it is not reported as ended
        self.done()

    def _end_phase(self) -> None:
        if self._phase is not None:
            text, seconds = self._phase, self._clock() - self._began
            self._phase = None
            if (
                self._last is not None and self._last.fraction < 1.0
            ):  # the end of the test is 100 %, however far it went
                whole = replace(self._last, fraction=1.0, eta_s=0.0)
                self._safely(lambda display: display.show(text, whole))
            self._safely(lambda display: display.end())
            self.say(f"{text}: done in {seconds:.1f} s")

    def _eta(self, now: float, fraction: float) -> float:
        began, first = self._first or (now, fraction)
        gained = fraction - first
        return (now - began) * (1.0 - fraction) / gained if gained > 0 else math.nan
