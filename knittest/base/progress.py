"""Progress and messages of a run: a bar on a terminal, lines in a pipe, one line in a notebook cell."""

import math
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Generic, Self, TextIO, TypeVar


def is_in_notebook() -> bool:
    """Tell whether the kernel of a notebook runs this code."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return shell is not None and "IPKernelApp" in shell.config


class CellText:
    """Text in the output of the notebook cell that first shows it."""

    def __init__(self) -> None:
        self._handle: Any = None

    def show(self, text: str) -> None:
        """Replace the text by ``text``."""
        from IPython.display import display

        if self._handle is None:
            self._handle = display({"text/plain": text}, raw=True, display_id=True)
        else:
            self._handle.update({"text/plain": text}, raw=True)


_REFRESH_S = 0.1
#: columns of the bar, and of its percentage with gaps
SHORTEST, LONGEST, SHARE = 10, 30, 8
#: kinetic energy over work above which the ratio has no meaning yet
MEANT = 1.0


@dataclass(frozen=True)
class Status:
    """State of a running simulation: share done, simulated time [ms], step [us], kinetic energy over work, time left.

    Share and time left [s] refer to the whole motion of the rig; a test ``until_failure`` usually ends before.
    """

    fraction: float
    time_ms: float
    step_us: float
    kinetic_ratio: float
    eta_s: float
    until_failure: bool = False

    def text(self) -> str:
        """Text on one line, without the share done."""
        eta, failure, *rest = self._parts()
        return "  ".join(filter(None, [eta + failure, *rest]))

    def text_within(self, room: int) -> str:
        """:meth:`text` within ``room`` columns: what matters least is left out first, the time left never."""
        eta, failure, *rest = self._parts()
        for kept in (rest, rest[:2], rest[:1], []):
            if len(text := "  ".join(filter(None, [eta + failure, *kept]))) <= room:
                return text
        return eta

    def _parts(self) -> list[str]:
        """Time left, note on failure, time, step and kinetic energy, as far as they are known."""
        going = self.fraction < 1.0  # at the end broken parts fly apart
        eta = f"ETA {duration(self.eta_s)}" if going else ""
        failure = " or until failure" if going and self.until_failure else ""
        if math.isnan(self.time_ms):  # run in another process
            return [eta, failure]
        share = f"{self.kinetic_ratio * 100:.2g} %" if self.kinetic_ratio <= MEANT else "-"
        ratio = [f"kinetic/work {share}"] if going else []
        return [eta, failure, f"time {self.time_ms:.3f} ms", f"step {self.step_us:.3g} us", *ratio]


class Display:
    """Display of the current phase and of lines; subclasses say where."""

    interval: float

    def begin(self, text: str) -> None:
        """Show the phase ``text``, whose end is not known."""

    def show(self, text: str, status: Status) -> None:
        """Show the progress of a phase."""

    def end(self) -> None:
        """End the phase."""

    def say(self, text: str) -> None:
        """Write a line that stays."""

    def close(self) -> None:
        """Remove the bar."""


def display_on(stream: TextIO | None, interval: float) -> Display | None:
    """Display on ``stream`` (standard error, or the cell of a notebook), None where there is nothing to write on."""
    if stream is None and is_in_notebook():
        return _Cell()
    stream = stream or sys.stderr
    if stream is None:
        return None
    return _Bar(stream) if stream.isatty() else _Lines(stream, interval)


class _Cell(Display):
    """One line in a notebook cell: the current phase, at last how long the last one took."""

    interval = 0.5

    def __init__(self) -> None:
        self._text = CellText()

    def begin(self, text: str) -> None:
        self._text.show(text)

    say = begin

    def show(self, text: str, status: Status) -> None:
        self.say(f"{text}  {status.fraction * 100:3.0f} %  {status.text()}".rstrip())


class _Lines(Display):
    """Plain lines, for a pipe, a log or CI."""

    def __init__(self, stream: TextIO, interval: float) -> None:
        self._stream, self.interval = stream, interval

    def begin(self, text: str) -> None:
        write_line(self._stream, text)

    def show(self, text: str, status: Status) -> None:
        if math.isfinite(status.eta_s):
            write_line(self._stream, f"{status.fraction * 100:4.0f} %  {status.text()}".rstrip())

    say = begin


class _Bar(Display):
    """Live bar of rich; only the calls draw it, because a thread could fail on its own."""

    interval = _REFRESH_S

    def __init__(self, stream: TextIO) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        self._console = Console(file=stream, highlight=False, markup=False)
        self._drawn = BarColumn(bar_width=LONGEST)
        fields = ("description", "fields[share]", "fields[status]")
        columns: list[Any] = [TextColumn(f"{{task.{field}}}", markup=False) for field in fields]
        columns.insert(1, self._drawn)
        self._bar = RichProgress(*columns, console=self._console, auto_refresh=False, transient=True)
        self._task = self._bar.add_task("", total=None, share="", status="", visible=False)

    def begin(self, text: str) -> None:
        self._bar.start()
        self._drawn.bar_width = max(SHORTEST, min(LONGEST, self._console.width - len(text) - 4))
        self._bar.reset(self._task, description=text, total=None, visible=True, start=True, share="", status="")
        self._bar.refresh()

    def show(self, text: str, status: Status) -> None:
        self._bar.start()
        name, self._drawn.bar_width, rest = fit_line(text, status, self._console.width)
        self._bar.update(
            self._task, description=name, total=1.0, completed=status.fraction, status=rest, visible=True,
            share=f"{status.fraction * 100:3.0f} %",
        )  # fmt: skip
        self._bar.refresh()

    def end(self) -> None:
        self._bar.update(self._task, visible=False)

    def say(self, text: str) -> None:
        self._console.print(text)

    def close(self) -> None:
        self._bar.stop()


def fit_line(text: str, status: Status, width: int) -> tuple[str, int, str]:
    """Name, bar columns and status of a phase within ``width``; a narrow line shortens bar, status, then name."""
    room = width - SHARE - len(text)
    shown = status.text_within(room - SHORTEST)
    bar = max(SHORTEST, min(LONGEST, room - len(shown)))
    most = width - SHARE - bar - len(shown)
    return (text if len(text) <= most else f"{text[: max(most - 1, 0)]}…"), bar, shown


def duration(seconds: float) -> str:
    """Time such as ``0:07``, ``12:30`` or ``2:03:00``; ``-:--`` while unknown."""
    if not math.isfinite(seconds):
        return "-:--"
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def write_line(stream: TextIO, text: str) -> None:
    """Write ``text`` as a line, at once."""
    stream.write(text + "\n")
    stream.flush()


D = TypeVar("D")


class OnDisplay(Generic[D]):
    """Base of output on a display of type ``D``, or on none; a closed stream ends the output, never the run."""

    _display: D | None = None

    def _try_on_display(self, act: Callable[[D], None]) -> None:
        if self._display is None:
            return
        try:
            act(self._display)
        except (OSError, ValueError):  # a closed pipe, a closed file
            self._display = None


class Progress(OnDisplay[Display]):
    """Context manager for the phases of a run and the progress within one.

    :meth:`phase` ends the previous phase and names the next one, such as ``compiling kernels (once, about 20 s)``;
    :meth:`update` gives the phase a known end.
    """

    def __init__(
        self, *, quiet: bool = False, stream: TextIO | None = None, interval: float = 5.0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        """Show on ``stream`` (default: standard error, or the notebook cell), plain lines every ``interval`` [s]."""
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
        """Begin a phase, which a failure of the specimen may end; the previous one ends with its time."""
        self._end_phase()
        self._phase, self._began, self._first, self._shown = text, self._clock(), None, -math.inf
        self._last, self._until_failure = None, until_failure
        self._try_on_display(lambda display: display.begin(text))

    def update(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Report the share done (0 to 1), simulated time [ms], time step [us] and kinetic energy over work (or nan)."""
        now = self._clock()
        if self._first is None:
            self._first = (now, fraction)
        eta = self._eta(now, fraction)
        status = self._last = Status(fraction, time_ms, step_us, kinetic_ratio, eta, self._until_failure)
        if self._display is None or now - self._shown < self._display.interval:
            return
        self._shown = now
        self._try_on_display(lambda display: display.show(self._phase or "running", status))

    def abandon_phase(self) -> None:
        """End the phase without a result: no line calls it done."""
        self._phase = None
        self._try_on_display(lambda display: display.end())

    def report_done(self, text: str, seconds: float) -> None:
        """Report that ``text``, in another process, took ``seconds``; it ends a phase that waited for it."""
        self._phase = None
        self.say(f"{text}: done in {seconds:.1f} s")

    def say(self, text: str) -> None:
        """Write the line ``text``, in or between phases."""
        self._try_on_display(lambda display: display.say(text))

    def finish(self) -> None:
        """End the last phase and remove the bar."""
        self._end_phase()
        self._try_on_display(lambda display: display.close())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            self.abandon_phase()
        self.finish()

    def _end_phase(self) -> None:
        if self._phase is not None:
            text, seconds = self._phase, self._clock() - self._began
            self._phase = None
            if self._last is not None and self._last.fraction < 1.0:  # the end of the test is 100 %, wherever it is
                whole = replace(self._last, fraction=1.0, eta_s=0.0)
                self._try_on_display(lambda display: display.show(text, whole))
            self._try_on_display(lambda display: display.end())
            self.say(f"{text}: done in {seconds:.1f} s")

    def _eta(self, now: float, fraction: float) -> float:
        began, first = self._first or (now, fraction)
        gained = fraction - first
        return (now - began) * (1.0 - fraction) / gained if gained > 0 else math.nan


def tell(text: str) -> None:
    """Print ``text`` as a line of knittest on standard error, unless that is closed."""
    with suppress(OSError, ValueError, AttributeError):  # stderr full, closed, or not there at all
        print(f"knittest: {text}", file=sys.stderr, flush=True)
