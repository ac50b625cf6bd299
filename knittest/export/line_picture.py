"""Curves of one quantity over another with levels and notes: curve.png, energies.png and others."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY, YELLOW, new_figure, save, style_axes
from knittest.base.history import START_UP, Array, History, checked_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_COLOURS = (BLUE, ORANGE, GREEN, RED, SKY)
#: characters of a label that half the width of a picture holds
HALF = 45
#: height of a row of the legend, as a share of the picture's
ROW = 0.037
#: height of the scale and its name below the curves, and of a further line of the title, likewise
UNDER, TITLE = 0.135, 0.045


@dataclass(frozen=True)
class Line:
    """Curve, (n,) each, its label, and its ``style`` of matplotlib."""

    x: Array
    y: Array
    label: str
    style: str = "-"


@dataclass(frozen=True)
class Band:
    """Area between two curves over x, (n,) each."""

    x: Array
    low: Array
    high: Array
    label: str


@dataclass(frozen=True)
class Span:
    """Marked range of x and its label."""

    low: float
    high: float
    label: str


@dataclass(frozen=True)
class Level:
    """Horizontal line."""

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
    style_axes(axes)
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


@dataclass(frozen=True)
class Reference:
    """Reference curve: strain [%] and force [N], (n,), and its kind, which sets style and legend."""

    strain_pct: Array
    force_n: Array
    kind: Literal["measured", "digitised", "reconstructed", "simulated", "input", "tuned"]
    source: str = ""  # its citation, or a file name


@dataclass(frozen=True)
class EndPoint:
    """Peak force [N] over the strain at it [%], mean and standard deviation."""

    strain_mean: float
    strain_sd: float
    force_mean: float
    force_sd: float
    source: str = ""  # its citation


@dataclass(frozen=True)
class Corridor:
    """Mean and standard deviation of specimens' forces [N] on a common strain grid [%], each (n,); their mean peak."""

    strain_pct: Array
    mean_n: Array
    sd_n: Array
    peak: EndPoint


#: label of the mean curve, which ends where the first specimen breaks
MEAN = "simulated, mean up to the earliest peak"
#: characters of a line in the legend
LEGEND = 56


# Dashes distinguish measured curves from reconstructed ones and inputs of the model.
_STYLE = {
    "measured": (RED, "-", "measured"),
    "digitised": (RED, (0, (6, 2)), "digitised"),
    "reconstructed": (RED, (0, (4, 2)), "reconstructed"),
    "simulated": (GREEN, (0, (5, 1, 1, 1)), "another simulation"),
    "input": (ORANGE, (0, (1, 1.2)), "input of the model"),
    "tuned": (RED, (0, (3, 1.5)), "used to tune the model"),
}


def curve_picture(
    path: Path,
    specimens: Sequence[Mapping[str, Array]],
    *,
    title: str,
    references: Sequence[Reference] = (),
    end_point: EndPoint | None = None,
    corridor: Corridor | None = None,
    yarns: tuple[float, str, str] | None = None,
) -> None:
    """Draw the force-strain curve of one run, or of an ensemble with its mean and sd ``corridor``, to ``path`` (PNG).

    ``specimens`` are ``History.curve`` mappings with ``strain_pct`` and ``force_n``; ``yarns`` (count in the strip, how
    many are modelled, name) adds a scale of force per yarn. Raises :class:`ResourceError`.
    """
    figure = new_figure(8.0, 6.0)
    axes = figure.add_axes((0.1, 0.25, 0.79 if yarns else 0.86, 0.69))
    style_axes(axes)
    for reference in references:
        draw_reference(axes, reference)
    if end_point is not None:
        draw_end_point(axes, end_point)
    if len(specimens) == 1:
        strain, force = specimens[0]["strain_pct"], specimens[0]["force_n"]
        axes.plot(strain, force, color=BLUE, linewidth=2.0, label="simulated", zorder=4)
        top = int(np.nanargmax(force))
        label = f"simulated peak, {force[top]:.0f} N at {strain[top]:.2f} %"
        marker: dict[str, Any] = {"color": BLUE, "markeredgecolor": "white", "markersize": 8}
        axes.plot(strain[top], force[top], "o", label=label, zorder=5, **marker)
    else:
        _draw_ensemble(axes, specimens, corridor)
    axes.set(xlabel="strain [%]", ylabel="force [N]")
    axes.set_xlim(left=0)
    axes.set_ylim(0, axes.get_ylim()[1] * 1.06)
    if yarns:
        count, counted, name = yarns
        ways = (lambda force: np.divide(force, count)), (lambda force: np.multiply(force, count))
        right = axes.secondary_yaxis("right", functions=ways)
        right.set_ylabel(f"force per {name} yarn [N] ({counted})", color=GREY)
        right.tick_params(colors=GREY)
    axes.set_title(title, loc="left", fontsize=12)
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=2, frameon=False, fontsize=9)
    save(figure, path)


