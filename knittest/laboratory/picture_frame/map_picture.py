"""A value over the plane, with contours and a scale."""

from pathlib import Path

import numpy as np

from knittest.base.figure import GREY, new_figure, save
from knittest.base.history import Array


def height_picture(path: Path, x: Array, y: Array, height: Array, *, title: str, note: str) -> None:
    """Height map [mm] over x, y [mm], (n, m) each, nan outside; ``note`` stands below. Raises ResourceError."""
    figure = new_figure(7.0, 7.4)
    axes = figure.add_axes((0.1, 0.12, 0.72, 0.8))
    most = max(float(np.nanmax(np.abs(height))), 1e-6)
    levels = np.linspace(-most, most, 17)
    filled = axes.contourf(x, y, height, levels=levels, cmap="RdBu_r")
    axes.contour(x, y, height, levels=levels[::2], colors=GREY, linewidths=0.5)
    axes.set_aspect("equal")
    axes.set(xlabel="across the pull [mm]", ylabel="along the pull [mm]")
    figure.text(0.1, 0.95, title, fontsize=12)
    bar = figure.colorbar(filled, cax=figure.add_axes((0.85, 0.2, 0.03, 0.64)))
    bar.ax.yaxis.set_major_formatter("{x:.1f}")
    bar.set_label("height over the frame's plane [mm]", labelpad=8)
    figure.text(0.1, 0.03, note, fontsize=9, color=GREY)
    save(figure, path)
