"""Films of a run folder: its frames drawn one after the other, those between them interpolated in time."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.figure import RED, new_figure
from knittest.export.slant import LOOKS, shaded, sight
from knittest.export.tubes import View, render_tubes
from knittest.report_page.loading import LoadedRun, load_run
from knittest.report_page.moving.encoding import FORMATS, encode
from knittest.report_page.moving.page import notices
from knittest.report_page.moving.recording import Array, Recording, read_recording
from knittest.report_page.moving.scales import Scale, scale_of, scales_of

Image = NDArray[np.uint8]

#: pixels an inch: letters stay legible at 640 pixels and do not fill the picture at 1920
DPI = 100
#: share of the extent that is left free around what moves
MARGIN = 0.02
#: seconds for which the last image stands
LAST = 1.0


@dataclass(frozen=True)
class Filmed:
    """Film as it is asked for: ``colour`` is a field of the frames, height, or empty for the one looked for first;
    ``look`` one of :data:`LOOKS`; it takes ``seconds`` at ``fps`` images a second of ``width`` pixels.
    """

    colour: str = ""
    look: str = "oblique"
    seconds: float = 5.0
    fps: int = 15
    width: int = 960

    def check(self) -> None:
        """Raises :class:`InputError` for what no film can be made of."""
        if self.look not in LOOKS:
            raise InputError(f"look {self.look!r}: expected one of {', '.join(LOOKS)}")
        for name, least, most in (("seconds", 0.1, 600.0), ("fps", 1, 60), ("width", 320, 3840)):
            if not least <= getattr(self, name) <= most:
                raise InputError(f"{name} = {getattr(self, name):g}: expected {least:g} to {most:g}")


def animate(folder: Path, out: Path, filmed: Filmed | None = None) -> Path:
    """Write the run in ``folder`` as the film ``out`` (.mp4 or .gif); returns its path.

    Raises :class:`InputError` for a folder without frames, a field that they lack and another format,
    :class:`ResourceError` when the file cannot be written.
    """
    filmed = filmed or Filmed()
    filmed.check()
    if out.suffix not in FORMATS:
        raise InputError(f"{out}: expected a name that ends with {' or '.join(FORMATS)}")
    run, recording = load_run(folder), read_recording(folder)
    values, scale = _coloured(recording, filmed.colour)
    stage = Stage(run, recording, scale, filmed)
    encode(out, _images(stage, recording, values, filmed), filmed.fps)
    return out


def _coloured(recording: Recording, colour: str) -> tuple[Array, Scale]:
    """Values (k, m) of the field ``colour`` and its scale; of the first field there is, else height, for none."""
    height = recording.position[:, recording.cells, 2].mean(axis=2)
    known = scales_of(recording)
    name = colour or next(iter(known), "height")
    if name != "height" and name not in known:
        raise InputError(f"colour {name!r}: expected one of {', '.join([*known, 'height'])}")
    if name != "height":
        return recording.fields[name], known[name]
    return height, scale_of("height", height) or Scale("height", "mm", 1.0, -1.0, 1.0, True, 0.0, 0.0)


def _images(stage: "Stage", recording: Recording, values: Array, filmed: Filmed) -> Iterator[Image]:
    """Images from the first frame to the last, evenly in time, the last one held."""
    count = max(2, round(filmed.fps * filmed.seconds))
    alive = recording.fields.get("alive", np.ones_like(values)) > 0.5
    for time in np.linspace(recording.time[0], recording.time[-1], count):
        k = int(np.clip(np.searchsorted(recording.time, time, side="right") - 1, 0, max(len(recording.time) - 2, 0)))
        after = min(k + 1, len(recording.time) - 1)
        span = float(recording.time[after] - recording.time[k])
        share = (time - recording.time[k]) / span if span > 0.0 else 0.0
        position = (1.0 - share) * recording.position[k] + share * recording.position[after]
        value = (1.0 - share) * values[k] + share * values[after]
        image = stage.image(position, np.where(alive[k], value, np.nan), float(time))
        yield image
    for _ in range(round(LAST * filmed.fps)):
        yield image


class Stage:
    """The picture that every image of a film is drawn into: title, axes of one size, colours, time."""

    def __init__(self, run: LoadedRun, recording: Recording, scale: Scale, filmed: Filmed) -> None:
        from matplotlib import colormaps
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        self._recording, self._scale, self._sight = recording, scale, sight(filmed.look)
        self._norm = Normalize(scale.low, scale.high, clip=True)
        self._map = colormaps["coolwarm" if scale.signed else "viridis"]
        seen = recording.position @ self._sight.T
        low, high = seen[..., :2].min(axis=(0, 1)), seen[..., :2].max(axis=(0, 1))
        edge = MARGIN * float((high - low).max()) + float(recording.radius.max())
        self._low, self._high = low - edge, high + edge
        self._figure, self._axes, bar = _figure(run, self._high - self._low, filmed.width / DPI)
        unit = f" [{scale.unit}]" if scale.unit else ""
        cut = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
        ends = (scale.least < scale.low - 1e-12, scale.largest > scale.high + 1e-12)
        shown = self._figure.colorbar(ScalarMappable(self._norm, self._map), cax=bar, extend=cut[ends])
        shown.set_label(scale.label + unit, fontsize=9)
        self._clock = self._figure.text(0.98, 0.02, "", ha="right", fontsize=9, family="monospace")
        self._drawn: Any = None

    def image(self, position: Array, value: Array, time: float) -> Image:
        """Pixels (rows, columns, 3) of the nodes at ``position`` (n, 3), elements coloured by ``value`` (m,), of which
        those without a number are not drawn, at ``time`` [ms].
        """
        kept = np.isfinite(value)
        corners = (position @ self._sight.T)[self._recording.cells[kept]]
        colour = self._map(self._norm(self._scale.factor * value[kept]))[:, :3]
        if self._drawn is not None:
            self._drawn.remove()
        self._drawn = self._tubes(corners, colour, kept) if corners.shape[1] == 2 else self._shells(corners, colour)
        self._clock.set_text(f"{time:8.2f} ms")
        canvas: Any = self._figure.canvas
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def _tubes(self, ends: Array, colour: Array, kept: NDArray[np.bool_]) -> Any:
        (left, bottom), (right, top) = self._low, self._high
        view = View(left, right, bottom, top, float(right - left) / self._axes.get_window_extent().width)
        image = render_tubes(ends[:, 0], ends[:, 1], self._recording.radius[kept], colour, view)
        return self._axes.imshow(image, origin="lower", extent=view.extent, interpolation="antialiased")

    def _shells(self, corners: Array, colour: Array) -> Any:
        from matplotlib.collections import PolyCollection

        places, shown = shaded(corners, colour)
        return self._axes.add_collection(PolyCollection(list(places), facecolor=shown, edgecolor=shown, linewidth=0.2))


def _figure(run: LoadedRun, extent: Array, wide: float) -> tuple[Any, Any, Any]:
    """A figure ``wide`` [inch] with axes for ``extent`` [mm] and one for the colour bar, an even number of pixels."""
    tall = float(np.clip(0.84 * wide * extent[1] / extent[0], 0.4 * wide, 1.2 * wide)) + 0.8
    figure = new_figure(wide, 0.02 * round(50.0 * tall))
    figure.set_dpi(DPI)
    axes = figure.add_axes((0.01, 0.3 / tall, 0.84, 1.0 - 0.8 / tall))
    axes.set_axis_off()
    figure.text(0.02, 1.0 - 0.25 / tall, run.title, fontsize=11, va="center")
    for line, said in enumerate(notices(run)):
        figure.text(0.02, (0.1 + 0.16 * line) / tall, said, fontsize=8, color=RED)
    return figure, axes, figure.add_axes((0.88, 0.25, 0.02, 0.5))
