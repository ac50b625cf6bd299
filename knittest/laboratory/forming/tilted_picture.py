"""A formed blank seen from above at a slant."""

from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.figure import new_figure, save
from knittest.base.history import Array, Frame, Mesh
from knittest.base.printing import present
from knittest.export.tubes import View, render_tubes

#: turn about the vertical and tilt of the line of sight against it [deg]
TURN, TILT = 30.0, 50.0
_LIGHT = np.array([-0.45, 0.45, 0.7714])
_PIXELS = 1_200_000


def tilted_picture(
    path: Path, mesh: Mesh, frame: Frame, value: Array, *, title: str, label: str, top: float, colours: str = "viridis"
) -> None:
    """Draw the elements of ``frame`` coloured by ``value`` (n_el,), from 0 to ``top``, to ``path`` (PNG).

    Raises :class:`ResourceError`.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    norm, cmap = Normalize(0.0, max(top, 1e-9), clip=True), colormaps[colours]
    colour = cmap(norm(value))[:, :3]
    seen = frame.position @ _sight().T
    low, high = seen[:, :2].min(axis=0) - 3.0, seen[:, :2].max(axis=0) + 3.0
    size = high - low
    figure = new_figure(9.0, 9.0 * 0.86 * size[1] / size[0] + 1.1)
    tall = figure.get_size_inches()[1]
    axes = figure.add_axes((0.02, 0.5 / tall, 0.86, 1.0 - 1.1 / tall))
    if mesh.kind == "beams":
        view = View(low[0], high[0], low[1], high[1], float(np.sqrt(size.prod() / (_PIXELS * present().pixels))))
        ends = seen[mesh.cells]
        image = render_tubes(ends[:, 0], ends[:, 1], mesh.radius, colour, view)
        axes.imshow(image, origin="lower", extent=view.extent, interpolation="antialiased")
    else:
        _draw_shells(axes, seen[mesh.cells], colour)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_aspect("equal")
    axes.set_axis_off()
    figure.text(0.02, 1.0 - 0.3 / tall, title, fontsize=12, va="center")
    bar = figure.add_axes((0.91, 0.25, 0.02, 0.5))
    cut = "max" if float(np.nanmax(value)) > max(top, 1e-9) else "neither"
    figure.colorbar(ScalarMappable(norm, cmap), cax=bar, extend=cut).set_label(label, fontsize=9)
    save(figure, path)


def _sight() -> Array:
    """Rows: right, up and towards the viewer."""
    turn, tilt = np.deg2rad(TURN), np.deg2rad(TILT)
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    ahead = np.array([-np.sin(turn), np.cos(turn), 0.0])
    up = np.cos(tilt) * ahead + np.sin(tilt) * np.array([0.0, 0.0, 1.0])
    return np.array([right, up, np.cross(right, up)])


def _draw_shells(axes: Any, corners: Array, colour: Array) -> None:
    """Quadrilaterals (n, 4, 3) from far to near, shaded by Lambert's law from both sides."""
    from matplotlib.collections import PolyCollection

    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    shade = 0.45 + 0.6 * np.abs(normal @ _LIGHT)
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    shown = np.clip(colour * shade[:, None], 0.0, 1.0)[order]
    axes.add_collection(PolyCollection(list(corners[order][:, :, :2]), facecolor=shown, edgecolor=shown, linewidth=0.2))
