"""A field over the plan of a formed blank, with the outlines of the tools and of the flat blank."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from knittest.base.figure import BLACK, GREY, new_figure, save
from knittest.base.history import Array

if TYPE_CHECKING:
    from matplotlib.colors import Normalize


@dataclass(frozen=True)
class Outlines:
    """Closed lines in plan by name, (n, 2) each [mm], and the ``extent`` of the picture about the origin [mm]."""

    lines: dict[str, Array]
    extent: tuple[float, float]


@dataclass(frozen=True)
class Field:
    """``value`` (n,) at ``place`` (n, 2) [mm], or in the polygons ``cells`` (n, k, 2); nan is not known, and the legend
    calls it ``unknown``. ``colours`` are those of a scale without signs, on which a line stands at ``limit``.
    """

    place: Array
    value: Array
    cells: Array | None = None
    unknown: str = "not known"
    colours: str = "viridis"
    limit: float | None = None


UNKNOWN = "#e4e7ea"
#: lengths of the picture [inch]: the plan across, and what lies around it, right of it where there is a scale
PLAN, LEFT, RIGHT, SCALED, TOP, BOTTOM = 5.4, 0.8, 0.3, 1.3, 0.6, 1.3
#: letters of a note in a line
LETTERS = 88
DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))


def plan_picture(
    path: Path,
    field: Field,
    outlines: Outlines,
    *,
    title: str,
    label: str,
    note: str,
    signed: bool = False,
    top: float | None = None,
) -> None:
    """Colour ``field``, grey where it is not known.

    ``signed`` scales are symmetric about zero; ``top`` [unit of value] ends the scale. Raises ResourceError.
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    axes = _sheet(outlines, SCALED, title, note)
    figure: Any = axes.figure
    place, value, cells = field.place, field.value, field.cells
    shown = np.isfinite(value)
    most = float(np.abs(value[shown]).max(initial=0.0)) if top is None else top
    scale = Normalize(-most if signed else 0.0, max(most, 1e-9))
    colours = "RdBu_r" if signed else field.colours
    drawn: Any
    if cells is None:
        size = _size(place, outlines)
        axes.scatter(*place[~shown].T, s=size, color=UNKNOWN, marker="s", linewidths=0)
        drawn = axes.scatter(
            place[shown, 0], place[shown, 1], c=value[shown], s=size, marker="s", linewidths=0, cmap=colours, norm=scale
        )
    else:
        axes.add_collection(PolyCollection(list(cells[~shown]), facecolor=UNKNOWN, edgecolor="none"))
        drawn = PolyCollection(list(cells[shown]), edgecolor="face", linewidth=0.2, cmap=colours, norm=scale)
        drawn.set_array(value[shown])
        axes.add_collection(drawn)
    if not shown.all():
        axes.fill([], [], color=UNKNOWN, label=field.unknown)
    _draw(axes, outlines)
    box, wide = axes.get_position(), figure.get_size_inches()[0]
    bar = figure.add_axes((box.x1 + 0.2 / wide, box.y0 + 0.1 * box.height, 0.2 / wide, 0.8 * box.height))
    found = figure.colorbar(drawn, cax=bar, extend=_cut(value[shown], scale))
    found.set_label(label)
    if field.limit is not None:
        found.ax.axhline(field.limit, color=BLACK, lw=1.5)
    save(figure, path)


def outline_picture(path: Path, now: Sequence[Array], outlines: Outlines, *, title: str, note: str) -> None:
    """The edge of the blank after the draw, lines (n, 2) [mm], over ``outlines``. Raises ResourceError."""
    axes = _sheet(outlines, RIGHT, title, note)
    for k, line in enumerate(now):
        axes.plot(*line.T, color="#0072B2", lw=1.8, label="edge of the drawn blank" if k == 0 else None)
    _draw(axes, outlines)
    save(axes.figure, path)


def _sheet(outlines: Outlines, right: float, title: str, note: str) -> Any:
    """Axes that the plan fills, with ``right`` [inch] beside them, below the title and above the note."""
    x, y = outlines.extent
    lines = textwrap.wrap(note, LETTERS)
    high, below = PLAN * y / x, BOTTOM + 0.17 * (len(lines) - 1)
    wide, tall = LEFT + PLAN + right, TOP + high + below
    figure = new_figure(wide, tall)
    axes = figure.add_axes((LEFT / wide, below / tall, PLAN / wide, high / tall))
    axes.set(xlim=(-x, x), ylim=(-y, y), xlabel="x, along the weft [mm]", ylabel="y, along the warp [mm]")
    figure.text(LEFT / wide, 1.0 - 0.4 / tall, title, fontsize=12)
    figure.text(0.2 / wide, 0.15 / tall, "\n".join(lines), fontsize=9, color=GREY)
    return axes


def _cut(value: Array, scale: "Normalize") -> Literal["neither", "both", "min", "max"]:
    """Ends of the scale beyond which values lie, but for those that rounding puts there."""
    low, high = scale.vmin, scale.vmax
    assert low is not None and high is not None
    beyond = 1e-6 * (high - low)
    under, over = bool((value < low - beyond).any()), bool((value > high + beyond).any())
    return "both" if under and over else "min" if under else "max" if over else "neither"


def _draw(axes: Any, outlines: Outlines) -> None:
    for (name, line), dash in zip(outlines.lines.items(), DASHES, strict=False):
        axes.plot(*line.T, color=BLACK, lw=1.0, ls=dash, label=name)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=4, fontsize=8, frameon=False)


def _size(place: Array, outlines: Outlines) -> float:
    """Marker area [points^2] at which squares about evenly spread points touch."""
    spacing = float(np.sqrt(np.prod(np.ptp(place, axis=0)) / len(place)))
    return float((PLAN * 72.0 * spacing / (2.0 * outlines.extent[0])) ** 2)
