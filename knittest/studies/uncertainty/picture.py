"""Pictures bands.png, quantities over their axis with their bands, and indices.png, their sensitivity indices."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.figure import GREY, Stamp, new_figure, save, use_stamp
from knittest.studies.trials.figure import COLOURS, DASHED, dress_panel, log_scale, unit_label
from knittest.studies.uncertainty.outcome import Uncertainty, VariableRow
from knittest.studies.uncertainty.page import short_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: panels beside each other, their sizes [inch], and the height of a bar and of what is around them
COLUMNS, PANEL, BAR, AROUND = 3, (4.2, 3.4), 0.13, 1.1


def draw_pictures(found: Uncertainty, folder: Path) -> list[Path]:
    """Draw both into ``folder``, with a panel a quantity or a fabric; returns the written files."""
    banded = [one for one in found.variables if one.band]
    keys = dict.fromkeys((one.quantity, one.ratio) for one in banded)
    panels = {
        "bands.png": [[one for one in banded if (one.quantity, one.ratio) == key] for key in keys],
        "indices.png": _group_by_fabric([one for one in found.variables if one.indices]),
    }
    for name, groups in panels.items():
        (folder / name).unlink(missing_ok=True)
        if groups:
            _draw(folder / name, found, groups, name == "indices.png")
    return [folder / name for name, groups in panels.items() if groups]


def _group_by_fabric(rows: Sequence[VariableRow]) -> list[list[VariableRow]]:
    """Group ``rows`` by quantity and fabric or ratio, in their order."""
    return [list(group) for _, group in groupby(rows, key=lambda one: (one.quantity, one.who))]


def _draw(path: Path, found: Uncertainty, groups: list[list[VariableRow]], bars: bool) -> None:
    wide = min(len(groups), COLUMNS)
    high = -(-len(groups) // wide)
    most = max(len(rows) * (len(found.parameters) + 1) for rows in groups)
    height = max(PANEL[1], BAR * most + AROUND) if bars else PANEL[1]
    figure = new_figure(wide * PANEL[0] + 0.3, high * height + 0.5)
    grid = figure.subplots(high, wide, squeeze=False)
    for axes, rows in zip(grid.flat, groups, strict=False):
        dress_panel(axes).tick_params(labelsize=8)
        (_draw_bars if bars else _draw_bands)(axes, rows)
    for axes in list(grid.flat)[len(groups) :]:
        axes.set_visible(False)
    figure.suptitle(f"{found.uncertainty}: {'indices' if bars else 'bands'}, {found.samples} samples", fontsize=12)
    figure.tight_layout()
    facts = [", ".join(found.fabrics.values()), found.test, *found.setup, f"seed {found.seed}"]
    lost = len(found.lost)
    verdict = f"{lost} of {found.runs} runs lack a result" if lost else "every run has a result"
    with use_stamp(Stamp(facts, verdict, bad=lost > 0)):
        save(figure, path)


def _draw_bands(axes: "Axes", rows: list[VariableRow]) -> None:
    """Draw median and 5 to 95 % band of each fabric or ratio, over the axis or side by side."""
    groups = _group_by_fabric(rows)
    for number, group in enumerate(groups):
        colour = COLOURS[number % len(COLOURS)]
        band = np.array([one.band for one in group], float)
        if len(group) > 1:
            places = np.array([one.at for one in group], float)
            axes.fill_between(places, band[:, 0], band[:, 2], color=colour, alpha=0.18, linewidth=0)
            axes.plot(places, band[:, 1], "o-", color=colour, markersize=4, linewidth=1.4, label=_label(group))
        else:
            off = np.abs(band[:, [0, 2]] - band[:, [1]]).T
            axes.errorbar([number], band[:, 1], off, fmt="o", color=colour, capsize=4, label=_label(group))
    first = rows[0]
    if first.ratio:
        axes.axhline(1.0, color=GREY, linewidth=1.0, linestyle=DASHED)
    if first.log and not first.ratio:
        log_scale(axes.yaxis)
    if first.at is None:
        axes.set_xticks([])
        axes.set_xlim(-0.5, len(groups) - 0.5)
    axes.set(xlabel=first.axis, ylabel=f"{first.quantity}{', ratio' if first.ratio else ''}{unit_label(first.unit)}")
    axes.set_title("median, 5 to 95 % of the prior", fontsize=8.5, color=GREY, loc="left")
    axes.legend(frameon=False, fontsize=8.5)


def _label(group: list[VariableRow]) -> str:
    """Fabric or ratio, and the number of points of its band if some have no result."""
    least = min(one.count for one in group)
    return group[0].who + (f", {least} of {group[0].points} points" if least < group[0].points else "")


def _draw_bars(axes: "Axes", rows: list[VariableRow]) -> None:
    """Draw total indices as bars with intervals and first-order ones as ticks, or rank coefficients as bars."""
    names, ranks = [index.parameter for index in rows[0].indices], rows[0].explained is not None
    high = 0.8 / len(rows)
    for number, row in enumerate(rows):
        places = np.arange(len(names)) - 0.4 + high * (number + 0.5)
        total = np.array([index.first if ranks else index.total for index in row.indices], float)
        both = [index.first_interval if ranks else index.total_interval for index in row.indices]
        ends = np.array(both, float).reshape(-1, 2)
        label = ("ranks" if ranks else "total") if row.at is None else f"{row.at:g}"
        off = np.maximum(np.abs(ends.T - total), 0.0)
        axes.barh(places, total, 0.9 * high, color=COLOURS[number % len(COLOURS)], alpha=0.75, label=label)
        axes.errorbar(total, places, xerr=off, fmt="none", ecolor="#333333", elinewidth=0.8, capsize=1.5)
        if not ranks:
            first = np.array([index.first for index in row.indices], float)
            axes.plot(first, places, "|", color="black", markersize=7)
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.set_yticks(np.arange(len(names)), [short_name(name) for name in names], fontsize=7.5)
    axes.invert_yaxis()
    axes.set_xlabel("rank regression coefficient" if ranks else "index: bar total, | first order", fontsize=8.5)
    axes.set_title(f"{rows[0].quantity}, {rows[0].who}", fontsize=9.5, loc="left")
    axes.legend(frameon=False, fontsize=7.5, title=rows[0].axis or None, title_fontsize=7.5)
