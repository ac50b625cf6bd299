"""fabric.png: some cells of the relaxed fabric as shaded yarns, from the face, from the back and obliquely."""

from pathlib import Path

import numpy as np

from knittest.base.figure import new_figure, save
from knittest.base.history import Array
from knittest.export.tubes import View, render_tubes
from knittest.fabric.cell import Cell
from knittest.fabric.strip import YarnPath, centre_lines

_PIXEL = 0.02  # mm
_CELLS = 4
_FINER = 6  # the facets of an inclined yarn stay below a pixel
_MARGIN = 3  # cells around those shown, so that no yarn ends in the picture
_COLOUR = {"warp": (0.27, 0.27, 0.33), "weft": (0.30, 0.46, 0.78)}
_COURSES = ((0.95, 0.85, 0.55), (0.90, 0.55, 0.35))  # neighbouring courses differ, so that the loops can be followed
#: name, turn about x and turn about y [rad]
_VIEWS = (("face", 0.0, 0.0), ("back", 0.0, np.pi), ("oblique", -0.9, 0.5))


def cell_picture(path: Path, cell: Cell, title: str) -> None:
    """Draw 4 x 4 cells to ``path`` (PNG), the wales upright. Raises :class:`ResourceError`."""
    count = _CELLS + 2 * _MARGIN
    start, end, radius, colour = _tubes(centre_lines(cell, count, count, _FINER), cell.spec.radius)
    middle = 0.5 * count * np.array([cell.spec.wale, cell.spec.course, 0.0])
    width, height = _CELLS * cell.spec.wale, _CELLS * cell.spec.course
    view = View(-0.5 * width, 0.5 * width, -0.5 * height, 0.5 * height, _PIXEL)
    figure = new_figure(15.0, 0.9 + 4.8 * height / width)
    figure.suptitle(f"{title}: {width:.1f} x {height:.1f} mm, thickness {cell.thickness:.2f} mm")
    for axes, (name, about_x, about_y) in zip(figure.subplots(1, 3), _VIEWS, strict=True):
        turn = _turn(about_x, about_y)
        axes.imshow(
            render_tubes((start - middle) @ turn.T, (end - middle) @ turn.T, radius, colour, view),
            origin="lower",
            extent=view.extent,
        )
        axes.set_title(name)
        axes.set_axis_off()
    figure.tight_layout()
    save(figure, path)


def _tubes(paths: list[YarnPath], radius: dict[str, float]) -> tuple[Array, Array, Array, Array]:
    """Start and end (n, 3) [mm], radius (n,) [mm] and colour (n, 3) of all segments of the yarns."""
    pieces = [len(p.points) - 1 for p in paths]
    colours = [_COLOUR.get(p.system, _COURSES[p.index % 2]) for p in paths]
    return (
        np.vstack([p.points[:-1] for p in paths]),
        np.vstack([p.points[1:] for p in paths]),
        np.repeat([radius[p.system] for p in paths], pieces),
        np.repeat(np.array(colours), pieces, axis=0),
    )


def _turn(about_x: float, about_y: float) -> Array:
    """Matrix (3, 3) that turns the fabric about y, then about x."""
    cx, sx, cy, sy = np.cos(about_x), np.sin(about_x), np.cos(about_y), np.sin(about_y)
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    return np.asarray(tilt @ np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]]))
