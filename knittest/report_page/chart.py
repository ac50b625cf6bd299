"""Curves as a vector picture of a size that a phone shows readably."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, ORANGE, PINK, RED, SKY, dress, new_figure
from knittest.base.history import Array
from knittest.experiment.curves import ReferenceCurve
from knittest.export.curve_picture import EndPoint, Reference, draw_end_point, draw_reference
from knittest.export.line_picture import Level
from knittest.laboratory.report_base import CurveAxes
from knittest.report_page.pictures import data_uri
from knittest.report_page.wording import label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = (BLUE, GREEN, PINK, SKY, ORANGE, BLACK)
_DASHES = ("-", "--", "-.", ":")
#: what axes can be scaled to; larger numbers are those of a run that blew up
_LARGEST = 1e30
#: entries of a legend that the figure has room for, and the height of a further one [inch]
_FITTING, _LINE = 6, 0.2
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "path",  # the same look without the font
    "svg.hashsalt": "knittest",  # the same bytes each time
    "font.size": 10.0,
}


@dataclass(frozen=True)
class Series:
    """A curve, (n,) each, with its standard deviation if it is the mean of several, and their ``peaks`` (k, 2)."""

    label: str
    x: Array
    y: Array
    sd: Array | None = None
    peaks: Array | None = None


@dataclass(frozen=True)
class Beside:
    """References that curves are shown beside."""

    reference: ReferenceCurve | None = None
    source: str = ""  # of the reference and the end point
    end_point: EndPoint | None = None
    levels: Sequence[Level] = ()


def curve_chart(series: Sequence[Series], axes: CurveAxes, beside: Sequence[Beside] = ()) -> str | None:
    """SVG of the curves as a data URI, ``None`` when none of them has two points that can be drawn."""
    from matplotlib import rc_context

    figure = curve_figure(series, axes, beside)
    if figure is None:
        return None
    buffer = io.BytesIO()
    with rc_context(_STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": "knittest"})
    return data_uri(buffer.getvalue(), "image/svg+xml")


def curve_figure(series: Sequence[Series], axes: CurveAxes, beside: Sequence[Beside] = ()) -> "Figure | None":
    """The curves, ``None`` when none of them has two points that can be drawn."""
    from matplotlib import rc_context

    drawable = [s for s in map(_drawable, series) if len(s.x) > 1]
    if not drawable:
        return None
    with rc_context(_STYLE):
        figure = new_figure(4.7, 4.3)
        figure.set_layout_engine("constrained")
        plot = figure.add_subplot()
        dress(plot)
        for number, one in enumerate(drawable):
            _draw_series(plot, one, number)
        for around in beside:
            _draw_beside(plot, around)
        plot.set(xlabel=axes.xlabel, ylabel=axes.ylabel)
        if axes.logarithmic:
            plot.set_yscale("log")
        handles, labels = plot.get_legend_handles_labels()
        once = dict(zip(map(label, labels), handles, strict=True))  # runs of one fabric share their reference
        height = figure.get_figheight() + _LINE * max(len(once) - _FITTING, 0)
        figure.set_figheight(height)  # a long legend takes no room from the curves
        figure.legend(once.values(), once.keys(), loc="outside lower left", frameon=False, fontsize=9)
    return figure


def _drawable(series: Series) -> Series:
    columns = [series.x, series.y, *([] if series.sd is None else [series.sd])]
    keep = np.all([np.abs(c) < _LARGEST for c in columns], axis=0)  # False for NaN
    sd = None if series.sd is None else series.sd[keep]
    return Series(series.label, series.x[keep], series.y[keep], sd, series.peaks)


def _draw_series(plot: "Axes", series: Series, number: int) -> None:
    colour = _COLOURS[number % len(_COLOURS)]
    dashes = _DASHES[number // len(_COLOURS) % len(_DASHES)]
    name = series.label if series.sd is None else f"{series.label}, mean"
    plot.plot(series.x, series.y, color=colour, linestyle=dashes, linewidth=1.8, label=name, zorder=4)
    if series.sd is not None:
        low, high = series.y - series.sd, series.y + series.sd
        plot.fill_between(series.x, low, high, color=colour, alpha=0.18, linewidth=0, label=f"{name}, ± sd")
    if series.peaks is not None:
        plot.plot(
            *series.peaks.T, "o", color=colour, markersize=4.5, markerfacecolor="white", zorder=5,
            label=f"{series.label}, peaks of the specimens",
        )  # fmt: skip


def _draw_beside(plot: "Axes", beside: Beside) -> None:
    curve = beside.reference
    if curve is not None:
        if curve.sd is not None:
            low, high = curve.mean - curve.sd, curve.mean + curve.sd
            plot.fill_between(curve.x, low, high, color=RED, alpha=0.12, linewidth=0, label=f"{curve.kind}, ± sd")
        draw_reference(plot, Reference(curve.x, curve.mean, curve.kind, beside.source))
    if beside.end_point is not None:
        draw_end_point(plot, beside.end_point)
    for number, level in enumerate(beside.levels):
        plot.axhline(level.value, color=RED, linestyle=("--", ":")[number % 2], linewidth=1.3, label=level.label)
