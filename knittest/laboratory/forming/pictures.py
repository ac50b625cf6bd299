"""Pictures of forming: a field over the plan, the formed blank at a slant, the tools in space, plan and section."""

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from knittest.base.figure import BLACK, BLUE, GREEN, GREY, ORANGE, RED, current_printing, new_figure, save, style_axes
from knittest.base.history import Array, Frame, Mesh
from knittest.export.shading import View, render_tubes, shade_quads, view_axes
from knittest.tooling.fit import Fit, Stroke
from knittest.tooling.toolset import PLATE, ToolSet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize
    from mpl_toolkits.mplot3d import Axes3D


@dataclass(frozen=True)
class Outlines:
    """Closed lines in plan by name, (n, 2) each [mm], and the ``extent`` of the picture about the origin [mm]."""

    lines: dict[str, Array]
    extent: tuple[float, float]


@dataclass(frozen=True)
class Field:
    """``value`` (n,) at ``place`` (n, 2) [mm], or in polygons ``cells`` (n, k, 2); nan is ``unknown``."""

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
    """Colour ``field``; ``signed`` scales are symmetric about zero; ``top`` ends the scale. Raises ResourceError."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    axes = _plan_axes(outlines, SCALED, title, note)
    figure: Any = axes.figure
    place, value, cells = field.place, field.value, field.cells
    shown = np.isfinite(value)
    most = float(np.abs(value[shown]).max(initial=0.0)) if top is None else top
    scale = Normalize(-most if signed else 0.0, max(most, 1e-9))
    colours = "RdBu_r" if signed else field.colours
    drawn: Any
    if cells is None:
        # squares about evenly spread points touch
        spacing = float(np.sqrt(np.prod(np.ptp(place, axis=0)) / len(place)))
        area = (PLAN * 72.0 * spacing / (2.0 * outlines.extent[0])) ** 2
        squares: Any = {"s": area, "marker": "s", "linewidths": 0}
        axes.scatter(*place[~shown].T, color=UNKNOWN, **squares)
        drawn = axes.scatter(*place[shown].T, c=value[shown], cmap=colours, norm=scale, **squares)
    else:
        axes.add_collection(PolyCollection(list(cells[~shown]), facecolor=UNKNOWN, edgecolor="none"))
        drawn = PolyCollection(list(cells[shown]), edgecolor="face", linewidth=0.2, cmap=colours, norm=scale)
        drawn.set_array(value[shown])
        axes.add_collection(drawn)
    if not shown.all():
        axes.fill([], [], color=UNKNOWN, label=field.unknown)
    _draw_outlines(axes, outlines)
    box, wide = axes.get_position(), figure.get_size_inches()[0]
    bar = figure.add_axes((box.x1 + 0.2 / wide, box.y0 + 0.1 * box.height, 0.2 / wide, 0.8 * box.height))
    found = figure.colorbar(drawn, cax=bar, extend=_scale_extension(value[shown], scale))
    found.set_label(label)
    if field.limit is not None:
        found.ax.axhline(field.limit, color=BLACK, lw=1.5)
    save(figure, path)


def outline_picture(path: Path, now: Sequence[Array], outlines: Outlines, *, title: str, note: str) -> None:
    """Draw the edge of the formed blank, lines (n, 2) [mm], over ``outlines``. Raises ResourceError."""
    axes = _plan_axes(outlines, RIGHT, title, note)
    for k, line in enumerate(now):
        axes.plot(*line.T, color="#0072B2", lw=1.8, label="edge of the formed blank" if k == 0 else None)
    _draw_outlines(axes, outlines)
    save(axes.figure, path)


def _plan_axes(outlines: Outlines, right: float, title: str, note: str) -> Any:
    """Axes of the plan between title and note, with ``right`` [inch] free beside them."""
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


def _scale_extension(value: Array, scale: "Normalize") -> Literal["neither", "both", "min", "max"]:
    """Ends of the scale beyond which values lie, but for rounding."""
    low, high = scale.vmin, scale.vmax
    assert low is not None and high is not None
    beyond = 1e-6 * (high - low)
    under, over = bool((value < low - beyond).any()), bool((value > high + beyond).any())
    return "both" if under and over else "min" if under else "max" if over else "neither"


def _draw_outlines(axes: Any, outlines: Outlines) -> None:
    for (name, line), dash in zip(outlines.lines.items(), DASHES, strict=False):
        axes.plot(*line.T, color=BLACK, lw=1.0, ls=dash, label=name)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=4, fontsize=8, frameon=False)


_PIXELS = 1_200_000


def tilted_picture(path: Path, mesh: Mesh, frame: Frame, value: Array, *, title: str, label: str, top: float) -> None:
    """Draw the elements of ``frame`` coloured by ``value`` (n_el,), from 0 to ``top``. Raises ResourceError."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    norm, cmap = Normalize(0.0, max(top, 1e-9), clip=True), colormaps["viridis"]
    colour = cmap(norm(value))[:, :3]
    seen = frame.position @ view_axes().T
    low, high = seen[:, :2].min(axis=0) - 3.0, seen[:, :2].max(axis=0) + 3.0
    size = high - low
    figure = new_figure(9.0, 9.0 * 0.86 * size[1] / size[0] + 1.1)
    tall = figure.get_size_inches()[1]
    axes = figure.add_axes((0.02, 0.5 / tall, 0.86, 1.0 - 1.1 / tall))
    if mesh.kind == "beams":
        view = View(
            low[0], high[0], low[1], high[1], float(np.sqrt(size.prod() / (_PIXELS * current_printing().pixels)))
        )
        ends = seen[mesh.cells]
        image = render_tubes(ends[:, 0], ends[:, 1], mesh.radius, colour, view)
        axes.imshow(image, origin="lower", extent=view.extent, interpolation="antialiased")
    else:
        places, shown = shade_quads(seen[mesh.cells], colour)
        axes.add_collection(PolyCollection(list(places), facecolor=shown, edgecolor=shown, linewidth=0.2))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect("equal")
    axes.set_axis_off()
    figure.text(0.02, 1.0 - 0.3 / tall, title, fontsize=12, va="center")
    bar = figure.add_axes((0.91, 0.25, 0.02, 0.5))
    cut = "max" if float(np.nanmax(value)) > max(top, 1e-9) else "neither"
    figure.colorbar(ScalarMappable(norm, cmap), cax=bar, extend=cut).set_label(label, fontsize=9)
    save(figure, path)


