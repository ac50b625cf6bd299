"""Stamp below every picture: which run it is of, by which version, when, and whether it may be compared."""

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np

from knittest import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

#: size of the letters [points], mean width of one over it, height of a line over it, margins at the sides, above and
#: below [inch]
LETTER, WIDE, LINE, MARGIN, ABOVE, BELOW = 7.5, 0.58, 1.45, 0.12, 0.09, 0.06
BETWEEN = " · "
FACTS, BAD = "#4a4f55", "#b3261e"


@dataclass(frozen=True)
class Stamp:
    """``facts`` of the run in one line and its ``verdict`` in another, ``bad`` where it may not be compared."""

    facts: Sequence[str] = ()
    verdict: str = ""
    bad: bool = False


_PRESENT: ContextVar[Stamp] = ContextVar("stamp", default=Stamp())  # noqa: B039 - a stamp does not change


@contextmanager
def stamped(stamp: Stamp) -> Iterator[None]:
    """All pictures that are written inside carry ``stamp``, so that none can be left out."""
    token = _PRESENT.set(stamp)
    try:
        yield
    finally:
        _PRESENT.reset(token)


def lines_of(stamp: Stamp, width: float) -> list[tuple[str, str]]:
    """Lines of text and their colours for a picture ``width`` [inch] wide; version and date stand on every picture."""
    letters = int((width - 2.0 * MARGIN) * 72.0 / (WIDE * LETTER))
    today = datetime.now(UTC).date().isoformat()
    told = [_plain(fact) for fact in [*filter(None, stamp.facts), f"knittest {__version__}", today]]
    least = len(_filled(told, letters))
    even = next(n for n in range(1, letters + 1) if len(_filled(told, n)) <= least)  # no line with the date alone
    facts = [(line, FACTS) for line in _filled(told, even)]
    return facts + [(line, BAD if stamp.bad else FACTS) for line in textwrap.wrap(_plain(stamp.verdict), letters)]


def _filled(facts: Sequence[str], letters: int) -> list[str]:
    """``facts`` in lines of ``letters`` at most, each whole in one unless it is longer."""
    found = [""]
    for fact in facts:
        joined = BETWEEN.join(filter(None, (found[-1], fact)))
        found[-1:] = [joined] if len(joined) <= letters or not found[-1] else [found[-1], fact]
    return [part for line in found for part in textwrap.wrap(line, letters)]


def with_stamp(figure: "Figure", dpi: int) -> np.ndarray:
    """Pixels of ``figure``, (height, width, 4), with the present stamp in a strip of its own below."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    above = _pixels(figure, dpi)
    width = above.shape[1] / dpi
    lines = lines_of(_PRESENT.get(), width)
    step = LETTER * LINE / 72.0
    strip = Figure(figsize=(width, ABOVE + step * len(lines) + BELOW), dpi=dpi, facecolor="white")
    FigureCanvasAgg(strip)
    high = strip.get_size_inches()[1]
    for number, (line, colour) in enumerate(lines):
        top = 1.0 - (ABOVE + number * step) / high
        strip.text(MARGIN / width, top, line, fontsize=LETTER, color=colour, va="top")
    below = _pixels(strip, dpi)
    return np.concatenate([above, below[:, : above.shape[1]]])


@contextmanager
def below(figure: "Figure") -> Iterator["Bbox"]:
    """The present stamp as texts below ``figure`` while it is written, and the page [inch] that holds both."""
    from matplotlib.transforms import Bbox

    width, high = figure.get_size_inches()
    lines = lines_of(_PRESENT.get(), width)
    step = LETTER * LINE / 72.0
    texts = [
        figure.text(MARGIN / width, -(ABOVE + k * step) / high, line, fontsize=LETTER, color=colour, va="top")
        for k, (line, colour) in enumerate(lines)
    ]
    yield Bbox.from_extents(0.0, -(ABOVE + step * len(lines) + BELOW), width, high)
    for text in texts:
        text.remove()


def _pixels(figure: "Figure", dpi: int) -> np.ndarray:
    figure.set_dpi(dpi)
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())  # type: ignore[attr-defined]


def _plain(text: str) -> str:
    """One line in which a dollar sign is one and begins no formula."""
    return " ".join(text.split()).replace("$", r"\$")
