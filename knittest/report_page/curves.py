"""Draws the curves of runs with their references, as vector pictures that are readable on a phone."""

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, ORANGE, PINK, RED, SKY, new_figure, style_axes
from knittest.base.history import Array
from knittest.base.result_rows import SIZED, to_nominal_size, unfold_results
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import FORCE, ReferenceCurve
from knittest.export.line_picture import EndPoint, Level, Reference, draw_end_point, draw_reference
from knittest.laboratory.report_base import CurveAxes
from knittest.report_page.blocks import Block, Picture, Section, Text, legend_label
from knittest.report_page.files import Columns
from knittest.report_page.loaded_run import LoadedRun
from knittest.report_page.pictures import data_uri

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_COLOURS = (BLUE, GREEN, PINK, SKY, ORANGE, BLACK)
_DASHES = ("-", "--", "-.", ":")
#: largest number that axes can show; an unstable run has larger ones
_LARGEST = 1e30
#: entries of a legend that fit the figure, and the height of each further one [inch]
_FITTING, _LINE = 6, 0.2
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "path",  # the same look without the font
    "svg.hashsalt": "knittest",  # the same bytes each time
    "font.size": 10.0,
}


@dataclass(frozen=True)
class Series:
    """A curve (n,), with standard deviation and ``peaks`` (k, 2) of the specimens where it is their mean."""

    label: str
    x: Array
    y: Array
    sd: Array | None = None
    peaks: Array | None = None


@dataclass(frozen=True)
class CurveReferences:
    """References that are drawn with a curve."""

    reference: ReferenceCurve | None = None
    source: str = ""  # of the reference and the end point
    end_point: EndPoint | None = None
    levels: Sequence[Level] = ()


def curve_figure(series: Sequence[Series], axes: CurveAxes, beside: Sequence[CurveReferences] = ()) -> "Figure | None":
    """Figure of the curves; ``None`` when no curve has two points that can be drawn."""
    from matplotlib import rc_context

    drawable = []
    for one in series:
        columns = [one.x, one.y, *([] if one.sd is None else [one.sd])]
        keep = np.all([np.abs(c) < _LARGEST for c in columns], axis=0)  # False for NaN
        if keep.sum() > 1:
            sd = None if one.sd is None else one.sd[keep]
            drawable.append(replace(one, x=one.x[keep], y=one.y[keep], sd=sd))
    if not drawable:
        return None
    with rc_context(_STYLE):
        figure = new_figure(4.7, 4.3)
        figure.set_layout_engine("constrained")
        plot = figure.add_subplot()
        style_axes(plot)
        for number, one in enumerate(drawable):
            _draw_series(plot, one, number)
        for around in beside:
            _draw_references(plot, around)
        plot.set(xlabel=axes.xlabel, ylabel=axes.ylabel)
        if axes.logarithmic:
            plot.set_yscale("log")
        handles, labels = plot.get_legend_handles_labels()
        once = dict(zip(map(legend_label, labels), handles, strict=True))  # runs of one fabric share their reference
        height = figure.get_figheight() + _LINE * max(len(once) - _FITTING, 0)
        figure.set_figheight(height)  # the curves keep their size
        figure.legend(once.values(), once.keys(), loc="outside lower left", frameon=False, fontsize=9)
    return figure


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


def _draw_references(plot: "Axes", beside: CurveReferences) -> None:
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


def curve_section(run: LoadedRun) -> tuple[Section, bool]:
    """Section with the curve of one run, and whether the curve shows all that curve.png does."""
    blocks = _curve_blocks([run], [f"simulated{_state(run)}"])
    drawn = any(isinstance(block, Picture) for block in blocks)
    ensemble = run.report is not None and run.report.axes.mean in run.curve
    others = len(run.comparison.curves) - (run.reference[0] is not None)  # curves of the user
    return Section(f"run-{run.number}-curve", "Curve", blocks), drawn and not ensemble and others <= 0


def overlay_blocks(runs: Sequence[LoadedRun]) -> list[Block]:
    """Picture of the curves of runs of one test."""
    return _curve_blocks(runs, [_run_label(run) for run in runs])


def _run_label(run: LoadedRun) -> str:
    """Number of a run, with its direction and scale where they are known."""
    direction = run.summary.direction or run.setting("rig", "direction")
    scale = run.summary.scale or run.setting("model", "scale")
    known = " ".join(str(part) for part in (direction, scale) if part in ("warp", "weft", "macro", "meso"))
    return f"run {run.number}{f', {known}' if known else ''}{_state(run)}"


