"""The curves of runs beside what each is compared with, as vector pictures of a size that a phone shows readably."""

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, ORANGE, PINK, RED, SKY, dress, new_figure
from knittest.base.history import Array
from knittest.base.result_rows import SIZED, of_nominal_size, unfolded
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import FORCE, ReferenceCurve
from knittest.export.line_picture import EndPoint, Level, Reference, draw_end_point, draw_reference
from knittest.laboratory.report_base import CurveAxes
from knittest.report_page.blocks import Block, Picture, Section, Text, label
from knittest.report_page.files import Columns
from knittest.report_page.loading import LoadedRun
from knittest.report_page.pictures import data_uri

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


#: result that is the largest force of a strip
PEAK = "peak_force_n"


def curve(run: LoadedRun) -> tuple[Section, bool]:
    """The curve of one run with corridor and reference, and whether it shows all that curve.png does."""
    blocks = _chart([run], [f"simulated{_state(run)}"])
    drawn = any(isinstance(block, Picture) for block in blocks)
    ensemble = run.report is not None and run.report.axes.mean in run.curve
    others = len(run.comparison.curves) - (run.reference[0] is not None)  # a user's own, not kept
    return Section(f"run-{run.number}-curve", "Curve", blocks), drawn and not ensemble and others <= 0


def overlay(runs: Sequence[LoadedRun]) -> list[Block]:
    """The curves of runs of one test in one picture."""
    return _chart(runs, [_name(run) for run in runs])


def _name(run: LoadedRun) -> str:
    return f"run {run.number}{_what(run)}{_state(run)}"


def _chart(runs: Sequence[LoadedRun], labels: Sequence[str]) -> list[Block]:
    report = runs[0].report
    if report is None:
        return [Text(f"No curve is known for the test {runs[0].rig or '(not stated)'}.", "warn")]
    differ = sizes_differ(runs)
    if differ is None:
        return [Text("The curves are not shown together: the size of a specimen is not known.", "warn")]
    free = differ or any(_is_free(run, report.axes) for run in runs)
    series, axes, beside, problems = _drawn(runs, labels, free)
    blocks: list[Block] = [Text(f"The curve of the experiment is not shown: {problem}", "warn") for problem in problems]
    uri = curve_chart(series, axes, beside)
    if uri is None:
        return [Text("There is no curve to draw.", "warn"), *blocks]
    sizes = "; the specimens differ in size" if differ else ""
    if any(run.run is not None and report.factors(run.run) for run in runs):
        sizes += "; forces of whole yarns are for the nominal size"
    means = "; a mean ends at the earliest peak of its specimens" if any(s.sd is not None for s in series) else ""
    caption = f"{axes.ylabel} over {axes.xlabel}{sizes}{means}{_origin([b.reference for b in beside])}"
    return [Picture(uri, f"{caption}; {', '.join(labels)}", caption), *blocks]


def overlay_figure(runs: Sequence[LoadedRun]) -> "Figure | None":
    """The picture of :func:`overlay`, ``None`` where it has none."""
    report, differ = runs[0].report, sizes_differ(runs)
    if report is None or differ is None:
        return None
    free = differ or any(_is_free(run, report.axes) for run in runs)
    series, axes, beside, _ = _drawn(runs, [_name(run) for run in runs], free)
    return curve_figure(series, axes, beside)


def _drawn(
    runs: Sequence[LoadedRun], labels: Sequence[str], free: bool
) -> tuple[list[Series], CurveAxes, list[Beside], list[str]]:
    """Curves of ``runs`` of a known test, their axes, what is beside them, and what of that cannot be read."""
    report = runs[0].report
    assert report is not None
    drawn = [_columns(run, report.axes, free) for run in runs]
    axes = drawn[0][0]
    series = [_series(run, *one, label, free=free) for run, one, label in zip(runs, drawn, labels, strict=True)]
    found = [_beside(run, len(runs) > 1, free) for run in runs]
    beside, problems = [around for around, _ in found], [problem for _, problem in found if problem]
    return [s for s in series if s is not None], axes, beside, problems


def sizes_differ(runs: Sequence[LoadedRun]) -> bool | None:
    """Tell whether forces of ``runs`` of one test are of specimens of several sizes; ``None`` if one is not known."""
    if len(runs) < 2:
        return False
    sizes = []
    for run in runs:
        if run.run is None or run.report is None:
            return None
        sizes.append(run.report.size(run.run)[0])
    return max(sizes) > min(sizes) * (1.0 + EXACT)


