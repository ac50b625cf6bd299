"""Progress of a study on standard error: a live overview on a terminal, a line a run in a pipe, nothing when quiet."""

import sys
import threading
import time
from collections import Counter
from typing import Self, TextIO

from knittest.base.progress import CellText, OnDisplay, duration, is_in_notebook, write_line
from knittest.base.result_rows import LABELS
from knittest.studies.trials.trial import Record, Trial

REFRESH_S, SHOWN = 0.2, 12
#: characters of the line of a run without a result, without its number, and of the reason in it
LONGEST_LINE, LONGEST_REASON = 145, 90
STYLES = {"completed": "green", "refused": "yellow"}


class _LineDisplay:
    """A line a run, for a pipe, a log or CI."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def ended(self, text: str, record: Record) -> None:
        write_line(self._stream, text)

    def draw(self, head: str, running: list[str], share: float) -> None:
        pass

    def close(self) -> None:
        pass


class _NotebookDisplay(_LineDisplay):
    """Text in the cell of a notebook: the last runs that failed, the number of runs, and the running ones."""

    def __init__(self) -> None:
        self._text = CellText()
        self._wrong: list[str] = []

    def ended(self, text: str, record: Record) -> None:
        if record.status != "completed":
            self._wrong.append(text)

    def draw(self, head: str, running: list[str], share: float) -> None:
        self._text.show("\n".join([*self._wrong[-SHOWN:], head, *running[:SHOWN]]))


class _TerminalDisplay(_LineDisplay):
    """Failed runs, a bar and the running ones on a terminal; drawn by the calls only."""

    def __init__(self, stream: TextIO) -> None:
        from rich.console import Console
        from rich.live import Live

        self._console = Console(file=stream, highlight=False, markup=False)
        self._live = Live(console=self._console, auto_refresh=False, transient=True)
        self._live.start()

    def ended(self, text: str, record: Record) -> None:
        if record.status != "completed":
            self._console.print(text, style=STYLES.get(record.status, "red"), soft_wrap=True)

    def draw(self, head: str, running: list[str], share: float) -> None:
        from rich.console import Group
        from rich.padding import Padding
        from rich.progress_bar import ProgressBar
        from rich.text import Text

        shown = running[:SHOWN] + ([f"... and {len(running) - SHOWN} more"] if len(running) > SHOWN else [])
        lines = [Text(f"  {line}", overflow="ellipsis", no_wrap=True) for line in shown]
        bar = Padding(ProgressBar(1.0, share, width=60), 0)  # on a line of its own
        self._live.update(Group(Text(head), bar, *lines), refresh=True)

    def close(self) -> None:
        self._live.stop()


class Overview(OnDisplay[_LineDisplay]):
    """Overview of ``total`` runs; a context manager, for any thread."""

    def __init__(self, total: int, *, at_most: bool = False, quiet: bool = False, stream: TextIO | None = None) -> None:
        """Show the runs on ``stream`` (standard error); with ``at_most`` their number is only known to be less."""
        self._total, self._known, self._done = total, 0, 0
        self._at_most = at_most
        self._counts: Counter[str] = Counter()
        self._running: dict[str, tuple[str, float | None, float]] = {}  # label, share, start time
        self._began, self._drawn = time.monotonic(), 0.0
        self._lock = threading.RLock()
        if quiet:
            return
        if stream is None and is_in_notebook():
            self._display = _NotebookDisplay()
        else:
            stream = stream or sys.stderr
            self._display = _TerminalDisplay(stream) if stream.isatty() else _LineDisplay(stream)

    def begin(self, known: int) -> None:
        """Start the clock; ``known`` runs are finished already."""
        with self._lock:
            self._known, self._began = known, time.monotonic()
            self._draw()

    def watch(self, trial: Trial, share: float | None) -> None:
        """Show the ``share`` of ``trial`` that is done; None while its kernels are compiled."""
        with self._lock:
            _, _, began = self._running.get(trial.key, ("", None, time.monotonic()))
            self._running[trial.key] = (trial.label, share, began)
            if time.monotonic() - self._drawn >= REFRESH_S:
                self._draw()

    def ended(self, trial: Trial, record: Record) -> None:
        """Show the outcome of ``trial``."""
        with self._lock:
            self._running.pop(record.key, None)
            self._done += 1
            self._counts[record.status] += 1
            number = f"[{self._known + self._done}/{self._total}]"
            line = f"{number} {outcome_line(trial.label, record)}"
            self._try_on_display(lambda display: display.ended(line, record))
            self._draw()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._try_on_display(lambda display: display.close())
            self._display = None

    def _draw(self) -> None:
        now = self._drawn = time.monotonic()
        ended = self._known + self._done
        left, spent = self._total - ended, now - self._began
        eta = f", ETA {duration(spent * left / self._done)}" if self._done and left and not self._at_most else ""
        counts = ", ".join(f"{count} {status}" for status, count in self._counts.items()) or "none yet"
        known = f", {self._known} finished before" if self._known else ""
        of = " of at most " if self._at_most else "/"
        head = f"{ended}{of}{self._total} runs ({counts}{known}), {duration(spent)}{eta}"
        running = []
        for label, share, start in self._running.values():
            state = "compiling kernels, once for this kind of test" if share is None else f"{100.0 * share:3.0f} %"
            running.append(f"{state}  {duration(now - start)}  {label}")
        self._try_on_display(lambda display: display.draw(head, running, ended / max(self._total, 1)))


def outcome_line(label: str, record: Record) -> str:
    """Outcome of the run ``label`` in a line: first results of a completed run; else the reason, cut, and the label.

    The table and the page of the study have the whole reason.
    """
    again = f" (attempt {1 + len(record.earlier)})" if record.earlier else ""
    seconds = f"({record.seconds:.1f} s)"
    if record.status == "completed":
        numbers = [f"{LABELS.get(k, (k, '{:.4g}'))[0]} {v:.4g}" for k, v in list(record.results.items())[:2]]
        return f"{label}: completed{again}{': ' if numbers else ''}{', '.join(numbers)} {seconds}"
    reason = shorten_text(record.reason, LONGEST_REASON) or "no reason is recorded"
    line = f"{record.status}{again}: {reason} {seconds}"
    return f"{line}: {shorten_text(label, LONGEST_LINE - len(line))}"


def shorten_text(text: str, length: int) -> str:
    """``text`` in one line, cut to ``length`` characters."""
    plain = " ".join(text.split())
    return plain if len(plain) <= length else f"{plain[: length - 4]} ..."