COLOURS = {"stamp": ORANGE, "die": BLUE, "holder": GREEN}
#: die and holder often have one opening: both lines are visible
WIDTHS, TOOL_DASHES = {"stamp": 1.6, "die": 3.0, "holder": 1.4}, {"stamp": "-", "die": "-", "holder": "--"}
#: samples of a picture across
GRID_POINTS = 400
#: how far stamp and holder are lifted in the view [mm]
LIFT = {"stamp": 120.0, "holder": 60.0, "die": 0.0}
#: elevation and azimuth of the view [deg], direction of the light
VIEW = (28.0, -58.0)
LIGHT = np.array([0.35, -0.55, 0.76])


def tools_picture(path: Path, tools: ToolSet, fit: Fit, stroke: Stroke, *, title: str) -> None:
    """Draw ``tools`` to ``path`` (PNG) with the numbers of their ``fit``. Raises :class:`ResourceError`."""
    figure = new_figure(12.5, 8.2)
    figure.text(0.02, 0.975, title, fontsize=12, va="top", color=RED if fit.problems else "black")
    space: Any = figure.add_axes((0.01, 0.38, 0.46, 0.54), projection="3d", proj_type="ortho", computed_zorder=False)
    _draw_space(space, tools)
    _draw_plan(figure.add_axes((0.5, 0.44, 0.34, 0.49)), tools, fit, stroke)
    _draw_section(figure.add_axes((0.07, 0.08, 0.88, 0.26)), tools, fit, stroke)
    save(figure, path)


