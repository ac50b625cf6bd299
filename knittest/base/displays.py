"""Displays of the progress of a run: a bar on a terminal, plain lines in a pipe, a line of a notebook's cell."""

import math
import sys
from dataclasses import dataclass
from typing import Protocol, TextIO

from knittest.base.notebook import CellText, in_notebook

_REFRESH_S = 0.1
#: columns of a bar, and of its percents with the gaps of a line
SHORTEST, LONGEST, SHARE = 10, 30, 8
#: kinetic energy over work above which the work has hardly begun
MEANT = 1.0


@dataclass(frozen=True)
class Status:
    """State of a simulation on its way: share done, simulated time [ms], step [us], kinetic energy over work, seconds
    left.

    Share and seconds count to the end of the rig's motion; a test ``until_failure`` mostly ends before.
    """

    fraction: float
    time_ms: float
    step_us: float
    kinetic_ratio: float
    eta_s: float
    until_failure: bool = False

    def text(self) -> str:
        """One line, without the share done."""
        eta, failure, *rest = self._parts()
        return "  ".join(filter(None, [eta + failure, *rest]))

    def fitting(self, room: int) -> str:
        """:meth:`text` within ``room`` columns: what matters least is left out first, the time left never."""
        eta, failure, *rest = self._parts()
        for kept in (rest, rest[:2], rest[:1], []):
            if len(text := "  ".join(filter(None, [eta + failure, *kept]))) <= room:
                return text
        return eta

    def _parts(self) -> list[str]:
        """Time left, that a failure may end it, time, step and kinetic energy, as far as they are told."""
        going = self.fraction < 1.0  # at the end the gates tell, and what is broken flies apart
        eta = f"ETA {duration(self.eta_s)}" if going else ""
        failure = " or until failure" if going and self.until_failure else ""
        if math.isnan(self.time_ms):  # of a run in another process
            return [eta, failure]
        # before the first work, or of what only falls so far, the ratio means nothing
        share = f"{self.kinetic_ratio * 100:.2g} %" if self.kinetic_ratio <= MEANT else "-"
        ratio = [f"kinetic/work {share}"] if going else []
        return [eta, failure, f"time {self.time_ms:.3f} ms", f"step {self.step_us:.3g} us", *ratio]


class Display(Protocol):
    """Shows the phase under way and says lines."""

    interval: float

    def begin(self, text: str) -> None:
        """Show the phase ``text``, whose end is not known."""

    def show(self, text: str, status: Status) -> None:
        """Show how far it is."""

    def end(self) -> None:
        """Show no phase."""

    def say(self, text: str) -> None:
        """Write a line that stays."""

    def close(self) -> None:
        """Leave what was said."""


def display_on(stream: TextIO | None, interval: float) -> Display | None:
    """Display on ``stream`` (standard error, or the cell of a notebook), None where there is nothing to write on."""
    if stream is None and in_notebook():
        return _Cell()
    stream = stream or sys.stderr
    if stream is None:
        return None
    return _Bar(stream) if stream.isatty() else _Lines(stream, interval)


class _Cell:
    """One line in a notebook's cell, which tells the present phase, at last how long the last one took."""

    interval = 0.5

    def __init__(self) -> None:
        self._text = CellText()

    def begin(self, text: str) -> None:
        self._text.show(text)

    def show(self, text: str, status: Status) -> None:
        self._text.show(f"{text}  {status.fraction * 100:3.0f} %  {status.text()}".rstrip())

    def end(self) -> None:
        pass

    def say(self, text: str) -> None:
        self._text.show(text)

    def close(self) -> None:
        pass


class _Lines:
    """Plain lines, for a pipe, a log or CI."""

    def __init__(self, stream: TextIO, interval: float) -> None:
        self._stream = stream
        self.interval = interval

    def begin(self, text: str) -> None:
        write_line(self._stream, text)

    def show(self, text: str, status: Status) -> None:
        if math.isfinite(status.eta_s):
            write_line(self._stream, f"{status.fraction * 100:4.0f} %  {status.text()}".rstrip())

    def end(self) -> None:
        pass

    def say(self, text: str) -> None:
        write_line(self._stream, text)

    def close(self) -> None:
        pass


class _Bar:
    """A live bar of rich; drawn by the calls only, without a thread that could fail on its own."""

    interval = _REFRESH_S

    def __init__(self, stream: TextIO) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TextColumn
        from rich.progress import Progress as RichProgress

        self._console = Console(file=stream, highlight=False, markup=False)
        self._drawn = BarColumn(bar_width=LONGEST)
        columns = (
            TextColumn("{task.description}", markup=False),
            self._drawn,
            TextColumn("{task.fields[share]}", markup=False),
            TextColumn("{task.fields[status]}", markup=False),
        )
        self._bar = RichProgress(*columns, console=self._console, auto_refresh=False, transient=True)
        self._task = self._bar.add_task("", total=None, share="", status="", visible=False)

    def begin(self, text: str) -> None:
        self._bar.start()
        self._drawn.bar_width = max(SHORTEST, min(LONGEST, self._console.width - len(text) - 4))
        self._bar.reset(self._task, description=text, total=None, visible=True, start=True, share="", status="")
        self._bar.refresh()

    def show(self, text: str, status: Status) -> None:
        self._bar.start()
        share = f"{status.fraction * 100:3.0f} %"
        named, self._drawn.bar_width, told = fitted(text, status, self._console.width)
        self._bar.update(
            self._task,
            description=named,
            total=1.0,
            completed=status.fraction,
            share=share,
            status=told,
            visible=True,
        )
        self._bar.refresh()

    def end(self) -> None:
        self._bar.update(self._task, visible=False)

    def say(self, text: str) -> None:
        self._console.print(text)

    def close(self) -> None:
        self._bar.stop()


def fitted(text: str, status: Status, width: int) -> tuple[str, int, str]:
    """Name of a phase, columns of its bar and what is said behind its percents, in a line of ``width`` columns.

    The bar gets shorter first, then what is said, then the name.
    """
    room = width - SHARE - len(text)
    told = status.fitting(room - SHORTEST)
    bar = max(SHORTEST, min(LONGEST, room - len(told)))
    most = width - SHARE - bar - len(told)
    named = text if len(text) <= most else f"{text[: max(most - 1, 0)]}…"
    return named, bar, told


def duration(seconds: float) -> str:
    """``0:07``, ``12:30`` or ``2:03:00``; ``-:--`` while unknown."""
    if not math.isfinite(seconds):
        return "-:--"
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def write_line(stream: TextIO, text: str) -> None:
    """Write ``text`` as a line of its own, at once."""
    stream.write(text + "\n")
    stream.flush()
