"""Fields in plan: several runs on one colour scale with their differences, and shear angles of a specimen."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import GREY, new_figure, save
from knittest.base.history import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure


#: share of the values that colours span [%]; arrows at the bar mark values beyond
SPANNED = 99.0
#: points of the grid on which fields are compared, along their longer side
GRID = 220
#: a place has a value if one lies within this many spacings of it
NEAR = 1.6
#: side of a panel, and what stands around the panels [inch]
PANEL, LEFT, GAP, RIGHT, TOP, BETWEEN, BOTTOM = 3.1, 0.65, 0.15, 1.05, 0.45, 0.45, 0.75
#: margin around the blanks [mm]
MARGIN = 4.0
#: side of the square at a place over the spacing: shear moves places apart
SQUARE = 1.25
SIGNED, GROUND = "RdBu_r", "#d5d9de"
#: characters of a line of the note, which is as wide as a panel
NOTE = 44


@dataclass(frozen=True)
class PlanField:
    """Field of a run called ``name``: ``value`` (n,) at ``place`` (n, 2) [mm]."""

    name: str
    place: Array
    value: Array

    @property
    def spacing(self) -> float:
        """Mean distance of neighbouring places [mm], as of an even spread."""
        return float(np.sqrt(np.prod(np.ptp(self.place, axis=0)) / len(self.place)))


def symmetric_colours(values: Array, spanned: float = SPANNED) -> tuple["Normalize", str]:
    """Colours about 0 that span ``spanned`` % of ``values`` (n,), and the open ends of their bar for matplotlib."""
    from matplotlib.colors import Normalize

    known = values[np.isfinite(values)]
    most = max(float(np.percentile(np.abs(known), spanned)) if known.size else 0.0, 1e-9)
    over, under = bool((known > most).any()), bool((known < -most).any())
    return Normalize(-most, most), ("neither", "min", "max", "both")[2 * over + under]


def fields_picture(path: Path, fields: Sequence[PlanField], *, title: str, label: str) -> None:
    """Draw :func:`fields_figure` to ``path`` (PNG). Raises :class:`ResourceError`."""
    save(fields_figure(fields, title=title, label=label), path)


def fields_figure(fields: Sequence[PlanField], *, title: str, label: str) -> "Figure":
    """Figure of ``fields`` in a row on one scale about 0, and of their differences to the first below, on another."""
    sheet = _Sheet(fields)
    sheet.figure.text(sheet.x(LEFT), 1.0 - sheet.y(0.3), title, fontsize=12, va="center")
    norm, cut = symmetric_colours(np.concatenate([f.value for f in fields]))
    for column, field in enumerate(fields):
        axes = sheet.panel(0, column)
        drawn = _draw_field(axes, field, norm)
        axes.set_title(field.name, fontsize=9.5, loc="left")
    sheet.bar(drawn, 0, cut, label)
    if len(fields) > 1:
        _draw_differences(sheet, fields, label)
    top = BOTTOM + sheet.tall if len(fields) > 1 else BOTTOM - 0.4
    notes = [f"largest absolute values: {', '.join(f'{np.nanmax(np.abs(f.value)):.3g}' for f in fields)}"]
    notes += [f"colours span {SPANNED:g} % of the values"] if cut != "neither" else []
    notes += ["differences only where both blanks are present"] if len(fields) > 1 else []
    note = "\n".join(textwrap.fill(one, NOTE) for one in notes)
    sheet.figure.text(sheet.x(0.2), sheet.y(top), note, fontsize=8.5, color=GREY, va="top")
    return sheet.figure


class _Sheet:
    """Figure with a row of panels of one size, and a second row below from the second panel on."""

    def __init__(self, fields: Sequence[PlanField]) -> None:
        self.low = np.min([f.place.min(axis=0) for f in fields], axis=0) - MARGIN
        self.high = np.max([f.place.max(axis=0) for f in fields], axis=0) + MARGIN
        self.tall = PANEL * float((self.high - self.low)[1] / (self.high - self.low)[0])
        self.rows = min(len(fields), 2)
        wide = LEFT + len(fields) * (PANEL + GAP) + RIGHT
        self.figure = new_figure(wide, TOP + self.rows * (self.tall + BETWEEN) + BOTTOM)

    def x(self, inch: float) -> float:
        return inch / float(self.figure.get_size_inches()[0])

    def y(self, inch: float) -> float:
        return inch / float(self.figure.get_size_inches()[1])

    def _bottom(self, row: int) -> float:
        return BOTTOM + (self.rows - 1 - row) * (self.tall + BETWEEN)

    def panel(self, row: int, column: int) -> "Axes":
        """Axes in plan, the scales at the left and below of each row."""
        left = LEFT + column * (PANEL + GAP)
        axes = self.figure.add_axes((self.x(left), self.y(self._bottom(row)), self.x(PANEL), self.y(self.tall)))
        axes.set(xlim=(self.low[0], self.high[0]), ylim=(self.low[1], self.high[1]), facecolor=GROUND)
        axes.tick_params(labelleft=column == row, labelsize=8)
        if column == row:
            axes.set_ylabel("y [mm]", fontsize=8)
        if row == self.rows - 1:
            axes.set_xlabel("x [mm]", fontsize=8)
        return axes

    def bar(self, drawn: Any, row: int, cut: str, text: str) -> None:
        left = self.figure.get_size_inches()[0] - RIGHT + 0.05
        bottom = self._bottom(row) + 0.06 * self.tall
        axes = self.figure.add_axes((self.x(left), self.y(bottom), self.x(0.13), self.y(0.88 * self.tall)))
        self.figure.colorbar(drawn, cax=axes, extend=cut).set_label(text, fontsize=9)


def _draw_differences(sheet: _Sheet, fields: Sequence[PlanField], label: str) -> None:
    step = float((sheet.high - sheet.low).max()) / GRID
    x, y = (np.arange(a + 0.5 * step, b, step) for a, b in zip(sheet.low, sheet.high, strict=True))
    first, *others = (interpolate_on_grid(field, x, y) for field in fields)
    less = [other - first for other in others]
    norm, cut = symmetric_colours(np.concatenate([one.ravel() for one in less]))
    for column, one in enumerate(less, 1):
        axes = sheet.panel(1, column)
        drawn = axes.imshow(
            one, origin="lower", extent=(x[0], x[-1], y[0], y[-1]), cmap=SIGNED, norm=norm, aspect="auto",
        )  # fmt: skip
        title = f"minus the first: mean {np.nanmean(one):+.2g}, rms {np.sqrt(np.nanmean(one**2)):.2g}"
        axes.set_title(title, fontsize=9, loc="left")
    sheet.bar(drawn, 1, cut, f"difference: {label}")


def _draw_field(axes: "Axes", field: PlanField, norm: "Normalize") -> Any:
    known = np.isfinite(field.value)
    side = 72.0 * PANEL * field.spacing / (axes.get_xlim()[1] - axes.get_xlim()[0])
    x, y = field.place[known].T
    return axes.scatter(
        x, y, c=field.value[known], s=(SQUARE * side) ** 2, marker="s", linewidths=0, cmap=SIGNED, norm=norm
    )


def interpolate_on_grid(field: PlanField, x: Array, y: Array) -> Array:
    """Interpolate ``field`` on the grid of ``x`` (n,) and ``y`` (m,) [mm]: (m, n); nan far from its places."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import cKDTree

    known = np.isfinite(field.value)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    found: Array = LinearNDInterpolator(field.place[known], field.value[known])(points)
    distance, _ = cKDTree(field.place[known]).query(points)
    found[distance > NEAR * field.spacing] = np.nan
    return found


#: area of a point [points^2]
POINT = 24


def draw_shear_field(
    axes: "Axes", places: Array, value: Array, cmap: str = "viridis", norm: "Normalize | None" = None
) -> "Collection":
    """Draw ``value`` [deg], (n,), at ``places`` [mm]: polygons (n, k, 2) or points (n, 2); returns what has colours.

    ``norm`` of the colours ``cmap``; unless given, from the smallest to the largest value.
    """
    from matplotlib.collections import PolyCollection

    drawn: Collection
    if places.ndim == 3:
        drawn = PolyCollection(list(places), array=value, edgecolors="face", linewidths=0.2)
        axes.add_collection(drawn)
        axes.autoscale_view()
    else:
        drawn = axes.scatter(places[:, 0], places[:, 1], c=value, s=POINT, linewidths=0)
    drawn.set_cmap(cmap)
    if norm is not None:
        drawn.set_norm(norm)
    axes.set_aspect("equal")
    axes.set(xlabel="across the load direction [mm]", ylabel="along the load direction [mm]")
    return drawn