def _curve_blocks(runs: Sequence[LoadedRun], labels: Sequence[str]) -> list[Block]:
    from matplotlib import rc_context

    report, differ = runs[0].report, sizes_differ(runs)
    if report is None:
        return [Text(f"No curve is known for the test {runs[0].rig or '(not stated)'}.", "warn")]
    if differ is None:
        return [Text("The curves are not shown together: the size of a specimen is unknown.", "warn")]
    series, axes, beside, problems = _collect_curves(runs, labels, differ)
    blocks: list[Block] = [Text(f"The curve of the experiment is not shown: {problem}", "warn") for problem in problems]
    figure = curve_figure(series, axes, beside)
    if figure is None:
        return [Text("There is no curve to draw.", "warn"), *blocks]
    buffer = io.BytesIO()
    with rc_context(_STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": "knittest"})
    caption = f"{axes.ylabel} over {axes.xlabel}{'; the specimens differ in size' if differ else ''}"
    if any(run.run is not None and report.factors(run.run) for run in runs):
        caption += "; forces are scaled from whole yarns to the nominal size"
    if any(one.sd is not None for one in series):
        caption += "; a mean ends at the earliest peak of its specimens"
    references = [around.reference for around in beside if around.reference is not None]
    origins = {f"{r.source}: {r.kind}{'; ' + r.note if r.note else ''}" for r in references}
    caption += f". Reference: {'. '.join(sorted(origins))}" if origins else ""
    uri = data_uri(buffer.getvalue(), "image/svg+xml")
    return [Picture(uri, f"{caption}; {', '.join(labels)}", caption), *blocks]


def overlay_figure(runs: Sequence[LoadedRun]) -> "Figure | None":
    """Figure of :func:`overlay_blocks`; ``None`` where it has none."""
    differ = sizes_differ(runs)
    if runs[0].report is None or differ is None:
        return None
    series, axes, beside, _ = _collect_curves(runs, [_run_label(run) for run in runs], differ)
    return curve_figure(series, axes, beside)


def _collect_curves(
    runs: Sequence[LoadedRun], labels: Sequence[str], differ: bool
) -> tuple[list[Series], CurveAxes, list[CurveReferences], list[str]]:
    """Curves of ``runs``, axes, references and their problems; forces without size where sizes ``differ``."""
    report = runs[0].report
    assert report is not None
    references = [run.reference[0] for run in runs]
    free = differ or any(one is not None and one.y_name in report.axes.others for one in references)
    axes, series = report.axes, []
    for run, name in zip(runs, labels, strict=True):
        columns, own = run.curve, report.axes
        if run.run is not None and free:
            own, columns = report.size_free_curve(run.run, columns)
        elif run.run is not None:
            columns = report.scale_to_nominal_size(run.run, columns)
        axes = own if run is runs[0] else axes
        series.append(_series(run, own, columns, name, free=free))
    beside = [_curve_references(run, len(runs) > 1, free) for run in runs]
    problems = [run.reference[1] for run in runs if run.reference[1]]
    return [s for s in series if s is not None], axes, beside, problems


def sizes_differ(runs: Sequence[LoadedRun]) -> bool | None:
    """Tell whether the specimens of ``runs`` of one test differ in size; ``None`` if a size is unknown."""
    if len(runs) < 2:
        return False
    sizes = []
    for run in runs:
        if run.run is None or run.report is None:
            return None
        sizes.append(run.report.size(run.run)[0])
    return max(sizes) > min(sizes) * (1.0 + EXACT)


def _peaks(run: LoadedRun, axes: CurveAxes, *, free: bool) -> Array | None:
    """Place and size of the largest force of each specimen, (n, 2), ``free`` of the specimen's size or not."""
    results = unfold_results(run.summary.plain()["results"])
    force = SIZED.get(PEAK, "") if free else PEAK
    if not free and run.run is not None and run.report is not None and PEAK in results:
        results[PEAK] = to_nominal_size(results[PEAK], run.report.factors(run.run))
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


def _curve_references(run: LoadedRun, several: bool, free: bool = False) -> CurveReferences:
    """References of a run, with forces ``free`` of the size or not; ``several`` runs name their direction."""
    if run.run is None or run.report is None:
        return CurveReferences()
    which = f", {run.run.direction}" if several and run.run.direction else ""
    size = run.report.size(run.run)[0] if free else 1.0
    compared = {row.quantity: row for row in run.summary.comparison}
    force, strain = compared.get(PEAK), compared.get("fracture_strain_pct")
    end_point = None
    if force and strain:
        numbers = (strain.experiment_mean, strain.experiment_sd, force.experiment_mean, force.experiment_sd)
        x, x_sd, y, y_sd = (math.nan if n is None else n for n in numbers)
        end_point = EndPoint(x, x_sd, y / size, y_sd / size, force.source + which) if math.isfinite(x + y) else None
    reference, source = run.reference[0], ""
    if reference is not None:
        source = reference.source + (which if which not in reference.source else "")
        if reference.y_name == FORCE:
            sd = None if reference.sd is None else reference.sd / size
            reference = replace(reference, mean=reference.mean / size, sd=sd)
    return CurveReferences(reference, source, end_point, run.report.levels(run.run))


def _state(run: LoadedRun) -> str:
    return "" if run.whole else ", incomplete"