def _is_free(run: LoadedRun, axes: CurveAxes) -> bool:
    """Tell whether what a run is beside is a force of no size, such as a normalised one."""
    reference, _ = run.reference
    return reference is not None and reference.y_name in axes.others


def _columns(run: LoadedRun, axes: CurveAxes, free: bool) -> tuple[CurveAxes, Columns]:
    """Axes and columns of the curve, ``free`` of the specimen's size or for its nominal one."""
    if run.run is None or run.report is None:
        return axes, run.curve
    if free:
        return run.report.size_free(run.run, run.curve)
    return axes, run.report.for_nominal_size(run.run, run.curve)


def _peaks(run: LoadedRun, axes: CurveAxes, *, free: bool) -> Array | None:
    """Largest force, ``free`` of the specimen's size or not, over its place of each specimen, (n, 2); None without."""
    results = unfolded(run.summary.plain()["results"])
    force = SIZED.get(PEAK, "") if free else PEAK
    if not free and run.run is not None and run.report is not None and PEAK in results:
        results[PEAK] = of_nominal_size(results[PEAK], run.report.factors(run.run))
    found = [value["values"] for name in (axes.peak, force) if isinstance(value := results.get(name), Mapping)]
    if len(found) < 2 or any(number is None for values in found for number in values):
        return None
    return np.column_stack(found)


def _series(run: LoadedRun, axes: CurveAxes, columns: Columns, label: str, *, free: bool) -> Series | None:
    if {axes.x, axes.mean, axes.sd} <= set(columns):
        return Series(label, columns[axes.x], columns[axes.mean], columns[axes.sd], _peaks(run, axes, free=free))
    if {axes.x, axes.y} <= set(columns):
        many = run.setting("variability", "specimens")
        first = ", first specimen" if isinstance(many, int) and many > 1 else ""
        return Series(label + first, columns[axes.x], columns[axes.y])
    return None


def _beside(run: LoadedRun, several: bool, free: bool = False) -> tuple[Beside, str]:
    """Reference, end point and levels of a run, and why the reference is missing if it cannot be read.

    Where the picture shows ``several`` runs, the direction goes with the source; where it is ``free`` of their sizes,
    forces of the experiment are as well.
    """
    if run.run is None or run.report is None:
        return Beside(), ""
    which = f", {run.run.direction}" if several and run.run.direction else ""
    compared = {row.quantity: row for row in run.summary.comparison}
    force, strain = compared.get(PEAK), compared.get("fracture_strain_pct")
    end_point = None
    if force and strain:
        numbers = (strain.experiment_mean, strain.experiment_sd, force.experiment_mean, force.experiment_sd)
        x, x_sd, y, y_sd = (math.nan if n is None else n for n in numbers)
        end_point = EndPoint(x, x_sd, y, y_sd, force.source + which) if math.isfinite(x + y) else None
    levels = run.report.levels(run.run)
    reference, problem = run.reference
    if problem:
        return Beside(None, "", end_point, levels), problem
    source = reference.source if reference else ""
    size, _ = run.report.size(run.run)
    return _sized(
        Beside(reference, source + (which if which not in source else ""), end_point, levels), size if free else 1.0
    ), ""


def _sized(beside: Beside, size: float) -> Beside:
    """Forces [N] of the experiment over the ``size`` [mm] of the specimen that they were scaled to."""
    curve, end = beside.reference, beside.end_point
    if curve is not None and curve.y_name == FORCE:
        curve = replace(curve, mean=curve.mean / size, sd=None if curve.sd is None else curve.sd / size)
    if end is not None:
        end = replace(end, force_mean=end.force_mean / size, force_sd=end.force_sd / size)
    return replace(beside, reference=curve, end_point=end)


def _origin(references: Sequence[ReferenceCurve | None]) -> str:
    """Sentence on the origin of the curves of the experiment."""
    told = {f"{r.source}: {r.kind}{'; ' + r.note if r.note else ''}" for r in references if r is not None}
    return f". Beside it: {'. '.join(sorted(told))}" if told else ""


def _what(run: LoadedRun) -> str:
    """Direction and scale, where they are what they should be."""
    direction = run.summary.direction or run.setting("rig", "direction")
    scale = run.summary.scale or run.setting("model", "scale")
    known = [str(part) for part in (direction, scale) if part in ("warp", "weft", "macro", "meso")]
    return f", {' '.join(known)}" if known else ""


def _state(run: LoadedRun) -> str:
    return "" if run.whole else ", not complete"
