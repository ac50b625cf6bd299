"""A formed blank seen from above at a slant."""

from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.figure import new_figure, save
from knittest.base.history import Array, Frame, Mesh
from knittest.base.printing import present
from knittest.export.slant import shaded, sight
from knittest.export.tubes import View, render_tubes

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
    seen = frame.position @ sight().T
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


def _draw_shells(axes: Any, corners: Array, colour: Array) -> None:
    """Quadrilaterals (n, 4, 3) as they are seen."""
    from matplotlib.collections import PolyCollection

    places, shown = shaded(corners, colour)
    axes.add_collection(PolyCollection(list(places), facecolor=shown, edgecolor=shown, linewidth=0.2))