def draw_reference(axes: "Axes", reference: Reference) -> None:
    """Draw a curve to compare with in the style of its kind, which the legend names."""
    colour, dashes, text = _STYLE[reference.kind]
    label = _add_citation(text, reference.source)
    above = 4.5 if reference.kind == "input" else 2.0  # a simulation that returns its input would hide it
    axes.plot(
        reference.strain_pct, reference.force_n, color=colour, linestyle=dashes, linewidth=1.6, label=label,
        zorder=above,
    )  # fmt: skip


def draw_end_point(axes: "Axes", point: EndPoint) -> None:
    """Draw the measured end point with a box of one standard deviation."""
    from matplotlib.patches import Rectangle

    label: str | None = f"experiment, mean, sd not stated ({point.source})"
    if np.isfinite(point.strain_sd + point.force_sd):
        corner, size = (point.strain_mean - point.strain_sd, point.force_mean - point.force_sd), 2 * point.strain_sd
        cited, label = _add_citation("experiment, mean ± sd", point.source), None
        colour: dict[str, Any] = {"facecolor": RED, "alpha": 0.13, "edgecolor": RED}
        axes.add_patch(Rectangle(corner, size, 2 * point.force_sd, label=cited, zorder=2, **colour))
    axes.plot(point.strain_mean, point.force_mean, "D", color=RED, markersize=5, zorder=3, label=label)


def _add_citation(text: str, source: str) -> str:
    return textwrap.fill(f"{text} ({source})" if source else text, LEGEND).replace("$", r"\$")


def _draw_ensemble(axes: "Axes", specimens: Sequence[Mapping[str, Array]], corridor: Corridor | None) -> None:
    for number, curve in enumerate(specimens):
        label = f"{len(specimens)} simulated specimens (circles: peaks)" if number == 0 else None
        strain, force = curve["strain_pct"], curve["force_n"]
        axes.plot(
            strain, force, color=SKY, linewidth=0.8, label=label, zorder=2.5, marker="o", markersize=5.5,
            markerfacecolor="white", markeredgecolor=BLUE, markevery=[int(np.nanargmax(force))],
        )  # fmt: skip
    if corridor is not None:
        low, high = corridor.mean_n - corridor.sd_n, corridor.mean_n + corridor.sd_n
        axes.fill_between(corridor.strain_pct, low, high, color=BLUE, alpha=0.16, linewidth=0, label="simulated, ± sd")
        axes.plot(corridor.strain_pct, corridor.mean_n, color=BLUE, linewidth=2.4, label=MEAN, zorder=4)
        peak = corridor.peak
        label = (
            f"simulated peaks {peak.force_mean:.0f} ± {peak.force_sd:.0f} N "
            f"at {peak.strain_mean:.2f} ± {peak.strain_sd:.2f} %"
        )
        axes.errorbar(
            peak.strain_mean, peak.force_mean, xerr=peak.strain_sd, yerr=peak.force_sd, fmt="o", color=BLACK,
            markersize=5, capsize=3, label=label, zorder=6,
        )  # fmt: skip


