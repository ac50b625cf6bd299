"""Yarns seen from above as shaded tubes: each beam a capsule on a pixel grid, the nearest surface wins."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array

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
    canvas = drawn_tubes(start, end, radius, colour, view)
    return canvas.image.reshape(canvas.rows, canvas.columns, 4)


def drawn_tubes(start: Array, end: Array, radius: Array, colour: Array, view: View) -> Canvas:
    """Canvas of :func:`render_tubes`, which has the height of what is seen too."""
    canvas = Canvas(view)
    inside = _touching(start, end, radius, view)
    start, end, radius, colour = start[inside], end[inside], radius[inside], colour[inside]
    if len(start):
        span = np.abs(end[:, :2] - start[:, :2]).max(axis=0) + 2 * radius.max()
        patch = np.ceil(span / view.pixel).astype(int) + 2
        chunk = max(1, int(_CHUNK_PIXELS // (patch[0] * patch[1])))
        for first in range(0, len(start), chunk):
            part = slice(first, first + chunk)
            _draw(canvas, start[part], end[part], radius[part], colour[part], patch)
    return canvas


def _touching(start: Array, end: Array, radius: Array, view: View) -> NDArray[np.bool_]:
    low = np.minimum(start, end)[:, :2] - radius[:, None]
    high = np.maximum(start, end)[:, :2] + radius[:, None]
    overlap_x = (high[:, 0] > view.left) & (low[:, 0] < view.right)
    overlap_y = (high[:, 1] > view.bottom) & (low[:, 1] < view.top)
    return overlap_x & overlap_y & np.isfinite(start + end).all(axis=1)


def _draw(canvas: Canvas, start: Array, end: Array, radius: Array, colour: Array, patch: NDArray[np.int64]) -> None:
    """Draw one chunk of beams; ``patch`` (columns, rows) of pixels covers the largest beam."""
    column, row = _patches(start, end, radius, canvas.view, patch)
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
    canvas.image[pixel[top], :3] = _lit(colour[beam[top]], normal)
    canvas.image[pixel[top], 3] = 1.0


def _patches(
    start: Array, end: Array, radius: Array, view: View, patch: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Columns (n, 1, patch[0]) and rows (n, patch[1], 1) of the pixels around each beam."""
    corner = np.minimum(start, end)[:, :2] - radius[:, None]
    first = np.floor((corner - [view.left, view.bottom]) / view.pixel).astype(int)
    column = first[:, 0, None, None] + np.arange(patch[0])[None, None, :]
    row = first[:, 1, None, None] + np.arange(patch[1])[None, :, None]
    return column, row


def _lit(colour: Array, normal: Array) -> Array:
    light = _AMBIENT + (1 - _AMBIENT) * np.clip(normal @ _LIGHT, 0.0, 1.0)
    return np.clip(colour * light[:, None] * _GAIN, 0.0, 1.0)
