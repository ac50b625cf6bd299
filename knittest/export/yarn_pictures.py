"""Pictures of yarns as shaded tubes: deformed.png, both faces coloured by force, and the relaxed fabric."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import current_printing, new_figure, save
from knittest.base.history import Array, Frame, History, Mesh
from knittest.config.fabric import Direction
from knittest.config.structure import KNIT, direction_of
from knittest.export.shading import View, render_tubes
from knittest.fabric.cell import Cell
from knittest.fabric.strip import YarnPath, centre_lines

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure


#: ends of a colour bar beyond which values lie
Cut = Literal["neither", "both", "min", "max"]
_COLOURS = ("#7b828a", "#f4cf6a", "#f08c3a", "#d3322f", "#7c0f36")
_GROUND = "#ffffff"
_MARK = "#0050d0"
_KNIT = np.array([0.74, 0.80, 0.87])
_NEGLIGIBLE = 0.02  # of the colour scale: below it the knitting yarn stays pale
_ORDER = ("left strip", "right strip")
_ZOOM_MM = 20.0
_STRIP_PIXELS = 1_000_000
_FINEST_PIXEL = 0.03  # mm
_ZOOM_PIXELS = 800
_SMALLEST_WINDOW = 2.2  # inch


@dataclass(frozen=True)
class Scale:
    """Colour of a force: ``cmap`` of ``norm``, which ends at ``largest`` [N] or [N/mm]."""

    cmap: "Colormap"
    norm: "Normalize"
    label: str
    largest: float

    def rgb(self, force: Array) -> Array:
        """Colours (n, 3), 0 to 1, of forces (n,)."""
        return self.cmap(self.norm(force))[:, :3]


def strip_picture(path: Path, history: History, *, direction: Direction, title: str) -> None:
    """Draw the frame of the largest force and the last one, side by side and to scale, to ``path`` (PNG).

    Beam elements are tubes of their diameter, with two windows of 20 x 20 mm at the fracture, shell elements are quads;
    failed ones are not drawn. ``direction`` is that of the load. Raises :class:`ResourceError`.
    """
    from matplotlib.patches import Rectangle

    before = history.peak_frame
    frames = (before, history.frames[-1])
    start = history.frames[0].position
    along = _pulled_axis(start, before.position)
    positions = [_turn_upright(frame.position, start, along) for frame in frames]
    force = "axial_force" if history.mesh.kind == "beams" else f"force_{direction}"
    scale = _force_scale(force, before)
    box = _fit_window(*positions)
    zooms = history.mesh.kind == "beams"
    figure, strips, windows = _layout(box, zooms)
    for number, (axes, frame, position) in enumerate(zip(strips, frames, positions, strict=True)):
        colour = _colour_elements(history.mesh, frame.fields[force], scale)
        _draw_elements(axes, history.mesh, frame, position, colour, box)
        axes.set_title(_caption(frame, float(history.curve["force_n"].max()), broken=number == 1), fontsize=9.5)
        axes.set_xlabel("across [mm]", fontsize=9)
        if zooms:
            view = _zoom_window(_find_fracture(history.mesh, frames[1], position), box)
            window, corner = windows[number], (view.left, view.bottom)
            _draw_elements(window, history.mesh, frame, position, colour, view)
            axes.add_patch(Rectangle(corner, _ZOOM_MM, _ZOOM_MM, facecolor="none", edgecolor=_MARK, linewidth=1.6))
            window.set_title(f"detail of the {_ORDER[number]}, {_ZOOM_MM:g} x {_ZOOM_MM:g} mm", fontsize=9.5)
            window.yaxis.tick_right()
            # a cross on each break of an inlay: a gap of a millimetre is hard to find in a whole strip
            middle = position[history.mesh.cells[_broken_inlays(history.mesh, frame)]].mean(axis=1)
            axes.plot(middle[:, 0], middle[:, 1], "x", color=_MARK, markersize=4.5, markeredgewidth=1.3)
    strips[0].set_ylabel(f"along the {direction} [mm]", fontsize=9)
    cut = _colourbar_ends(scale, [frame.fields[force][frame.fields["alive"] > 0] for frame in frames])
    _finish(figure, path, title, scale, cut)


def _pulled_axis(start: Array, pulled: Array) -> int:
    """Axis of the plane along which one end of the strip moved away from the other."""
    stretch = []
    for axis in (0, 1):
        at, moved = start[:, axis], pulled[:, axis] - start[:, axis]
        stretch.append(moved[at == at.max()].mean() - moved[at == at.min()].mean())
    return int(np.argmax(stretch))


def _turn_upright(position: Array, reference: Array, along: int) -> Array:
    """Turn the strip so that the load points upwards, seen from the technical face (+z), first corner at (0, 0)."""
    low, high = reference.min(axis=0), reference.max(axis=0)
    if along == 0:
        return np.stack([high[1] - position[:, 1], position[:, 0] - low[0], position[:, 2]], axis=1)
    return position - [low[0], low[1], 0.0]


def _force_scale(force: str, before: Frame) -> Scale:
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    alive = before.fields["alive"] > 0
    largest = float(np.nanmax(np.abs(before.fields[force][alive]), initial=0.0)) or 1.0
    label = "fibre force per width [N/mm]"
    if force == "axial_force":
        pale = f"pale: loops below {100.0 * _NEGLIGIBLE:g} % of the scale"
        label = f"axial force of the yarn [N] ({pale}; crosses: broken inlays)"
    colours = LinearSegmentedColormap.from_list("load", _COLOURS)
    return Scale(colours, Normalize(0.0, largest, clip=True), label, largest)


def _fit_window(before: Array, broken: Array) -> View:
    """Window around both states; pieces beyond the margin are cut off."""
    low, high = before[:, :2].min(axis=0), before[:, :2].max(axis=0)
    margin = 0.1 * (high - low).min()
    low = np.maximum(np.fmin(low, broken[:, :2].min(axis=0)), low - margin) - 1.5
    high = np.minimum(np.fmax(high, broken[:, :2].max(axis=0)), high + margin) + 1.5
    return _view(low, high, _STRIP_PIXELS, _FINEST_PIXEL)


def _view(low: Array, high: Array, pixels: float, finest: float) -> View:
    """View from ``low`` to ``high`` (2,) [mm] of at most ``pixels``, none smaller than ``finest`` [mm]."""
    size = float(np.sqrt((high - low).prod() / (pixels * current_printing().pixels)))
    return View(low[0], high[0], low[1], high[1], max(size, finest / current_printing().pixels ** 0.5))


def _layout(box: View, zooms: bool) -> tuple["Figure", list["Axes"], list["Axes"]]:
    """Axes with true aspect [inch]: two strips, and two square windows."""
    aspect = (box.right - box.left) / (box.top - box.bottom)
    tall = min(9.0, 5.0 / aspect)
    wide, side = tall * aspect, max((tall - 0.8) / 2, _SMALLEST_WINDOW)
    high = max(tall, 2 * side + 0.8) if zooms else tall
    left, gap, bottom = 0.75, 0.3, 1.15
    width = left + 2 * wide + gap + (gap + side + 0.55 if zooms else 0.55)
    figure = new_figure(max(width, 5.2), bottom + high + 0.95)
    total_w, total_h = figure.get_size_inches()

    def axes_at(x: float, y: float, w: float, h: float) -> "Axes":
        return figure.add_axes((x / total_w, y / total_h, w / total_w, h / total_h))

    strips = [axes_at(left + k * (wide + gap), bottom + high - tall, wide, tall) for k in (0, 1)]
    strips[1].tick_params(labelleft=False)
    right = left + 2 * (wide + gap)
    windows = [axes_at(right, bottom + (high - side) * (1 - k), side, side) for k in (0, 1)] if zooms else []
    return figure, strips, windows


def _colour_elements(mesh: Mesh, force: Array, scale: Scale) -> Array:
    """Colour of each element, (n_el, 3); a knitting yarn with negligible load is pale."""
    colour = scale.rgb(force)
    if KNIT in mesh.part_names:
        slack = (mesh.part == mesh.part_names.index(KNIT)) & (np.abs(force) < _NEGLIGIBLE * scale.largest)
        colour[slack] = _KNIT
    return colour


def _draw_elements(axes: "Axes", mesh: Mesh, frame: Frame, position: Array, colour: Array, view: View) -> None:
    alive = (frame.fields["alive"] > 0) & np.isfinite(position[mesh.cells]).all(axis=(1, 2))
    axes.set_facecolor(_GROUND)
    if mesh.kind == "beams":
        ends = position[mesh.cells[alive]]
        image = render_tubes(ends[:, 0], ends[:, 1], mesh.radius[alive], colour[alive], view)
        axes.imshow(image, origin="lower", extent=view.extent, interpolation="antialiased")
    else:
        from matplotlib.collections import PolyCollection

        quads = position[mesh.cells[alive]][:, :, :2]
        axes.add_collection(PolyCollection(list(quads), facecolors=colour[alive], edgecolors="#33383d", linewidths=0.3))
    axes.set(xlim=(view.left, view.right), ylim=(view.bottom, view.top))
    axes.tick_params(labelsize=8)


def _broken_inlays(mesh: Mesh, frame: Frame) -> NDArray[np.bool_]:
    """Failed elements of warp and weft, (n_el,)."""
    dead = frame.fields["alive"] <= 0
    return dead & (mesh.part != mesh.part_names.index(KNIT)) if KNIT in mesh.part_names else dead


def _find_fracture(mesh: Mesh, broken: Frame, position: Array) -> Array:
    """Position of the fracture, (2,) [mm]: the failed inlay element with most others near it, nearest to the centre."""
    centre = (position[:, :2].min(axis=0) + position[:, :2].max(axis=0)) / 2
    middle = position[mesh.cells[_broken_inlays(mesh, broken)]].mean(axis=1)[:, :2]
    if not len(middle):
        return centre
    near = (np.abs(middle[:, None, :] - middle[None, :, :]).max(axis=2) < _ZOOM_MM / 2).sum(axis=1)
    best = middle[near == near.max()]
    return best[np.argmin(np.hypot(*(best - centre).T))]


def _zoom_window(centre: Array, box: View) -> View:
    """A square of 20 mm around ``centre``, moved inside the picture of the strip where it fits."""
    half = _ZOOM_MM / 2
    low, high = np.array([box.left, box.bottom]) + half, np.array([box.right, box.top]) - half
    x, y = np.where(low < high, np.clip(centre, low, np.maximum(low, high)), (low + high) / 2)
    return View(x - half, x + half, y - half, y + half, _ZOOM_MM / (_ZOOM_PIXELS * current_printing().pixels ** 0.5))


def _colourbar_ends(scale: Scale, forces: Sequence[Array]) -> Cut:
    """Ends of the colour bar beyond which forces lie: a compressed yarn, or one that took over load."""
    found = np.concatenate(forces)
    low = bool(found.size and np.nanmin(found) < -_NEGLIGIBLE * scale.largest)
    high = bool(found.size and np.nanmax(found) > (1.0 + 1e-6) * scale.largest)
    return "both" if low and high else "min" if low else "max" if high else "neither"


def _finish(figure: "Figure", path: Path, title: str, scale: Scale, cut: Cut) -> None:
    from matplotlib.cm import ScalarMappable

    total_w, total_h = figure.get_size_inches()
    axes = figure.add_axes((0.75 / total_w, 0.45 / total_h, 1 - 1.3 / total_w, 0.13 / total_h))
    bar = figure.colorbar(ScalarMappable(scale.norm, scale.cmap), cax=axes, orientation="horizontal", extend=cut)
    bar.set_label(scale.label, fontsize=9)
    bar.ax.tick_params(labelsize=8)
    figure.text(0.02, 0.975, title, fontsize=12, va="top")
    save(figure, path)


def _caption(frame: Frame, peak: float, *, broken: bool) -> str:
    failed = int(np.count_nonzero(frame.fields["alive"] <= 0))
    share = 100.0 * frame.force / peak
    largest = "at the largest force" if share > 99.95 else f"at {share:.1f} % of the largest force"
    state = ("broken" if failed else "end, unbroken") if broken else largest
    return f"{state}\n{frame.coordinate:.2f} %, {frame.force:.0f} N, {failed} failed element{'s' * (failed != 1)}"


_PIXELS = 900_000
_FINEST_FACE_PIXEL = 0.012  # mm
#: margin around the yarns over the extent, 1.5 mm at most
_FREE = 0.06
#: labels of x and y: of a piece along its yarns, and of one loaded along y
PLAN = ("x, along the weft [mm]", "y, along the warp [mm]")
PULLED = ("across the load direction [mm]", "along the load direction [mm]")
#: share of the beams whose force the colours hold [%]
_SHOWN = 98.0


def faces_picture(
    path: Path, mesh: Mesh, frame: Frame, *, title: str, note: str, axes_labels: tuple[str, str] = PLAN
) -> None:
    """Draw the beams of ``frame`` from above and from below, to ``path`` (PNG); x and y have ``axes_labels``.

    Colours span the forces of 98 % of the beams. Raises :class:`ResourceError`.
    """
    from matplotlib import colormaps
    from matplotlib.colors import Normalize

    force = frame.fields["axial_force"]
    largest = max(float(np.percentile(np.abs(force), _SHOWN)), 1e-6)
    norm, cmap = Normalize(-largest, largest, clip=True), colormaps["coolwarm"]
    colour = cmap(norm(force))[:, :3]
    shown = frame.position[np.unique(mesh.cells), :2]  # images of a periodic cell are not
    free = min(_FREE * float(np.ptp(shown, axis=0).max()), 1.5) + float(mesh.radius.max())
    front = _view(shown.min(axis=0) - free, shown.max(axis=0) + free, _PIXELS, _FINEST_FACE_PIXEL)
    size = np.array([front.right - front.left, front.top - front.bottom])
    tall = min(8.0, 12.0 / (2.0 * size[0] / size[1]))
    wide = tall * size[0] / size[1]
    figure = new_figure(2.0 * wide + 1.9, tall + 1.9)
    total = figure.get_size_inches()
    for k, (name, turn) in enumerate((("technical face", 1.0), ("back", -1.0))):
        left = (0.75 + k * (wide + 0.35)) / total[0]
        axes = figure.add_axes((left, 1.1 / total[1], wide / total[0], tall / total[1]))
        view = front if turn > 0.0 else View(-front.right, -front.left, front.bottom, front.top, front.pixel)
        ends = (frame.position * [turn, 1.0, turn])[mesh.cells]
        image = render_tubes(ends[:, 0], ends[:, 1], mesh.radius, colour, view)
        axes.set_facecolor(_GROUND)
        axes.imshow(image, origin="lower", extent=view.extent, interpolation="antialiased")
        axes.set_title(f"{name}, {note}", fontsize=9.5)
        axes.set_xlabel(axes_labels[0], fontsize=9)
        axes.tick_params(labelsize=8, labelleft=k == 0)
    figure.axes[0].set_ylabel(axes_labels[1], fontsize=9)
    label = f"axial force of the yarn [N], scale covers {_SHOWN:g} % of the beams"
    cut: Cut = "both" if np.abs(force).max() > largest else "neither"
    _finish(figure, path, title, Scale(cmap, norm, label, largest), cut)


_PIXEL = 0.02  # mm
_CELLS = 4
_FINER = 6  # the facets of an inclined yarn stay below a pixel
_MARGIN = 3  # cells around those shown, so that no yarn ends in the picture
#: colours of the layers of inlays of each direction, from back to face
_LAYER_COLOURS = {
    "warp": ((0.27, 0.27, 0.33), (0.45, 0.33, 0.50)),
    "weft": ((0.30, 0.46, 0.78), (0.25, 0.60, 0.55)),
}
_COURSES = ((0.95, 0.85, 0.55), (0.90, 0.55, 0.35))  # neighbouring courses differ, so that the loops can be followed
#: name, turn about x and turn about y [rad]
_VIEWS = (("face", 0.0, 0.0), ("back", 0.0, np.pi), ("oblique", -0.9, 0.5))
#: name, rows to the right, up and to the viewer, place of the plane before the middle [pitches], axis to the right
_SECTIONS = (
    ("section across the wales, face up", ((1, 0, 0), (0, 0, 1), (0, -1, 0)), (0.0, -0.5, 0.0), 0),
    ("section across the courses, face up", ((0, 1, 0), (0, 0, 1), (1, 0, 0)), (0.0, 0.0, 0.0), 1),
)
#: start and end (n, 3) [mm], radius (n,) [mm] and colour (n, 3) of pieces of yarns
_Segments = tuple[Array, Array, Array, Array]


def cell_picture(path: Path, cell: Cell, title: str) -> None:
    """Draw 4 x 4 cells from three sides, the wales upright, and two sections to ``path`` (PNG).

    Raises :class:`ResourceError`.
    """
    count = _CELLS + 2 * _MARGIN
    yarns = _yarn_segments(centre_lines(cell, count, count, _FINER), cell.spec.radius)
    pitch = np.array([cell.spec.wale, cell.spec.course, 0.0])
    width, height = _CELLS * pitch[:2]
    thick = (1.0 + _FREE) * cell.thickness
    figure = new_figure(15.0, 1.5 + 4.8 * height / width + 7.2 * thick / min(width, height))
    figure.suptitle(f"{title}: {width:.1f} x {height:.1f} mm, thickness {cell.thickness:.2f} mm")
    grid = figure.add_gridspec(2, 1, height_ratios=(4.8 * height / width, 7.2 * thick / min(width, height)))
    upper, lower = grid[0].subgridspec(1, len(_VIEWS)), grid[1].subgridspec(1, len(_SECTIONS))
    for k, (name, about_x, about_y) in enumerate(_VIEWS):
        view = View(-0.5 * width, 0.5 * width, -0.5 * height, 0.5 * height, _PIXEL)
        _draw_yarns(
            figure.add_subplot(upper[k]), name, yarns, _turn_matrix(about_x, about_y), 0.5 * count * pitch, view
        )
    middle = 0.5 * sum(cell.faces)
    for k, (name, turn, forward, along) in enumerate(_SECTIONS):
        wide, depth = _CELLS * pitch[along], float(cell.spec.size[1 - along])
        view = View(-0.5 * wide, 0.5 * wide, middle - 0.5 * thick, middle + 0.5 * thick, _PIXEL)
        centre = (0.5 * count + np.array(forward)) * pitch
        _draw_yarns(figure.add_subplot(lower[k]), name, yarns, np.array(turn), centre, view, depth)
    figure.tight_layout()
    save(figure, path)


def _draw_yarns(
    axes: "Axes", name: str, yarns: _Segments, turn: Array, centre: Array, view: View, depth: float = np.inf
) -> None:
    """Draw yarns about ``centre`` (3,) [mm], turned by ``turn`` (3, 3); with a ``depth`` [mm] those up to there."""
    start, end, radius, colour = yarns
    start, end = (start - centre) @ turn.T, (end - centre) @ turn.T
    height = 0.5 * (start + end)[:, 2]
    seen = (height > -depth) & ((height <= 0.0) | np.isinf(depth))
    axes.imshow(
        render_tubes(start[seen], end[seen], radius[seen], colour[seen], view), origin="lower", extent=view.extent
    )
    axes.set_title(name)
    axes.set_axis_off()


def _yarn_segments(paths: list[YarnPath], radius: dict[str, float]) -> _Segments:
    """All segments of the yarns."""
    pieces = [len(p.points) - 1 for p in paths]
    colours = [_colour(p) for p in paths]
    return (
        np.vstack([p.points[:-1] for p in paths]),
        np.vstack([p.points[1:] for p in paths]),
        np.repeat([radius[p.system] for p in paths], pieces),
        np.repeat(np.array(colours), pieces, axis=0),
    )


def _colour(path: YarnPath) -> tuple[float, float, float]:
    """Colour of a yarn: loops by their course, inlays by direction and layer."""
    if path.system == KNIT:
        return _COURSES[path.index % 2]
    direction = direction_of(path.system)
    layers = _LAYER_COLOURS[direction]
    return layers[(int(path.system[len(direction) :] or 1) - 1) % len(layers)]


def _turn_matrix(about_x: float, about_y: float) -> Array:
    """Matrix (3, 3) that turns the fabric about y, then about x."""
    cx, sx, cy, sy = np.cos(about_x), np.sin(about_x), np.cos(about_y), np.sin(about_y)
    tilt = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    return np.asarray(tilt @ np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]]))
