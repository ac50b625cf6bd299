"""Overview picture of a sweep: every result over every swept field, with the runs that have no result."""

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import GREY, RED, new_figure, save
from knittest.base.history import Array
from knittest.base.result_rows import LABELS, SIZED
from knittest.config.fields import field_at
from knittest.studies.batch.plan import SweptField
from knittest.studies.trials.figure import COLOURS, DASHED, dress_panel, log_scale, mark_lost_runs, unit_label
from knittest.studies.trials.trial import OPEN

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from pandas import DataFrame, Series

MOST_RESULTS, MOST_FIELDS = 8, 6
#: relative difference of sizes by whole yarns and rounding
SAME_SIZE = 1e-3
#: fewest runs with a rank correlation
FEWEST_RUNS = 8
#: sizes [inch]
PANEL, LEFT, RIGHT, TOP, BOTTOM = (2.9, 2.2), 0.85, 0.2, 0.55, 0.7
#: height of a row and least width of a column of the legend [inch]
ROW, COLUMN = 0.19, 2.3
CHOICES = ("fabric", "scale", "direction", "preset", "parameters")


@dataclass(frozen=True)
class _Group:
    """Runs with a result that differ in swept fields only."""

    name: str
    colour: str
    rows: "DataFrame"


@dataclass(frozen=True)
class _Scale:
    """Places of a field's values on an axis: the numbers, or the positions of its ``names``."""

    names: list[str]
    log: bool
    drawn: bool

    def places(self, values: "Series") -> Array:
        """Place of each of ``values`` (n,)."""
        if self.names:
            return np.array([self.names.index(str(value)) for value in values], dtype=float)
        return values.to_numpy(float)


def overview_picture(path: Path, table: "DataFrame", fields: Sequence[SweptField], title: str) -> None:
    """Draw the runs of one test, ``table`` of :func:`knittest.studies.batch.page.results_table`, to ``path`` (PNG).

    ``fields`` are the swept columns. Filled: completed; hollow: a quality check failed; cross: no result. Lines join
    medians over listed values. Raises :class:`ResourceError`.
    """
    results = results_to_draw(table)[:MOST_RESULTS]
    shown = [field for field in fields if table[field.name].nunique() > 1][:MOST_FIELDS]
    if not results or not shown:
        return
    groups = list(_groups(table, fields))
    lost = table[table[results].isna().all(axis=1) & (table["status"] != OPEN)]
    marks = _legend_marks(groups, table, results, lost)
    columns = max(int(len(shown) * PANEL[0] / COLUMN), 1)
    bottom = BOTTOM + ROW * -(-len(marks) // columns)
    width, height = LEFT + len(shown) * PANEL[0] + RIGHT, TOP + len(results) * PANEL[1] + bottom
    figure = new_figure(width, height)
    grid = figure.subplots(len(results), len(shown), squeeze=False, sharex="col", sharey="row")
    figure.subplots_adjust(
        left=LEFT / width, right=1.0 - RIGHT / width, bottom=bottom / height, top=1.0 - TOP / height,
        wspace=0.08, hspace=0.18,
    )  # fmt: skip
    for column, field in enumerate(shown):
        scale = _scale(table[field.name], field)
        for row, result in enumerate(results):
            _draw_panel(grid[row, column], groups, lost, field.name, result, scale)
        _label_field_axis(grid[-1, column], field.name, table, scale)
    for row, result in enumerate(results):
        grid[row, 0].set_ylabel(textwrap.fill(LABELS[result][0], 24), fontsize=9)
    figure.align_ylabels(grid[:, 0])
    figure.legend(
        handles=marks, loc="lower left", bbox_to_anchor=(LEFT / width, 0.08 / height), ncols=columns, frameon=False,
        fontsize=8.5, borderaxespad=0.0,
    )  # fmt: skip
    figure.suptitle(title, x=LEFT / width, y=1.0 - 0.15 / height, ha="left", va="top", fontsize=12)
    save(figure, path)


def results_to_draw(table: "DataFrame") -> list[str]:
    """Columns of results for one picture: where specimens differ in size, forces per width in place of forces."""

    def sizes_differ(name: str) -> bool:
        size = (table[name] / table[SIZED[name]]).dropna()
        return bool(len(size) and size.max() > size.min() * (1.0 + SAME_SIZE))

    found = [name for name in LABELS if name in table and table[name].notna().any()]
    return [name for name in found if not (SIZED.get(name) in found and sizes_differ(name))]


def _groups(table: "DataFrame", fields: Sequence[SweptField]) -> Iterator[_Group]:
    """Group runs by fabric, scale, direction, preset and parameter set, as far as these differ and are no axis."""
    ran = table[table["status"].isin(("completed", "refused"))]
    axes = {field.name.rpartition(".")[2] for field in fields}
    by = [name for name in CHOICES if ran[name].nunique() > 1 and name not in axes]
    if not by:
        yield _Group("", COLOURS[0], ran)
        return
    for number, (key, rows) in enumerate(ran.groupby(by, sort=False)):
        yield _Group(" ".join(map(str, key)), COLOURS[number % len(COLOURS)], rows)


def _scale(values: "Series", field: SweptField) -> _Scale:
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values.dropna().tolist())
    return _Scale([] if numbers else list(dict.fromkeys(map(str, values))), field.log, field.drawn)


