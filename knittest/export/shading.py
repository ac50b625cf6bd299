"""Shaded yarns and surfaces on a pixel grid, along a line of sight: the surface nearest to the viewer wins."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array

Index = NDArray[np.int64]
# Direction to the light, from the upper left and towards the viewer; unit length.
_LIGHT = np.array([-0.45, 0.45, 0.7714])
_AMBIENT = 0.42
_GAIN = 1.12  # makes up for a light that never meets a flat top at a right angle
_CHUNK_PIXELS = 100_000  # the temporaries of a chunk stay in the cache


@dataclass(frozen=True)
class View:
    """A window of the plane: ``left``, ``right``, ``bottom``, ``top`` [mm] and the side of a pixel [mm]."""

    left: float
    right: float
    bottom: float
    top: float
    pixel: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the pixel grid; row 0 lies at the bottom."""
        rows = round((self.top - self.bottom) / self.pixel)
        columns = round((self.right - self.left) / self.pixel)
        return max(rows, 1), max(columns, 1)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom, top, as ``imshow`` takes it."""
        return self.left, self.right, self.bottom, self.top


class Canvas:
    """Pixels of a view: ``image`` RGBA (rows * columns, 4) and ``height`` [mm] of the surface each one shows."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.rows, self.columns = view.shape
        self.image = np.zeros((self.rows * self.columns, 4))
        self.height = np.full(self.rows * self.columns, -np.inf)


def render_tubes(start: Array, end: Array, radius: Array, colour: Array, view: View) -> Array:
    """Draw beams from ``start`` to ``end`` [mm], (n, 3), of ``radius`` [mm], (n,), and ``colour`` (n, 3), RGB 0 to 1.

    Returns RGBA (rows, columns, 4), transparent where no yarn lies. A pixel shows the capsule with the highest
    surface there, z = z_axis + sqrt(r^2 - d^2), shaded by Lambert's law.
    """
    canvas = tube_canvas(start, end, radius, colour, view)
    return canvas.image.reshape(canvas.rows, canvas.columns, 4)


def tube_canvas(start: Array, end: Array, radius: Array, colour: Array, view: View) -> Canvas:
    """Canvas of :func:`render_tubes`, which has the height of what is seen too."""
    canvas = Canvas(view)
    low, high = np.minimum(start, end)[:, :2] - radius[:, None], np.maximum(start, end)[:, :2] + radius[:, None]
    overlap = (high > [view.left, view.bottom]).all(axis=1) & (low < [view.right, view.top]).all(axis=1)
    inside = overlap & np.isfinite(start + end).all(axis=1)
    start, end, radius, colour = start[inside], end[inside], radius[inside], colour[inside]
    if len(start):
        span = np.abs(end[:, :2] - start[:, :2]).max(axis=0) + 2 * radius.max()
        patch = np.ceil(span / view.pixel).astype(int) + 2
        chunk = max(1, int(_CHUNK_PIXELS // (patch[0] * patch[1])))
        for first in range(0, len(start), chunk):
            part = slice(first, first + chunk)
            _draw_chunk(canvas, start[part], end[part], radius[part], colour[part], patch)
    return canvas


def _draw_chunk(canvas: Canvas, start: Array, end: Array, radius: Array, colour: Array, patch: Index) -> None:
    """Draw one chunk of beams; ``patch`` (columns, rows) of pixels covers the largest beam."""
    corner = np.minimum(start, end)[:, :2] - radius[:, None]
    first = np.floor((corner - [canvas.view.left, canvas.view.bottom]) / canvas.view.pixel).astype(int)
    column, row = _pixels(first, patch)
    dx = canvas.view.left + (column + 0.5) * canvas.view.pixel - start[:, 0, None, None]
    dy = canvas.view.bottom + (row + 0.5) * canvas.view.pixel - start[:, 1, None, None]
    along = (end - start)[:, :, None, None]
    length2 = np.maximum(along[:, 0] ** 2 + along[:, 1] ** 2, 1e-12)
    t = np.clip((dx * along[:, 0] + dy * along[:, 1]) / length2, 0.0, 1.0)
    off_x, off_y = dx - t * along[:, 0], dy - t * along[:, 1]
    rise2 = radius[:, None, None] ** 2 - off_x**2 - off_y**2
    on_grid = (column >= 0) & (column < canvas.columns) & (row >= 0) & (row < canvas.rows)
    seen = (rise2 > 0) & on_grid
    beam = np.nonzero(seen)[0]
    rise = np.sqrt(rise2[seen])
    surface = (start[:, 2, None, None] + t * along[:, 2])[seen] + rise
    pixel = (row * canvas.columns + column)[seen]
    np.maximum.at(canvas.height, pixel, surface)
    top = surface >= canvas.height[pixel]
    normal = np.stack([off_x[seen], off_y[seen], rise], axis=1)[top] / radius[beam[top], None]
    light = _AMBIENT + (1 - _AMBIENT) * np.clip(normal @ _LIGHT, 0.0, 1.0)
    canvas.image[pixel[top], :3] = np.clip(colour[beam[top]] * light[:, None] * _GAIN, 0.0, 1.0)
    canvas.image[pixel[top], 3] = 1.0


def _pixels(first: Index, patch: Sequence[int] | Index) -> tuple[Index, Index]:
    """Columns (n, 1, patch[0]) and rows (n, patch[1], 1) of patches of pixels from ``first`` (n, 2) on."""
    column = first[:, 0, None, None] + np.arange(patch[0])[None, None, :]
    return column, first[:, 1, None, None] + np.arange(patch[1])[None, :, None]


#: turn about the vertical and tilt of the line of sight against it [deg]
LOOKS = {"oblique": (30.0, 50.0), "top": (0.0, 0.0), "side": (0.0, 90.0)}


def view_axes(look: str = "oblique", *, turned: bool = False) -> Array:
    """Rows: right, up and towards the viewer, of one of :data:`LOOKS`; ``turned`` about the vertical by 90 deg more."""
    turn, tilt = np.deg2rad(LOOKS[look])
    turn += 0.5 * np.pi * turned
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    ahead = np.array([-np.sin(turn), np.cos(turn), 0.0])
    up = np.cos(tilt) * ahead + np.sin(tilt) * np.array([0.0, 0.0, 1.0])
    return np.array([right, up, np.cross(right, up)])


def shade_quads(corners: Array, colour: Array) -> tuple[Array, Array]:
    """Quadrilaterals (n, 4, 2) of ``corners`` (n, 4, 3), from far to near, and ``colour`` shaded by
    :func:`surface_light`.
    """
    shade = surface_light(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]))
    order = np.argsort(corners[:, :, 2].mean(axis=1))
    return corners[order][:, :, :2], np.clip(colour * shade[:, None], 0.0, 1.0)[order]


