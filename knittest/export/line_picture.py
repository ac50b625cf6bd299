"""Curves of one quantity over another, with levels and notes."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

from knittest.base.figure import BLUE, GREEN, GREY, ORANGE, RED, SKY, dress, new_figure, save
from knittest.base.history import Array

_COLOURS = (BLUE, ORANGE, GREEN, RED, SKY)
#: characters of a label that half the width of a picture holds
HALF = 45
#: height of a row of the legend, as a share of the picture's
ROW = 0.037
#: height of the scale and its name below the curves, and of a further line of the title, likewise
UNDER, TITLE = 0.135, 0.045


@dataclass(frozen=True)
class Line:
    """A curve, (n,) each, and what the legend says of it; ``style`` as matplotlib's."""

    x: Array
    y: Array
    label: str
    style: str = "-"


@dataclass(frozen=True)
class Band:
    """The area between two curves over x, (n,) each."""

    x: Array
    low: Array
    high: Array
    label: str


@dataclass(frozen=True)
class Span:
    """A stretch of x that is marked, and why."""

    low: float
    high: float
    label: str


@dataclass(frozen=True)
class Level:
    """A horizontal line."""

    value: float
    label: str


def line_picture(
    path: Path,
    lines: Sequence[Line],
    *,
    title: str,
    xlabel: str,
    ylabel: str,
    levels: Sequence[Level] = (),
    bands: Sequence[Band] = (),
    spans: Sequence[Span] = (),
    logarithmic: bool = False,
) -> None:
    """Draw ``lines``, ``levels``, ``bands`` and ``spans`` to ``path`` (PNG); their labels close below, in two columns
    where these are wide enough. Raises :class:`ResourceError`.
    """
    entries: list[Line | Level | Band | Span] = [*lines, *levels, *bands, *spans]
    labels = [entry.label for entry in entries]
    columns = 2 if max(map(len, labels), default=0) <= HALF else 1
    below = UNDER + ROW * ceil(sum(1 + label.count("\n") for label in labels) / columns)
    top = 0.93 - TITLE * title.count("\n")
    figure = new_figure(8.0, 5.4)
    axes = figure.add_axes((0.1, below, 0.86, top - below))
    dress(axes)
    for span in spans:
        axes.axvspan(span.low, span.high, color=GREY, alpha=0.18, linewidth=0, label=span.label)
    for band in bands:
        axes.fill_between(band.x, band.low, band.high, color=GREY, alpha=0.15, linewidth=0, label=band.label)
    for number, line in enumerate(lines):
        axes.plot(line.x, line.y, line.style, color=_COLOURS[number % len(_COLOURS)], label=line.label, linewidth=1.6)
    for number, level in enumerate(levels):
        axes.axhline(level.value, color=RED, linestyle=("--", ":")[number % 2], linewidth=1.3, label=level.label)
    if logarithmic:
        axes.set_yscale("log")
    else:
        axes.set_ylim(bottom=min(0.0, *(float(line.y.min()) for line in lines)))
    axes.set(xlabel=xlabel, ylabel=ylabel)
    axes.set_title(title, loc="left", fontsize=12)
    figure.legend(loc="lower left", bbox_to_anchor=(0.09, 0.0), ncols=columns, frameon=False, fontsize=9)
    save(figure, path)