def _draw_panel(axes: "Axes", groups: list[_Group], lost: "DataFrame", field: str, result: str, scale: _Scale) -> None:
    dress_panel(axes).tick_params(labelsize=8)
    if scale.log:
        log_scale(axes.xaxis)
    for group in groups:
        _draw_experiment(axes, group, result)
        _draw_runs(axes, group, field, result, scale)
    mark_lost_runs(axes, scale.places(lost[field]), markersize=5, zorder=5)
    if len(groups) == 1 and not scale.names and (rank := _rank_correlation(groups[0].rows, field, result)) is not None:
        axes.set_title(f"rank correlation {rank:+.2f}", loc="right", fontsize=8, color=GREY, pad=3)


def _draw_runs(axes: "Axes", group: _Group, field: str, result: str, scale: _Scale) -> None:
    for status, face in (("completed", group.colour), ("refused", "none")):
        rows = group.rows[group.rows["status"] == status]
        axes.plot(
            scale.places(rows[field]), _values(rows, result).to_numpy(float), "o", color=group.colour,
            markerfacecolor=face, markersize=4.5, alpha=0.75, zorder=4,
        )  # fmt: skip
    done = group.rows[group.rows["status"] == "completed"]
    if not (scale.names or scale.drawn) and done[field].nunique() > 1:
        medians = _values(done, result).groupby(done[field]).median()
        axes.plot(medians.index.to_numpy(float), medians.to_numpy(float), "-", color=group.colour, linewidth=1.2)


def _values(rows: "DataFrame", result: str) -> "Series":
    """Numbers of ``result``; compared ones are for the nominal size of the specimen."""
    compared = f"{result}_simulated"
    return rows[compared].fillna(rows[result]) if compared in rows else rows[result]


def _draw_experiment(axes: "Axes", group: _Group, result: str) -> None:
    """Draw mean and sd of the experiment, if all runs of the group are compared with the same one."""
    mean, sd = f"{result}_experiment_mean", f"{result}_experiment_sd"
    if mean in group.rows and group.rows[mean].nunique() == 1:
        middle, spread = float(group.rows[mean].dropna().iloc[0]), group.rows[sd].dropna()
        if len(spread):  # of one specimen there is none
            around = middle - float(spread.iloc[0]), middle + float(spread.iloc[0])
            axes.axhspan(*around, color=group.colour, alpha=0.08, linewidth=0)
        axes.axhline(middle, color=group.colour, linewidth=1.0, linestyle=DASHED)


def _rank_correlation(rows: "DataFrame", field: str, result: str) -> float | None:
    """Spearman's correlation over the completed runs; None for too few runs or values."""
    done = rows[rows["status"] == "completed"]
    if len(done) < FEWEST_RUNS or done[field].nunique() < 3 or done[result].nunique() < 3:
        return None
    return float(done[field].astype(float).corr(done[result].astype(float), method="spearman"))


def _label_field_axis(axes: "Axes", field: str, table: "DataFrame", scale: _Scale) -> None:
    """Label the axis with name and unit of the field, in two lines where it is long, and with its choices."""
    found = field_at(tuple(field.split(".")), table["test"].iloc[0])
    unit = unit_label(found.unit) if found else ""
    holder, _, name = field.rpartition(".")
    label = f"{holder}.\n{name}{unit}" if len(field) + len(unit) > 30 else f"{field}{unit}"
    axes.set_xlabel(label, fontsize=9)
    if scale.names:
        axes.set_xticks(range(len(scale.names)), [shorten(name, 14) for name in scale.names])
        axes.set_xlim(-0.5, len(scale.names) - 0.5)


def _legend_marks(groups: list[_Group], table: "DataFrame", results: list[str], lost: "DataFrame") -> "list[Line2D]":
    from matplotlib.lines import Line2D

    def mark(label: str, colour: str, **look: Any) -> Line2D:
        return Line2D([], [], color=colour, label=label, **({"marker": "o", "linestyle": "none"} | look))

    first = groups[0].colour if len(groups) == 1 else GREY
    marks = [mark(group.name, group.colour) for group in groups if group.name]
    marks += [mark("completed", first)] if len(groups) == 1 else []
    if (table["status"] == "refused").any():
        marks.append(mark("a quality check failed", first, markerfacecolor="none"))
    if len(lost):
        marks.append(mark("no result (results.csv says why)", RED, marker="x"))
    kinds = {kind for name in results if f"{name}_kind" in table for kind in table[f"{name}_kind"].dropna()}
    if kinds:
        label = f"experiment, mean ± sd (rows: {', '.join(sorted(kinds))})"
        marks.append(mark(label, first, marker="", linestyle=DASHED))
    return marks


def shorten(text: str, limit: int) -> str:
    """``text`` with its middle left out where it is longer than ``limit``."""
    return text if len(text) <= limit else f"{text[: limit // 2 - 1]}…{text[-(limit // 2) :]}"
