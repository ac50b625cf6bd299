"""bands.png, quantities over their axis with their bands, and indices.png, what each of them hangs on."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.figure import BLUE, GREEN, GREY, ORANGE, PINK, SKY, Stamp, dress, new_figure, save, stamped
from knittest.base.history import Array
from knittest.studies.uncertainty.outcome import Uncertainty, VariableRow
from knittest.studies.uncertainty.page import short

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = (BLUE, ORANGE, GREEN, PINK, SKY, GREY)
#: panels beside each other, their sizes [inch], and the height of a bar and of what is around them
COLUMNS, PANEL, BAR, AROUND = 3, (4.2, 3.4), 0.13, 1.1


def pictures(found: Uncertainty, folder: Path) -> list[Path]:
    """Draw both into ``folder``, as far as there is anything to draw; the files that were written."""
    panels = {
        "bands.png": (_band_groups(found), _bands),
        "indices.png": ([list(rows) for rows in _whos([one for one in found.variables if one.indices])], _bars),
    }
    written = []
    for name, (groups, draw) in panels.items():
        (folder / name).unlink(missing_ok=True)
        if groups:
            _draw(folder / name, found, groups, draw is _bars)
            written.append(folder / name)
    return written


def _band_groups(found: Uncertainty) -> list[list[VariableRow]]:
    """Variables of a panel: a quantity of all fabrics, and its ratios, which have an axis of their own."""
    drawn = [one for one in found.variables if one.band]
    keys = dict.fromkeys((one.quantity, one.ratio) for one in drawn)
    return [[one for one in drawn if (one.quantity, one.ratio) == key] for key in keys]


def _whos(rows: Sequence[VariableRow]) -> list[list[VariableRow]]:
    """``rows`` of each quantity and fabric or ratio, in their order."""
    return [list(group) for _, group in groupby(rows, key=lambda one: (one.quantity, one.who))]


def _draw(path: Path, found: Uncertainty, groups: list[list[VariableRow]], bars: bool) -> None:
    """A grid of panels, one a group."""
    wide = min(len(groups), COLUMNS)
    high = -(-len(groups) // wide)
    most = max(len(rows) * (len(found.parameters) + 1) for rows in groups)
    panel = max(PANEL[1], BAR * most + AROUND) if bars else PANEL[1]
    figure = new_figure(wide * PANEL[0] + 0.3, high * panel + 0.5)
    grid = figure.subplots(high, wide, squeeze=False)
    for axes, rows in zip(grid.flat, groups, strict=False):
        dress(axes)
        axes.spines["right"].set_visible(False)
        axes.tick_params(labelsize=8)
        if bars:
            _bars(axes, rows)
        else:
            _bands(axes, rows)
    for axes in list(grid.flat)[len(groups) :]:
        axes.set_visible(False)
    figure.suptitle(f"{found.uncertainty}: {'indices' if bars else 'bands'}, {found.samples} samples", fontsize=12)
    figure.tight_layout()
    with stamped(_stamp(found)):
        save(figure, path)


def _stamp(found: Uncertainty) -> Stamp:
    facts = [", ".join(found.fabrics.values()), found.test, *found.setup, f"seed {found.seed}"]
    lost = len(found.lost)
    told = f"{lost} of {found.runs} runs did not give every number" if lost else "every run gave a result"
    return Stamp(facts, told, bad=lost > 0)


def _bands(axes: "Axes", rows: list[VariableRow]) -> None:
    """Median and the band from 5 to 95 % of each fabric or ratio: over the axis, else one beside the other."""
    from matplotlib.ticker import LogLocator, NullLocator

    groups = _whos(rows)
    for number, (colour, group) in enumerate(zip(_colours(len(groups)), groups, strict=True)):
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
        axes.axhline(1.0, color=GREY, linewidth=1.0, linestyle=(0, (4, 2)))
    if first.log and not first.ratio:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_locator(NullLocator())
    if first.at is None:
        axes.set_xticks([])
        axes.set_xlim(-0.5, len(groups) - 0.5)
    unit = f" [{'-' if first.unit == '1' else first.unit}]" if first.unit else ""
    axes.set(xlabel=first.axis, ylabel=f"{first.quantity}{', ratio' if first.ratio else ''}{unit}")
    axes.set_title("median, 5 to 95 % of the prior", fontsize=8.5, color=GREY, loc="left")
    axes.legend(frameon=False, fontsize=8.5)


def _label(group: list[VariableRow]) -> str:
    """Fabric or ratio, and how many points its band is of where some have no number: another part of the prior."""
    least = min(one.count for one in group)
    return group[0].who + (f", {least} of {group[0].points} points" if least < group[0].points else "")


def _bars(axes: "Axes", rows: list[VariableRow]) -> None:
    """Total index of every parameter as a bar with its interval, the first-order one as a tick; a bar a place.

    Of a regression of ranks the bar is the coefficient.
    """
    names, ranks = [index.parameter for index in rows[0].indices], rows[0].explained is not None
    high = 0.8 / len(rows)
    for number, (colour, row) in enumerate(zip(_colours(len(rows)), rows, strict=True)):
        places = np.arange(len(names)) - 0.4 + high * (number + 0.5)
        total = np.array([index.first if ranks else index.total for index in row.indices], float)
        both = [index.first_interval if ranks else index.total_interval for index in row.indices]
        ends = np.array(both, float).reshape(-1, 2)
        label = ("ranks" if ranks else "total") if row.at is None else f"{row.at:g}"
        off = np.maximum(np.abs(ends.T - total), 0.0)
        axes.barh(places, total, 0.9 * high, color=colour, alpha=0.75, label=label)
        axes.errorbar(total, places, xerr=off, fmt="none", ecolor="#333333", elinewidth=0.8, capsize=1.5)
        if not ranks:
            axes.plot(_first(row), places, "|", color="black", markersize=7)
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.set_yticks(np.arange(len(names)), [short(name) for name in names], fontsize=7.5)
    axes.invert_yaxis()
    told = "coefficient of the regression of ranks" if ranks else "index: bar total, | first order"
    axes.set_xlabel(told, fontsize=8.5)
    axes.set_title(f"{rows[0].quantity}, {rows[0].who}", fontsize=9.5, loc="left")
    axes.legend(frameon=False, fontsize=7.5, title=rows[0].axis or None, title_fontsize=7.5)


def _first(row: VariableRow) -> Array:
    return np.array([index.first for index in row.indices], float)


def _colours(count: int) -> list[str]:
    return [COLOURS[k % len(COLOURS)] for k in range(count)]
