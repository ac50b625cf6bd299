"""A value over the plane, with contours and a scale."""

from pathlib import Path

import numpy as np

from knittest.base.figure import GREY, new_figure, save
from knittest.base.history import Array
from knittest.laboratory.picture_frame.frame_drawing import FrameShape, draw_frame

#: lengths of the picture [inch]: the plane, and what lies around it
TALL, LEFT, RIGHT, TOP, BOTTOM = 5.9, 0.85, 1.3, 0.6, 1.0


def height_picture(path: Path, x: Array, y: Array, height: Array, *, title: str, note: str, shape: FrameShape) -> None:
    """Height map [mm] over x, y [mm], (n, m) each, nan outside, in the frame of ``shape``; ``note`` stands below.

    Raises :class:`ResourceError`.
    """
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
