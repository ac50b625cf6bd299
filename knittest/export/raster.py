"""Triangles on a pixel grid: the height of the surface that is nearest to the viewer, and how brightly it is lit."""

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array
from knittest.export.slant import lit
from knittest.export.tubes import View

_CHUNK_PIXELS = 400_000
#: twice the area of a triangle [pixel^2] below which it is seen edge on
_EDGE_ON = 1e-9
#: longest side [pixels] of a triangle that is drawn whole: few pixels around one this small are not its own
_WHOLE = 32.0


def nearest(corners: Array, view: View) -> tuple[Array, Array]:
    """Height [mm], -inf where there is nothing, and light (:func:`knittest.export.slant.lit`) of the triangles
    ``corners`` (n, 3, 3), in axes of ``view`` with z towards the viewer; (rows, columns) each, row 0 at the bottom.
    """
    rows, columns = view.shape
    corners = _cut(corners, _WHOLE * view.pixel)
    height, light = np.full(rows * columns, -np.inf), np.zeros(rows * columns)
    place = corners.copy()
    place[:, :, :2] = (corners[:, :, :2] - [view.left, view.bottom]) / view.pixel - 0.5  # centres of pixels are whole
    low = np.clip(np.floor(place[:, :, :2].min(axis=1)), 0, [columns, rows]).astype(int)
    size = np.clip(np.ceil(place[:, :, :2].max(axis=1)) + 1, 0, [columns, rows]).astype(int) - low
    shade = lit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    order = 2 ** np.ceil(np.log2(np.maximum(size.max(axis=1), 1))).astype(int)
    for patch in np.unique(order[(size > 0).all(axis=1)]):
        alike = np.flatnonzero((order == patch) & (size > 0).all(axis=1))
        step = max(1, _CHUNK_PIXELS // int(patch) ** 2)
        for first in range(0, len(alike), step):
            part = alike[first : first + step]
            pixel, surface, which = _covered(place[part], low[part], int(patch), (rows, columns))
            np.maximum.at(height, pixel, surface)
            top = surface >= height[pixel]
            light[pixel[top]] = shade[part[which[top]]]
    return height.reshape(rows, columns), light.reshape(rows, columns)


def _cut(corners: Array, most: float) -> Array:
    """Triangles (m, 3, 3) that ``corners`` (n, 3, 3) consist of, halved across their longest side until that is
    ``most`` [mm] at most, as it is seen.
    """
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


def _covered(
    place: Array, low: NDArray[np.int64], patch: int, shape: tuple[int, int]
) -> tuple[NDArray[np.int64], Array, NDArray[np.int64]]:
    """Pixels that triangles ``place`` (n, 3, 3) cover in a ``patch`` from ``low`` (n, 2) on, the height of each, and
    the number of its triangle.
    """
    column = low[:, 0, None, None] + np.arange(patch)[None, None, :]
    row = low[:, 1, None, None] + np.arange(patch)[None, :, None]
    a, b = ((place[:, k] - place[:, 0]).T[:, :, None, None] for k in (1, 2))
    x, y = column - place[:, 0, 0, None, None], row - place[:, 0, 1, None, None]
    area = a[0] * b[1] - a[1] * b[0]
    area = np.where(np.abs(area) > _EDGE_ON, area, np.nan)
    u, v = (x * b[1] - y * b[0]) / area, (a[0] * y - a[1] * x) / area
    inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (column < shape[1]) & (row < shape[0])
    surface = place[:, 0, 2, None, None] + u * a[2] + v * b[2]
    return (row * shape[1] + column)[inside], surface[inside], np.nonzero(inside)[0]
