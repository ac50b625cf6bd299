"""Stamp, die and holder of a forming run: in space, in plan and in section at full depth."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from knittest.base.figure import BLUE, GREEN, GREY, ORANGE, RED, dress, new_figure, save
from knittest.base.history import Array
from knittest.tooling.fit import Fit, Stroke
from knittest.tooling.toolset import PLATE, ToolSet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from mpl_toolkits.mplot3d import Axes3D

COLOURS = {"stamp": ORANGE, "die": BLUE, "holder": GREEN}
#: die and holder often have one opening: both lines are seen
WIDTHS, DASHES = {"stamp": 1.6, "die": 3.0, "holder": 1.4}, {"stamp": "-", "die": "-", "holder": "--"}
#: samples of a picture across
FINE = 400
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
    _space(space, tools)
    _plan(figure.add_axes((0.5, 0.44, 0.34, 0.49)), tools, fit, stroke)
    _section(figure.add_axes((0.07, 0.08, 0.88, 0.26)), tools, fit, stroke)
    save(figure, path)


def _space(axes: "Axes3D", tools: ToolSet) -> None:
    """All meshes, drawn apart and lit from one side; what faces away or lies lower is painted first."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    elevation, azimuth = np.deg2rad(VIEW)
    towards = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    ends = []
    for level, name in enumerate(sorted(tools.by_name, key=lambda name: LIFT[name])):
        solid = tools.by_name[name].solid.moved((0.0, 0.0, LIFT[name]))
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


def _plan(axes: "Axes", tools: ToolSet, fit: Fit, stroke: Stroke) -> None:
    """Outlines where the walls are, at full depth, and the blank."""
    half, thickness, depth = 0.5 * np.array(stroke.blank), stroke.thickness, stroke.depth
    x, y = (1.08 * np.linspace(-side, side, FINE) for side in half)
    heights = {"stamp": 0.5 * thickness + depth, "die": -0.5 * thickness - depth, "holder": 0.5 * (thickness + PLATE)}
    for name, tool in tools.by_name.items():
        points = np.stack(np.meshgrid(x, y, heights[name], indexing="ij"), axis=-1).reshape(-1, 3)
        style: dict[str, Any] = {"colors": COLOURS[name], "linewidths": WIDTHS[name], "linestyles": DASHES[name]}
        distance = tool.distance(points).reshape(FINE, FINE).T
        if distance.min() < 0.0 < distance.max():
            axes.contour(x, y, distance, [0.0], **style)
        axes.plot([], [], color=COLOURS[name], lw=WIDTHS[name], ls=DASHES[name], label=f"{name}, wall")
    around = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half
    axes.plot(*around.T, color=GREY, lw=1.2, ls=":", label="blank")
    axes.plot(*fit.die.place[:2], "x", color=RED, ms=8, mew=2, label="smallest clearance")
    axes.plot(*(_direction(fit)[:, None] * _reach(stroke)), color=GREY, lw=0.8, ls="-.", label="section below")
    axes.set(xlim=x[[0, -1]], ylim=y[[0, -1]], aspect="equal")
    axes.set_xlabel("x, weft [mm]", fontsize=9)
    axes.set_ylabel("y, warp [mm]", fontsize=9)
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8.5, frameon=False)
    dress(axes)


def _section(axes: "Axes", tools: ToolSet, fit: Fit, stroke: Stroke) -> None:
    """Bodies cut by an upright plane through the middle and the smallest clearance; the blank at its start."""
    towards, travel, thickness = _direction(fit), fit.die.travel, stroke.thickness
    along, z = _reach(stroke), np.linspace(-stroke.depth - 15.0, 15.0, FINE)
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
    dress(axes)


def _direction(fit: Fit) -> Array:
    """Direction in plan of the section, (2,): from the middle of the blank to the smallest clearance; y for none."""
    place = np.array(fit.die.place[:2])
    away = float(np.linalg.norm(place))
    return place / away if away > 1.0 else np.array([0.0, 1.0])


def _reach(stroke: Stroke) -> Array:
    """Places along the section [mm]."""
    half = 0.5 * max(stroke.blank)
    return np.linspace(-half, half, 2 * FINE)
