"""Tools in the images of a film: translucent, behind the specimen or before it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Body
from knittest.export.raster import nearest
from knittest.export.tubes import View
from knittest.report_page.moving.recording import Array

#: colour of tools, share of what lies behind them that they hide, and of their edges
COLOUR, OPAQUE, EDGE = np.array([0.55, 0.6, 0.66]), 0.34, 0.7
#: step of the light from a pixel to the next one at which an edge is drawn
STEP = 0.06


class ToolLayers:
    """``bodies`` as seen along the rows ``sight`` (3, 3) on the pixels of ``view``, which has room for their ways.

    Each is drawn once and moved by whole pixels, unless it turns.
    """

    def __init__(self, bodies: Sequence[Body], sight: Array, view: View) -> None:
        self._sight, self._view = sight, view
        self._start = [body.offset[0] for body in bodies]
        self._layers = [_layer(body.place(0) @ sight.T, body.triangles, view) for body in bodies]

    @property
    def any(self) -> bool:
        """Tell whether there are tools."""
        return bool(self._layers)

    def around(self, height: Array, moved: Sequence[Body]) -> tuple[Array, Array]:
        """Images RGBA (rows, columns, 4) of what lies behind and before a specimen of ``height`` (rows, columns) [mm],
        tools as ``moved``, each at one moment; empty ones without tools.
        """
        if not self._layers:
            return np.zeros((0, 0, 4)), np.zeros((0, 0, 4))
        found = [self._moved(k, body) for k, body in enumerate(moved)]
        found.sort(key=lambda layer: float(layer[0].max()))
        behind = [(image, top <= height) for top, image in found]
        return _blended(behind), _blended([(image, ~under) for image, under in behind])

    def _moved(self, number: int, body: Body) -> tuple[Array, Array]:
        """Height and image of tool ``number`` at the moment of ``body``."""
        if body.turn is not None:
            return _layer(body.place(0) @ self._sight.T, body.triangles, self._view)
        height, image = self._layers[number]
        across, up, towards = self._sight @ (body.offset[0] - self._start[number])
        shift = (round(up / self._view.pixel), round(across / self._view.pixel))
        return np.roll(height, shift, (0, 1)) + towards, np.roll(image, shift, (0, 1))


def _layer(points: Array, triangles: NDArray[np.int64], view: View) -> tuple[Array, Array]:
    """Height (rows, columns) and image RGBA (rows, columns, 4) of a tool."""
    height, light = nearest(points[triangles], view)
    image = np.zeros((*height.shape, 4))
    image[..., :3] = np.clip(COLOUR * light[..., None], 0.0, 1.0)
    image[..., 3] = np.where(np.isfinite(height), np.where(_edges(light), EDGE, OPAQUE), 0.0)
    return height, image


def _edges(light: Array) -> NDArray[np.bool_]:
    """Pixels at which the light changes: outlines and creases of what is seen."""
    found = np.zeros(light.shape, bool)
    found[1:] |= np.abs(np.diff(light, axis=0)) > STEP
    found[:, 1:] |= np.abs(np.diff(light, axis=1)) > STEP
    return found


def _blended(layers: Sequence[tuple[Array, NDArray[np.bool_]]]) -> Array:
    """Images RGBA one over the other, each where its mask (rows, columns) is set."""
    result = np.zeros_like(layers[0][0])
    for image, shown in layers:
        alpha = image[..., 3:] * shown[..., None]
        beneath = result[..., 3:] * (1.0 - alpha)
        total = alpha + beneath
        mixed = (image[..., :3] * alpha + result[..., :3] * beneath) / np.maximum(total, 1e-12)
        result = np.concatenate([mixed, total], axis=2)
    return result
