"""Draws the images of a film: title, axes of one size, colours, tools, time."""

from dataclasses import replace
from textwrap import wrap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.figure import RED, new_figure
from knittest.export.shading import View, render_triangles, shade_quads, tube_canvas, view_axes
from knittest.report_page.loaded_run import LoadedRun
from knittest.report_page.moving.page import has_curve_time, notices
from knittest.report_page.moving.recording import Array, Recording, Scale, ToolLayers

Image = NDArray[np.uint8]

#: pixels per inch, for legible letters from 640 to 1920 pixels
DPI = 100
#: margin around the moving parts, as share of the extent
MARGIN = 0.02
#: line around shell elements that hides the seams [points]; from the side it shows their thickness
SEAM = 0.2
#: room for the colour bar and for the clock, width of a letter of a notice and height of its lines [inch]
BAR, CLOCK, LETTER, LINE = 1.15, 1.1, 0.062, 0.16
#: length over width above which a specimen is seen across its length
LENGTH_RATIO = 1.5
#: subdivision of the pixels of yarns, so that thin yarns stay smooth
TUBE_REFINEMENT = 2
#: triangles of a quadrilateral
HALVES = [[0, 1, 2], [0, 2, 3]]


class Stage:
    """Axes with room for the whole run as seen from ``look``, ``width`` pixels wide, with ``tools`` or without."""

    def __init__(self, run: LoadedRun, recording: Recording, scale: Scale, look: str, width: int, tools: bool) -> None:
        from matplotlib import colormaps
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        self._recording, self._scale = recording, scale
        across, along = np.ptp(recording.position.reshape(-1, 3), axis=0)[:2]
        # along y, a long specimen would hide behind its end
        self._sight = view_axes(look, turned=look != "top" and bool(along > LENGTH_RATIO * across))
        self._norm = Normalize(scale.low, scale.high, clip=True)
        self._map = colormaps["coolwarm" if scale.signed else "viridis"]
        bodies = recording.bodies if tools else ()
        low, high = _extent(recording, self._sight, bodies)
        self._figure, self._axes, bar = _figure(run, high - low, width / DPI)
        self._axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        self._axes.set_aspect("equal")
        self._view = _view(self._axes)
        thick = 2.0 * float(recording.radius.mean()) / self._view.pixel * 72.0 / DPI
        self._line = max(thick, SEAM) if look == "side" else SEAM
        self._with_tools = bool(bodies)
        self._tools = ToolLayers(bodies, self._sight, self._view)
        unit = f" [{scale.unit}]" if scale.unit else ""
        cut = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
        ends = (scale.least < scale.low - 1e-12, scale.largest > scale.high + 1e-12)
        shown = self._figure.colorbar(ScalarMappable(self._norm, self._map), cax=bar, extend=cut[ends])
        shown.set_label(scale.label + unit, fontsize=9)
        self._clock = self._figure.text(0.98, 0.02, "", ha="right", fontsize=9, family="monospace")
        self._timed = has_curve_time(run, recording.time)
        self._drawn: list[Any] = []

    def image(self, position: Array, value: Array, time: float) -> Image:
        """Pixels (rows, columns, 3) at ``time`` [ms] of nodes at ``position``, without elements of ``value`` nan."""
        kept = np.isfinite(value)
        corners = (position @ self._sight.T)[self._recording.cells[kept]]
        colour = self._map(self._norm(self._scale.factor * value[kept]))[:, :3]
        while self._drawn:
            self._drawn.pop().remove()
        draw = self._tubes if corners.shape[1] == 2 else self._shells
        height = draw(corners, colour, kept)
        behind, before = self._tools.around(height, self._recording.bodies_at(time))
        self._show(behind, 0.5)
        self._show(before, 2.0)
        if self._timed:
            self._clock.set_text(f"{time:8.2f} ms")
        canvas: Any = self._figure.canvas
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def _tubes(self, ends: Array, colour: Array, kept: NDArray[np.bool_]) -> Array:
        fine = replace(self._view, pixel=self._view.pixel / TUBE_REFINEMENT)
        canvas = tube_canvas(ends[:, 0], ends[:, 1], self._recording.radius[kept], colour, fine)
        rows, columns = self._view.shape
        blocks = (rows, canvas.rows // rows, columns, canvas.columns // columns)
        self._show(_mean_pixels(canvas.image.reshape(*blocks, 4)), 1.0)
        return canvas.height.reshape(blocks).max(axis=(1, 3))

    def _shells(self, corners: Array, colour: Array, kept: NDArray[np.bool_]) -> Array:
        from matplotlib.collections import PolyCollection

        places, shown = shade_quads(corners, colour)
        drawn = PolyCollection(list(places), facecolor=shown, edgecolor=shown, linewidth=self._line, zorder=1.0)
        self._drawn.append(self._axes.add_collection(drawn))
        return (
            render_triangles(corners[:, HALVES].reshape(-1, 3, 3), self._view)[0] if self._with_tools else np.zeros(())
        )

    def _show(self, image: Array, order: float) -> None:
        if image.size:
            extent, smooth = self._view.extent, "antialiased"
            self._drawn.append(
                self._axes.imshow(image, origin="lower", extent=extent, interpolation=smooth, zorder=order)
            )


def _extent(recording: Recording, seen_from: Array, bodies: Any) -> tuple[Array, Array]:
    """Lower and upper corner (2,) of all places of nodes and tools in the picture, with a margin."""
    seen = [(recording.position @ seen_from.T).reshape(-1, 3)]
    for body in bodies:
        seen += [body.place(frame) @ seen_from.T for frame in range(len(body.offset))]
    low = np.min([place.min(axis=0) for place in seen], axis=0)[:2]
    high = np.max([place.max(axis=0) for place in seen], axis=0)[:2]
    edge = MARGIN * float((high - low).max()) + float(recording.radius.max())
    return low - edge, high + edge


def _view(axes: Any) -> View:
    axes.apply_aspect()
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    pixel = float(right - left) / float(axes.get_window_extent().width)
    whole = View(left, right, bottom, top, pixel).shape
    return View(left, left + whole[1] * pixel, bottom, bottom + whole[0] * pixel, pixel)


def _mean_pixels(blocks: Array) -> Array:
    """Mean of RGBA pixels (rows, k, columns, k, 4) over their blocks, weighted by opacity."""
    alpha = blocks[..., 3:].sum(axis=(1, 3))
    colour = (blocks[..., :3] * blocks[..., 3:]).sum(axis=(1, 3)) / np.maximum(alpha, 1e-12)
    return np.concatenate([colour, alpha / (blocks.shape[1] * blocks.shape[3])], axis=2)


def _figure(run: LoadedRun, extent: Array, wide: float) -> tuple[Any, Any, Any]:
    """A figure ``wide`` [inch] with axes for ``extent`` [mm] and one for the colour bar, an even number of pixels."""
    lines = [line for notice in notices(run) for line in wrap(notice, int((wide - CLOCK) / LETTER))][::-1]
    below = 0.3 + LINE * max(len(lines) - 1, 0)
    tall = float(np.clip((wide - BAR) * extent[1] / extent[0], 0.4 * wide, 1.2 * wide)) + 0.5 + below
    figure = new_figure(wide, 0.02 * round(50.0 * tall))
    figure.set_dpi(DPI)
    axes = figure.add_axes((0.01, below / tall, 1.0 - BAR / wide, 1.0 - (0.5 + below) / tall))
    axes.set_axis_off()
    figure.text(0.02, 1.0 - 0.25 / tall, run.title, fontsize=11, va="center")
    for number, line in enumerate(lines):
        figure.text(0.02, (0.1 + LINE * number) / tall, line, fontsize=8, color=RED)
    return figure, axes, figure.add_axes((1.0 - (BAR - 0.2) / wide, 0.25, 0.15 / wide, 0.5))
