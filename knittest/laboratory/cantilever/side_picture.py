"""Side view of a bent strip: the board it lies on, the plane that it meets, and the chord."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import BLUE, GREY, ORANGE, dress, new_figure, save
from knittest.base.history import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: length and depth of the board over the overhang, and what is free around all
BOARD, DEEP, FREE = 0.3, 0.1, 0.05
WOOD, EDGE, SLOPE = "#d9c7ac", "#7a664a", "#f4eee3"
#: width of the picture, and what lies around its plane [inch]
WIDE, LEFT, RIGHT, TOP, BOTTOM = 7.6, 0.75, 0.25, 0.75, 0.6
#: line of an element of a yarn, and the least one of a sheet [points]
THREAD, SHEET = 0.8, 1.5


def side_picture(
    path: Path,
    along: Array,
    height: Array,
    segments: NDArray[np.int64],
    *,
    overhang: float,
    angle: float,
    plane: float,
    thickness: float,
    yarns: bool,
    title: str,
) -> None:
    """Elements seen from the side: ``along``, ``height`` (n_nodes,) [mm] from the edge, ``segments`` (n, 2)
    node numbers, of a sheet or of ``yarns``; ``thickness`` [mm] of the strip.

    ``plane`` is the angle [deg] of the plane through the edge, ``angle`` the chord's. Raises :class:`ResourceError`.
    """
    from matplotlib.collections import LineCollection

    reach, margin = float(along.max()), FREE * overhang
    drop = np.tan(np.deg2rad(plane)) * reach
    left, right = -BOARD * overhang - margin, reach + margin
    low, high = min(-drop, float(height.min())) - margin, 3.0 * margin
    scale = (WIDE - LEFT - RIGHT) / (right - left)
    tall = scale * (high - low)
    figure = new_figure(WIDE, tall + TOP + BOTTOM)
    whole = tall + TOP + BOTTOM
    axes = figure.add_axes((LEFT / WIDE, BOTTOM / whole, 1.0 - (LEFT + RIGHT) / WIDE, tall / whole))
    dress(axes)
    _board(axes, overhang, reach, drop, thickness)
    axes.plot([0.0, reach], [0.0, -drop], "--", color=ORANGE, linewidth=1.8, label=f"plane at {plane:g} deg")
    axes.plot(
        [0.0, reach], [0.0, -reach * np.tan(np.deg2rad(angle))], ":", color=GREY, linewidth=1.6,
        label=f"chord at {angle:.2f} deg",
    )  # fmt: skip
    width = THREAD if yarns else max(72.0 * scale * thickness, SHEET)
    points = np.stack([along, height], axis=1)
    drawn = LineCollection(list(points[segments]), colors=BLUE, linewidths=width, capstyle="butt", label="strip")
    axes.add_collection(drawn)
    arrow = {"arrowstyle": "<->", "color": GREY, "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (0.0, 1.6 * margin), (reach, 1.6 * margin), arrowprops=arrow)
    axes.text(0.5 * reach, 1.75 * margin, f"overhang {overhang:.1f} mm along the strip", ha="center", fontsize=9)
    axes.set(xlim=(left, right), ylim=(low, high), xlabel="from the edge [mm]", ylabel="height [mm]")
    axes.set_title(f"{title}\nchord angle {angle:.2f} deg", loc="left", fontsize=11)
    axes.legend(loc="lower left", bbox_to_anchor=(0.05, 0.06), frameon=False, fontsize=9)
    save(figure, path)


def _board(axes: "Axes", overhang: float, reach: float, drop: float, thickness: float) -> None:
    """The board under the strip up to its edge, the slope below it, and the part of the strip that lies there."""
    from matplotlib.patches import Polygon, Rectangle

    half = 0.5 * thickness
    back, deep = -BOARD * overhang, DEEP * overhang
    slope = [[0.0, -half], [reach, -half - drop], [back, -half - drop], [back, -half]]
    axes.add_patch(Polygon(slope, facecolor=SLOPE, edgecolor="none", zorder=0.4))
    board = Rectangle((back, -half - deep), -back, deep, facecolor=WOOD, edgecolor=EDGE, zorder=0.6, label="board")
    axes.add_patch(board)
    lying = Rectangle((back, -half), -back, thickness, facecolor=BLUE, alpha=0.35, edgecolor="none", zorder=0.7)
    lying.set_label("strip on the board")
    axes.add_patch(lying)