def surface_light(normal: Array) -> Array:
    """Light on surfaces with ``normal`` (n, 3) of any length, by Lambert's law from both sides; 0.45 edge on."""
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    return np.asarray(0.45 + 0.6 * np.abs(normal @ _LIGHT) / length)


_RASTER_PIXELS = 400_000
#: twice the area of a triangle [pixel^2] below which it is seen edge on
_EDGE_ON = 1e-9
#: longest side [pixels] of a triangle that is drawn whole: few pixels around one this small are not its own
_WHOLE = 32.0


def render_triangles(corners: Array, view: View) -> tuple[Array, Array]:
    """Height [mm], -inf where there is nothing, and light (:func:`surface_light`) of the triangles
    ``corners`` (n, 3, 3), in axes of ``view`` with z towards the viewer; (rows, columns) each, row 0 at the bottom.
    """
    rows, columns = view.shape
    corners = _halve_triangles(corners, _WHOLE * view.pixel)
    height, light = np.full(rows * columns, -np.inf), np.zeros(rows * columns)
    place = corners.copy()
    place[:, :, :2] = (corners[:, :, :2] - [view.left, view.bottom]) / view.pixel - 0.5  # centres of pixels are whole
    low = np.clip(np.floor(place[:, :, :2].min(axis=1)), 0, [columns, rows]).astype(int)
    size = np.clip(np.ceil(place[:, :, :2].max(axis=1)) + 1, 0, [columns, rows]).astype(int) - low
    shade = surface_light(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    order = 2 ** np.ceil(np.log2(np.maximum(size.max(axis=1), 1))).astype(int)
    for patch in np.unique(order[(size > 0).all(axis=1)]):
        alike = np.flatnonzero((order == patch) & (size > 0).all(axis=1))
        step = max(1, _RASTER_PIXELS // int(patch) ** 2)
        for first in range(0, len(alike), step):
            part = alike[first : first + step]
            pixel, surface, which = _covered_pixels(place[part], low[part], int(patch), (rows, columns))
            np.maximum.at(height, pixel, surface)
            top = surface >= height[pixel]
            light[pixel[top]] = shade[part[which[top]]]
    return height.reshape(rows, columns), light.reshape(rows, columns)


def _halve_triangles(corners: Array, most: float) -> Array:
    """Halve triangles ``corners`` (n, 3, 3) across their longest visible side until it is at most ``most`` [mm]."""
    done = []
    while len(corners):
        side = np.linalg.norm((np.roll(corners, -1, axis=1) - corners)[:, :, :2], axis=2)
        long = side.max(axis=1) > most
        done.append(corners[~long])
        first = side[long].argmax(axis=1)[:, None]
        a, b, c = (np.take_along_axis(corners[long], (first + k)[:, :, None] % 3, axis=1) for k in range(3))
        middle = 0.5 * (a + b)
        corners = np.concatenate([np.concatenate(half, axis=1) for half in ((a, middle, c), (middle, b, c))])
    return np.concatenate(done) if done else corners


def _covered_pixels(place: Array, low: Index, patch: int, shape: tuple[int, int]) -> tuple[Index, Array, Index]:
    """Pixels that triangles ``place`` (n, 3, 3) cover in a ``patch`` from ``low`` (n, 2) on, height and triangle."""
    column, row = _pixels(low, (patch, patch))
    a, b = ((place[:, k] - place[:, 0]).T[:, :, None, None] for k in (1, 2))
    x, y = column - place[:, 0, 0, None, None], row - place[:, 0, 1, None, None]
    area = a[0] * b[1] - a[1] * b[0]
    area = np.where(np.abs(area) > _EDGE_ON, area, np.nan)
    u, v = (x * b[1] - y * b[0]) / area, (a[0] * y - a[1] * x) / area
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (column < shape[1]) & (row < shape[0])
    surface = place[:, 0, 2, None, None] + u * a[2] + v * b[2]
    return (row * shape[1] + column)[inside], surface[inside], np.nonzero(inside)[0]
