"""energies.png: where the work went, and whether the run may be called quasi-static."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, GREY, ORANGE, PINK, RED, SKY, YELLOW, dress, new_figure, save
from knittest.base.history import START_UP, Array, History, judged_rows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LINES: dict[str, tuple[str, Any, str]] = {
    "external_mj": (BLACK, "--", "external work"),
    "kinetic_mj": (BLUE, "-", "kinetic"),
    "contact_mj": (PINK, "-.", "contact"),
    "friction_mj": (RED, "-.", "friction"),
    "damping_mj": (SKY, ":", "damping"),
    "contact_damping_mj": (SKY, "-", "damping of contacts"),
    "hourglass_mj": (YELLOW, ":", "hourglass"),
    "eroded_mj": (GREY, (0, (6, 2)), "eroded (failed elements)"),
}
_PART_STYLES: tuple[tuple[str, Any], ...] = ((GREEN, "-"), (ORANGE, "-"), (GREEN, ":"), (ORANGE, ":"))
_SMALLEST_PCT = 1e-3
_SHADED = f"not judged: below {100 * START_UP:g} % of\nthe work, after a strip's\nfirst failure"


def energy_picture(
    path: Path,
    history: History,
    *,
    kinetic_limit: float,
    energy_limit: float,
    title: str,
    rows: slice | None = None,
) -> None:
    """Draw ``history.energies`` [mJ] over time [ms], and below the two ratios with their limits, to ``path`` (PNG).

    ``kinetic_limit`` and ``energy_limit`` are fractions; ``rows`` are those that are judged, else a strip's.
    Raises :class:`ResourceError`.
    """
    figure = new_figure(10.2, 6.6)
    upper = figure.add_axes((0.08, 0.41, 0.67, 0.52))
    lower = figure.add_axes((0.08, 0.09, 0.67, 0.28), sharex=upper)
    for axes in (upper, lower):
        dress(axes)
    time = history.energies["time_ms"]
    failure = None if history.first_failure is None else float(time[history.first_failure])
    _energies(upper, history.energies, time)
    _ratios(lower, history.energies, time, kinetic_limit, energy_limit)
    rows = rows or judged_rows(history)
    for axes in (upper, lower):
        if failure is not None:
            axes.axvline(failure, color=RED, linewidth=1.1, label="first failure" if axes is upper else None)
        if rows.stop < len(time):
            axes.axvspan(time[rows.stop], time[-1], color=GREY, alpha=0.12, linewidth=0)
        axes.axvspan(
            time[0], time[rows.start], color=GREY, alpha=0.12, linewidth=0, label=None if axes is upper else _SHADED
        )
    upper.set_ylabel("energy [mJ]")
    upper.set_xlim(time[0], time[-1])
    upper.tick_params(labelbottom=False)
    lower.set(xlabel="time [ms]", ylabel="ratio [%]")
    upper.set_title(title, loc="left", fontsize=12)
    for axes in (upper, lower):
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.03), fontsize=8.5, frameon=False)
    save(figure, path)


def _energies(axes: "Axes", energies: dict[str, Array], time: Array) -> None:
    parts = [name for name in energies if name.startswith("internal_")]
    for name, (colour, dashes) in zip(parts, _PART_STYLES, strict=False):
        label = "internal, " + name.removeprefix("internal_").removesuffix("_mj")
        axes.plot(time, energies[name], color=colour, linestyle=dashes, linewidth=1.8, label=label)
    for name, (colour, dashes, label) in _LINES.items():
        if name in energies and np.any(energies[name]):
            axes.plot(time, energies[name], color=colour, linestyle=dashes, linewidth=1.5, label=label)


def _ratios(axes: "Axes", energies: dict[str, Array], time: Array, kinetic: float, error: float) -> None:
    rows = (
        ("kinetic_ratio", kinetic, BLUE, "-", "kinetic energy over work"),
        ("energy_error", error, ORANGE, "-.", "energy error"),
    )
    for name, limit, colour, dashes, label in rows:
        values = np.maximum(np.abs(energies[name]) * 100, _SMALLEST_PCT)
        axes.plot(time, values, color=colour, linestyle=dashes, linewidth=1.5, label=label)
        axes.axhline(limit * 100, color=colour, linestyle="--", linewidth=1.0, label=f"its limit, {limit * 100:g} %")
    axes.set_yscale("log")
    axes.set_ylim(_SMALLEST_PCT, 200)
