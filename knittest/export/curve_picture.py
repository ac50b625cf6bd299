"""curve.png: force over strain, beside what it is compared with."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, GREY, ORANGE, RED, SKY, dress, new_figure, save
from knittest.base.history import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Reference:
    """A curve to compare with: strain [%] and force [N], (n,), and how it came about, which style and legend say."""

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


#: what the mean of specimens is called, whose curve cannot go on where one of them breaks
MEAN = "simulated, mean up to the earliest peak"
#: characters of a line in the legend
LEGEND = 56


# Dashes tell a measured curve from what was made of an end point or fed into the model.
_STYLE = {
    "measured": (RED, "-", "measured"),
    "digitised": (RED, (0, (6, 2)), "digitised"),
    "reconstructed": (RED, (0, (4, 2)), "reconstructed"),
    "simulated": (GREEN, (0, (5, 1, 1, 1)), "simulated elsewhere"),
    "input": (ORANGE, (0, (1, 1.2)), "input of the model"),
    "tuned": (RED, (0, (3, 1.5)), "the model was tuned on it"),
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
    dress(axes)
    for reference in references:
        draw_reference(axes, reference)
    if end_point is not None:
        draw_end_point(axes, end_point)
    if len(specimens) == 1:
        strain, force = specimens[0]["strain_pct"], specimens[0]["force_n"]
        axes.plot(strain, force, color=BLUE, linewidth=2.0, label="simulated", zorder=4)
        top = int(np.nanargmax(force))
        label = f"simulated peak, {force[top]:.0f} N at {strain[top]:.2f} %"
        axes.plot(
            strain[top], force[top], "o", color=BLUE, markeredgecolor="white", markersize=8, label=label, zorder=5
        )
    else:
        _ensemble(axes, specimens, corridor)
    axes.set(xlabel="strain [%]", ylabel="force [N]")
    axes.set_xlim(left=0)
    axes.set_ylim(0, axes.get_ylim()[1] * 1.06)
    if yarns:
        _force_per_yarn(axes, *yarns)
    axes.set_title(title, loc="left", fontsize=12)
    figure.legend(*axes.get_legend_handles_labels(), loc="lower center", ncols=2, frameon=False, fontsize=9)
    save(figure, path)


def draw_reference(axes: "Axes", reference: Reference) -> None:
    """Draw a curve to compare with in the style of its kind, which the legend names."""
    colour, dashes, text = _STYLE[reference.kind]
    label = _cited(text, reference.source)
    above = 4.5 if reference.kind == "input" else 2.0  # a simulation that returns its input would hide it
    axes.plot(
        reference.strain_pct, reference.force_n, color=colour, linestyle=dashes, linewidth=1.6, label=label,
        zorder=above,
    )  # fmt: skip


def draw_end_point(axes: "Axes", point: EndPoint) -> None:
    """Draw the measured end point with a box of one standard deviation."""
    from matplotlib.patches import Rectangle

    if not np.isfinite(point.strain_sd + point.force_sd):
        label = f"experiment, mean, sd not stated ({point.source})"
        axes.plot(point.strain_mean, point.force_mean, "D", color=RED, markersize=5, zorder=3, label=label)
        return
    corner = (point.strain_mean - point.strain_sd, point.force_mean - point.force_sd)
    label = _cited("experiment, mean ± sd", point.source)
    box = Rectangle(
        corner, 2 * point.strain_sd, 2 * point.force_sd, facecolor=RED, alpha=0.13, edgecolor=RED, label=label, zorder=2
    )
    axes.add_patch(box)
    axes.plot(point.strain_mean, point.force_mean, marker="D", color=RED, markersize=5, linestyle="none", zorder=3)


def _cited(text: str, source: str) -> str:
    """``text`` with its citation in brackets, as one entry of a legend."""
    return textwrap.fill(f"{text} ({source})" if source else text, LEGEND).replace("$", r"\$")


def _ensemble(axes: "Axes", specimens: Sequence[Mapping[str, Array]], corridor: Corridor | None) -> None:
    for number, curve in enumerate(specimens):
        label = f"{len(specimens)} simulated specimens, circles: their peaks" if number == 0 else None
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


def _force_per_yarn(axes: "Axes", count: float, counted: str, name: str) -> None:
    def shared(force: Any) -> Any:
        return force / count

    def whole(force: Any) -> Any:
        return force * count

    right = axes.secondary_yaxis("right", functions=(shared, whole))
    right.set_ylabel(f"force per {name} yarn [N] ({counted})", color=GREY)
    right.tick_params(colors=GREY)
