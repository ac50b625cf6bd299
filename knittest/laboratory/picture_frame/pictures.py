"""Pictures of a frame in its plane: its outline, a value over the plane, and shear-angle.png."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from knittest.base.figure import BLUE, GREY, new_figure, save, style_axes
from knittest.base.history import Array
from knittest.export.field_pictures import SIGNED, draw_shear_field, symmetric_colours

if TYPE_CHECKING:
    from matplotlib.axes import Axes


BAR, ARM, CLAMP = "#59616a", "#c9ced4", "#2f353b"
#: width of a bar, extent of the arms and length of the arrows, over the side of the frame
WIDE, ARMS, ARROW = 0.035, 0.98, 0.16


@dataclass(frozen=True)
class FrameShape:
    """Sides of frame and fabric [mm] and the shear angle [deg]."""

    frame: float
    fabric: float
    angle: float

    def corners(self, side: float) -> Array:
        """Corners of a square of ``side`` [mm] sheared with the frame, (4, 2): right, top, left, bottom."""
        half = 0.5 * np.deg2rad(self.angle)
        across, along = (np.sqrt(0.5) * side * (np.cos(half) + sign * np.sin(half)) for sign in (-1.0, 1.0))
        return np.array([[across, 0.0], [0.0, along], [-across, 0.0], [0.0, -along]])

    @property
    def reach(self) -> Array:
        """Half the width and height of the drawing [mm], (2,)."""
        arrow = np.array([0.0, (ARROW + 0.03) * self.frame])
        return np.asarray(self.corners(self.frame * (1.0 + 2.0 * WIDE)).max(axis=0) + arrow)


def draw_frame(axes: "Axes", shape: FrameShape) -> None:
    """Draw the frame below the content of ``axes``, and fit their limits to it."""
    from matplotlib.patches import Polygon

    inner, outer = shape.corners(shape.fabric), shape.corners(shape.frame)
    for k in range(4):
        near, far = inner[[k, (k + 1) % 4]], outer[[k, (k + 1) % 4]]
        if shape.frame > shape.fabric:
            share = 0.5 * (1.0 - ARMS * shape.fabric / shape.frame)
            ends = far[0] + np.array([[share], [1.0 - share]]) * (far[1] - far[0])
            axes.add_patch(Polygon([near[0], near[1], ends[1], ends[0]], facecolor=ARM, edgecolor="none", zorder=0.5))
        axes.plot(*near.T, color=CLAMP, linewidth=1.6, zorder=3)
        out = far.mean(axis=0) / np.linalg.norm(far.mean(axis=0))
        beyond = WIDE * shape.frame * out
        axes.add_patch(Polygon([*far, far[1] + beyond, far[0] + beyond], facecolor=BAR, edgecolor="none", zorder=2))
    pins = outer * (1.0 + 0.5 * WIDE)
    axes.plot(*pins.T, "o", markersize=7, color="white", markeredgecolor=BAR, markeredgewidth=1.6, zorder=4)
    for end in (pins[1], pins[3]):
        tip = end + np.sign(end) * [0.0, ARROW * shape.frame]
        axes.annotate("", tip, end, arrowprops={"arrowstyle": "-|>", "color": CLAMP, "lw": 1.8}, zorder=5)
    x, y = shape.reach
    axes.set(xlim=(-x, x), ylim=(-y, y))


#: lengths of the picture [inch]: the plane, and what lies around it
TALL, LEFT, RIGHT, TOP, BOTTOM = 5.9, 0.85, 1.3, 0.6, 1.0


def height_picture(path: Path, x: Array, y: Array, height: Array, *, title: str, note: str, shape: FrameShape) -> None:
    """Draw ``height`` [mm] over x, y [mm], (n, m), nan outside, in its frame. Raises :class:`ResourceError`."""
    from matplotlib.ticker import FixedLocator

    reach = shape.reach
    across = TALL * reach[0] / reach[1]
    figure = new_figure(max(LEFT + across + RIGHT, 5.0), TALL + TOP + BOTTOM)
    wide, tall = figure.get_size_inches()
    axes = figure.add_axes((LEFT / wide, BOTTOM / tall, across / wide, TALL / tall))
    most = max(float(np.nanmax(np.abs(height))), 1e-6)
    levels = _levels(most)
    filled = axes.contourf(x, y, height, levels=levels, cmap="RdBu_r")
    axes.contour(x, y, height, levels=levels[len(levels) // 2 % 2 :: 2], colors=GREY, linewidths=0.5)
    axes.set_aspect("equal")
    draw_frame(axes, shape)
    axes.set(xlabel="across the pull [mm]", ylabel="along the pull [mm]")
    figure.text(0.2 / wide, 1.0 - 0.35 / tall, title, fontsize=12)
    place = ((LEFT + across + 0.15) / wide, (BOTTOM + 0.1 * TALL) / tall, 0.17 / wide, 0.8 * TALL / tall)
    bar = figure.colorbar(filled, cax=figure.add_axes(place))
    bar.ax.yaxis.set_major_locator(FixedLocator(list(levels[len(levels) // 2 % 2 :: 2])))
    bar.ax.yaxis.set_major_formatter("{x:.3g}")
    bar.set_label("height over the frame's plane [mm]", labelpad=8)
    figure.text(0.2 / wide, 0.15 / tall, note, fontsize=9, color=GREY)
    save(figure, path)


def _levels(most: float) -> Array:
    """About 16 levels with round numbers, symmetric about 0, which is one of them, up to ``most`` or a little more."""
    rough = most / 8.0
    unit = 10.0 ** np.floor(np.log10(rough))
    step = unit * min((1.0, 2.0, 2.5, 5.0, 10.0), key=lambda round_: abs(np.log(round_ * unit / rough)))
    count = int(np.ceil(most / step - 1e-9))
    return np.asarray(step * np.arange(-count, count + 1))


#: lengths of the picture [inch]: curves and plane, what lies between and around them
SHEAR_TALL, CURVE, SHEAR_LEFT, GAP, SHEAR_RIGHT, AROUND = 4.3, 4.4, 0.8, 0.85, 1.1, 1.2
#: share of the material within the colours [%]
SCALE_PERCENTILE = 99.5


def shear_picture(
    path: Path, table: Mapping[str, Array], places: Array, difference: Array, *, title: str, shape: FrameShape
) -> None:
    """Draw shear-angle.csv, and the difference [deg] at ``places`` [mm]: polygons (n, k, 2) or points (n, 2)."""
    x, y = shape.reach
    wide = SHEAR_TALL * x / y
    figure = new_figure(SHEAR_LEFT + CURVE + GAP + wide + SHEAR_RIGHT, SHEAR_TALL + AROUND)
    width, height = figure.get_size_inches()
    axes = figure.add_axes((SHEAR_LEFT / width, 0.65 / height, CURVE / width, SHEAR_TALL / height))
    style_axes(axes)
    _draw_over_angle(axes, table)
    figure.text(SHEAR_LEFT / width, 1.0 - 0.3 / height, title, fontsize=12)
    plane = figure.add_axes(((SHEAR_LEFT + CURVE + GAP) / width, 0.65 / height, wide / width, SHEAR_TALL / height))
    norm, cut = symmetric_colours(difference, SCALE_PERCENTILE)
    drawn = draw_shear_field(plane, places, difference, SIGNED, norm)
    draw_frame(plane, shape)
    plane.set_title(f"frame at {shape.angle:.1f} deg", fontsize=10, loc="left")
    cax = figure.add_axes(
        (1.0 - (SHEAR_RIGHT - 0.2) / width, (0.65 + 0.1 * SHEAR_TALL) / height, 0.16 / width, 0.8 * SHEAR_TALL / height)
    )
    figure.colorbar(drawn, cax=cax, extend=cut).set_label("shear angle, material less frame [deg]")
    save(figure, path)


def _draw_over_angle(axes: "Axes", table: Mapping[str, Array]) -> None:
    frame = table["frame_shear_angle_deg"]
    low, high = table["percentile_5_deg"] - frame, table["percentile_95_deg"] - frame
    axes.axhline(0.0, color=GREY, linestyle="--", linewidth=1.2)
    axes.fill_between(frame, low, high, color=BLUE, alpha=0.2, linewidth=0, label="5 to 95 % of the material")
    axes.plot(frame, table["mean_deg"] - frame, "o-", color=BLUE, markersize=4, linewidth=1.6, label="mean")
    axes.set(xlabel="shear angle of the frame [deg]", ylabel="shear angle, material less frame [deg]")
    axes.set_xlim(left=0.0)
    axes.legend(loc="best", frameon=False)