_LINES: dict[str, tuple[str, Any, str]] = {
    "external_mj": (BLACK, "--", "external work"),
    "kinetic_mj": (BLUE, "-", "kinetic"),
    "contact_mj": (PINK, "-.", "contact"),
    "friction_mj": (RED, "-.", "friction"),
    "damping_mj": (SKY, ":", "damping"),
    "contact_damping_mj": (SKY, "-", "contact damping"),
    "hourglass_mj": (YELLOW, ":", "hourglass"),
    "eroded_mj": (GREY, (0, (6, 2)), "eroded (failed elements)"),
}
_PART_STYLES: tuple[tuple[str, Any], ...] = tuple((c, s) for s in ("-", ":", "--", "-.") for c in (GREEN, ORANGE))
_SMALLEST_PCT = 1e-3
_SHADED = f"not evaluated: start, below\n{100 * START_UP:g} % of the work, and\nafter the first failure"


def energy_picture(
    path: Path,
    history: History,
    *,
    kinetic_limit: float,
    energy_limit: float,
    title: str,
    rows: slice | None = None,
) -> None:
    """Draw ``history.energies`` [mJ] over time [ms], and below two ratios with their limits [-], to ``path`` (PNG).

    ``rows`` are those that the quality checks cover, by default those of a strip. Raises :class:`ResourceError`.
    """
    figure = new_figure(10.2, 6.6)
    upper = figure.add_axes((0.08, 0.41, 0.67, 0.52))
    lower = figure.add_axes((0.08, 0.09, 0.67, 0.28), sharex=upper)
    for axes in (upper, lower):
        style_axes(axes)
    time, rows = history.energies["time_ms"], rows or checked_rows(history)
    _draw_energies(upper, history.energies, time)
    _draw_ratios(lower, history.energies, time, kinetic_limit, energy_limit)
    for axes, failure, shaded in ((upper, "first failure", None), (lower, None, _SHADED)):
        if history.first_failure is not None:
            axes.axvline(float(time[history.first_failure]), color=RED, linewidth=1.1, label=failure)
        if rows.stop < len(time):
            axes.axvspan(time[rows.stop], time[-1], color=GREY, alpha=0.12, linewidth=0)
        axes.axvspan(time[0], time[rows.start], color=GREY, alpha=0.12, linewidth=0, label=shaded)
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.03), fontsize=8.5, frameon=False)
    upper.set(ylabel="energy [mJ]", xlim=(time[0], time[-1]))
    upper.tick_params(labelbottom=False)
    lower.set(xlabel="time [ms]", ylabel="ratio [%]")
    upper.set_title(title, loc="left", fontsize=12)
    save(figure, path)


def _draw_energies(axes: "Axes", energies: dict[str, Array], time: Array) -> None:
    parts = [name for name in energies if name.startswith("internal_")]
    for name, (colour, dashes) in zip(parts, cycle(_PART_STYLES), strict=False):
        label = "internal, " + name.removeprefix("internal_").removesuffix("_mj")
        axes.plot(time, energies[name], color=colour, linestyle=dashes, linewidth=1.8, label=label)
    for name, (colour, dashes, label) in _LINES.items():
        if name in energies and np.any(energies[name]):
            axes.plot(time, energies[name], color=colour, linestyle=dashes, linewidth=1.5, label=label)


def _draw_ratios(axes: "Axes", energies: dict[str, Array], time: Array, kinetic: float, error: float) -> None:
    for name, limit, colour, dashes, label in (
        ("kinetic_ratio", kinetic, BLUE, "-", "kinetic energy over work"),
        ("energy_error", error, ORANGE, "-.", "energy error"),
    ):
        values = np.maximum(np.abs(energies[name]) * 100, _SMALLEST_PCT)
        axes.plot(time, values, color=colour, linestyle=dashes, linewidth=1.5, label=label)
        axes.axhline(limit * 100, color=colour, linestyle="--", linewidth=1.0, label=f"its limit, {limit * 100:g} %")
    axes.set_yscale("log")
    axes.set_ylim(_SMALLEST_PCT, 200)
