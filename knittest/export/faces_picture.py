"""Yarns as tubes from the technical face and from the back, coloured by axial force."""

from pathlib import Path

import numpy as np

from knittest.base.figure import new_figure, save
from knittest.base.history import Array, Frame, Mesh
from knittest.base.printing import present
from knittest.export.tubes import View, render_tubes

_GROUND = "#23282e"
_PIXELS = 900_000
_FINEST_PIXEL = 0.012  # mm
#: share of the extent that is free around the yarns, 1.5 mm at most
_FREE = 0.06
#: what stands at x and y: of a piece that lies along its yarns, and of one that is pulled along y
PLAN = ("x, along the weft [mm]", "y, along the warp [mm]")
PULLED = ("across the pull [mm]", "along the pull [mm]")
#: share of the beams whose force the colours hold [%]
_SHOWN = 98.0


def faces_picture(
    path: Path, mesh: Mesh, frame: Frame, *, title: str, note: str, axes_labels: tuple[str, str] = PLAN
) -> None:
    """Draw the beams of ``frame`` from above and, turned about the vertical, from below, to ``path`` (PNG); x and y
    have ``axes_labels``.

    Colours end at the force that 98 % of the beams stay below. Raises :class:`ResourceError`.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    force = frame.fields["axial_force"]
    largest = max(float(np.percentile(np.abs(force), _SHOWN)), 1e-6)
    norm, cmap = Normalize(-largest, largest, clip=True), colormaps["coolwarm"]
    colour = cmap(norm(force))[:, :3]
    shown = frame.position[np.unique(mesh.cells)]  # images of a periodic cell are not
    front = _view(shown, float(mesh.radius.max()))
    size = np.array([front.right - front.left, front.top - front.bottom])
    tall = min(8.0, 12.0 / (2.0 * size[0] / size[1]))
    wide = tall * size[0] / size[1]
    figure = new_figure(2.0 * wide + 1.9, tall + 1.9)
    total = figure.get_size_inches()
    for k, (name, turn) in enumerate((("technical face", 1.0), ("back", -1.0))):
        axes = figure.add_axes(
            ((0.75 + k * (wide + 0.35)) / total[0], 1.1 / total[1], wide / total[0], tall / total[1])
        )
        view = front if turn > 0.0 else View(-front.right, -front.left, front.bottom, front.top, front.pixel)
        ends = (frame.position * [turn, 1.0, turn])[mesh.cells]
        image = render_tubes(ends[:, 0], ends[:, 1], mesh.radius, colour, view)
        axes.set_facecolor(_GROUND)
        axes.imshow(image, origin="lower", extent=view.extent, interpolation="antialiased")
        axes.set_title(f"{name}, {note}", fontsize=9.5)
        axes.set_xlabel(axes_labels[0], fontsize=9)
        axes.tick_params(labelsize=8, labelleft=k == 0)
    figure.axes[0].set_ylabel(axes_labels[1], fontsize=9)
    bar = figure.add_axes((0.75 / total[0], 0.5 / total[1], 1.0 - 1.5 / total[0], 0.13 / total[1]))
    cut = "both" if np.abs(force).max() > largest else "neither"
    figure.colorbar(ScalarMappable(norm, cmap), cax=bar, orientation="horizontal", extend=cut).set_label(
        f"axial force of the yarn [N], {_SHOWN:g} % of the beams within", fontsize=9
    )
    figure.text(0.02, 0.975, title, fontsize=12, va="top")
    save(figure, path)


def _view(position: Array, radius: float) -> View:
    free = min(_FREE * float(np.ptp(position[:, :2], axis=0).max()), 1.5) + radius
    low, high = position[:, :2].min(axis=0) - free, position[:, :2].max(axis=0) + free
    pixel = max(
        float(np.sqrt((high - low).prod() / (_PIXELS * present().pixels))), _FINEST_PIXEL / present().pixels ** 0.5
    )
    return View(low[0], high[0], low[1], high[1], pixel)