def _draw_space(axes: "Axes3D", tools: ToolSet) -> None:
    """Draw all meshes apart and lit from one side, lower ones first."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    elevation, azimuth = np.deg2rad(VIEW)
    towards = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    ends = []
    for level, name in enumerate(sorted(tools.by_name, key=lambda name: LIFT[name])):
        solid = tools.by_name[name].solid.with_offset((0.0, 0.0, LIFT[name]))
        ends.append(solid.points)
        seen = solid.normals @ towards > 0.0
        normal = solid.normals[seen] / np.linalg.norm(solid.normals[seen], axis=1)[:, None]
        colour = (0.45 + 0.55 * np.clip(normal @ LIGHT, 0.0, 1.0))[:, None] * np.array(to_rgb(COLOURS[name]))
        axes.add_collection(
            Poly3DCollection(
                solid.corners[seen], facecolors=colour, edgecolors=colour, linewidths=0.3, antialiased=False,
                zorder=level, clip_on=False,
            )
        )  # fmt: skip
    low, high = np.concatenate(ends).min(axis=0), np.concatenate(ends).max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.0)
    axes.view_init(elev=VIEW[0], azim=VIEW[1])
    axes.set_axis_off()


def _draw_plan(axes: "Axes", tools: ToolSet, fit: Fit, stroke: Stroke) -> None:
    half, thickness, depth = 0.5 * np.array(stroke.blank), stroke.thickness, stroke.depth
    x, y = (1.08 * np.linspace(-side, side, GRID_POINTS) for side in half)
    heights = {"stamp": 0.5 * thickness + depth, "die": -0.5 * thickness - depth, "holder": 0.5 * (thickness + PLATE)}
    for name, tool in tools.by_name.items():
        points = np.stack(np.meshgrid(x, y, heights[name], indexing="ij"), axis=-1).reshape(-1, 3)
        style: dict[str, Any] = {"colors": COLOURS[name], "linewidths": WIDTHS[name], "linestyles": TOOL_DASHES[name]}
        distance = tool.distance(points).reshape(GRID_POINTS, GRID_POINTS).T
        if distance.min() < 0.0 < distance.max():
            axes.contour(x, y, distance, [0.0], **style)
        axes.plot([], [], color=COLOURS[name], lw=WIDTHS[name], ls=TOOL_DASHES[name], label=f"{name}, wall")
    around = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half
    axes.plot(*around.T, color=GREY, lw=1.2, ls=":", label="blank")
    axes.plot(*fit.die.place[:2], "x", color=RED, ms=8, mew=2, label="smallest clearance")
    axes.plot(
        *(_section_direction(fit)[:, None] * _section_range(stroke)), color=GREY, lw=0.8, ls="-.", label="section below"
    )
    axes.set(xlim=x[[0, -1]], ylim=y[[0, -1]], aspect="equal")
    axes.set_xlabel("x, weft [mm]", fontsize=9)
    axes.set_ylabel("y, warp [mm]", fontsize=9)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8.5, frameon=False)
    style_axes(axes)


def _draw_section(axes: "Axes", tools: ToolSet, fit: Fit, stroke: Stroke) -> None:
    """Draw the tools cut by an upright plane through the middle and the smallest clearance, and the flat blank."""
    towards, travel, thickness = _section_direction(fit), fit.die.travel, stroke.thickness
    along, z = _section_range(stroke), np.linspace(-stroke.depth - 15.0, 15.0, GRID_POINTS)
    for name, tool in tools.by_name.items():
        height = z + (travel if name == "stamp" else 0.0)
        points = np.column_stack([np.repeat(along[:, None] * towards, len(z), axis=0), np.tile(height, len(along))])
        distance = tool.distance(points).reshape(len(along), len(z)).T
        if distance.min() < 0.0 < distance.max():
            axes.contourf(along, z, distance, [-1e9, 0.0], colors=[COLOURS[name]], alpha=0.45)
            axes.contour(along, z, distance, [0.0], colors=COLOURS[name], linewidths=1.4)
    axes.fill_between(along[[0, -1]], -0.5 * thickness, 0.5 * thickness, color="lightgrey", linewidth=0.0, zorder=0)
    across, level = float(towards @ fit.die.place[:2]), fit.die.place[2]
    axes.plot(across, level, "x", color=RED, ms=8, mew=2)
    axes.annotate(
        f"{fit.die.size:.3g} mm", (across, level), xytext=(8, -4), textcoords="offset points", color=RED, fontsize=9.5,
        bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.8},
    )  # fmt: skip
    axes.set(xlim=along[[0, -1]], ylim=z[[0, -1]], aspect="equal")
    axes.set_xlabel("along the section, from the middle of the blank [mm]", fontsize=9)
    axes.set_ylabel("z [mm]", fontsize=9)
    axes.set_title(
        f"section, stamp moved {travel:.3g} mm; grey: blank at the start; depth in the die's opening {fit.depth:.3g} "
        f"mm (asked {fit.asked:g} mm); smallest clearance {fit.die.size:.3g} mm (x)",
        fontsize=9.5, loc="left", color=RED if fit.problems else "black",
    )  # fmt: skip
    style_axes(axes)


def _section_direction(fit: Fit) -> Array:
    """Direction in plan of the section, (2,): from the middle of the blank to the smallest clearance; y for none."""
    place = np.array(fit.die.place[:2])
    away = float(np.linalg.norm(place))
    return place / away if away > 1.0 else np.array([0.0, 1.0])


def _section_range(stroke: Stroke) -> Array:
    half = 0.5 * max(stroke.blank)
    return np.linspace(-half, half, 2 * GRID_POINTS)
