"""Films of a run folder as MP4 (ffmpeg) or GIF (Pillow): its frames one after the other, interpolated in time."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import chain, repeat
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import resource_error
from knittest.export.shading import LOOKS
from knittest.report_page.loading import load_run
from knittest.report_page.moving.recording import Array, Recording, Scale, read_recording, scale_of, scales_of
from knittest.report_page.moving.stage import Stage

Image = NDArray[np.uint8]
FORMATS = (".mp4", ".gif")
#: colours of a GIF: with all 256 it is larger by a tenth, and looks the same
COLOURS = 192


def encode(out: Path, images: Iterator[Image], fps: int, typical: Iterable[Image]) -> None:
    """Write ``images`` (rows, columns, 3), all of one size, at ``fps`` a second as ``out``, whole or not at all; a GIF
    has the colours of ``typical`` ones among them.

    Raises :class:`InputError` where the encoder is not installed, :class:`ResourceError` when the disk is full.
    """
    part = out.with_name(f".{out.stem}.part{out.suffix}")
    try:
        if out.suffix == ".gif":
            _gif(part, images, fps, palette(typical))
        else:
            _mp4(part, images, fps)
        part.replace(out)
    except OSError as error:
        raise resource_error(out, error) from error
    finally:
        part.unlink(missing_ok=True)


def has_encoder() -> bool:
    """Tell whether MP4 can be written."""
    return find_spec("imageio_ffmpeg") is not None


def _mp4(path: Path, images: Iterator[Image], fps: int) -> None:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(
            f"{path.suffix}: needs an encoder: pip install 'knittest[animate]', or write a .gif, which needs none"
        ) from None
    first = next(images)
    size = (first.shape[1], first.shape[0])
    film = imageio_ffmpeg.write_frames(str(path), size, fps=fps, quality=7, macro_block_size=2)
    film.send(None)
    for image in chain([first], images):
        film.send(np.ascontiguousarray(image))
    film.close()


def palette(images: Iterable[Image]) -> Image:
    """Colours (:data:`COLOURS`, 3) for ``images``, white among them.

    They are chosen by how far apart colours are, not by how many pixels have them: by their numbers the few that stand
    out in a field would be lost to shades of its ground.
    """
    from PIL import Image as Pillow

    pixels = np.concatenate([image.reshape(-1, 3) for image in images])
    box = (pixels >> 4).astype(np.int64) @ [256, 16, 1]
    count = np.bincount(box, minlength=4096)
    mean = np.stack([np.bincount(box, channel, 4096) for channel in pixels.T], axis=1)[count > 0]
    distinct = np.round(mean / count[count > 0, None]).astype(np.uint8)
    chosen = Pillow.fromarray(distinct[None]).quantize(COLOURS - 1, Pillow.Quantize.MEDIANCUT)
    found = np.array(chosen.getpalette(), np.uint8)[: 3 * (COLOURS - 1)].reshape(-1, 3)
    return np.vstack([found, np.full((COLOURS - len(found), 3), 255, np.uint8)])


def _gif(path: Path, images: Iterator[Image], fps: int, colours: Image) -> None:
    from PIL import Image as Pillow

    table = Pillow.new("P", (1, 1))
    table.putpalette(colours.tobytes())
    plain = Pillow.Dither.NONE  # dots of a dither change from image to image and fill the file
    pages = (Pillow.fromarray(image).quantize(palette=table, dither=plain) for image in images)
    next(pages).save(path, save_all=True, append_images=pages, duration=1000 / fps, loop=0)


#: images a second and pixels across unless asked for: GIF holds every image whole, MP4 what changes
FPS, WIDTH = {".mp4": 15, ".gif": 10}, {".mp4": 960, ".gif": 640}
#: seconds for which the last image stands
LAST = 1.0
#: images that the colours of a GIF are chosen by
TYPICAL = 5


@dataclass(frozen=True)
class Filmed:
    """Film as it is asked for: ``colour`` is a field of the frames, height, or empty for the one looked for first;
    ``look`` one of :data:`LOOKS`; it takes ``seconds`` at ``fps`` images a second of ``width`` pixels, or as many as
    its format has usually; with ``tools`` or without.
    """

    colour: str = ""
    look: str = "oblique"
    seconds: float = 5.0
    fps: int | None = None
    width: int | None = None
    tools: bool = True

    def check(self) -> None:
        """Raises :class:`InputError` for what no film can be made of."""
        if self.look not in LOOKS:
            raise InputError(f"look {self.look!r}: expected one of {', '.join(LOOKS)}")
        for name, least, most in (("seconds", 0.1, 600.0), ("fps", 1, 60), ("width", 320, 3840)):
            given = getattr(self, name)
            if given is not None and not least <= given <= most:
                raise InputError(f"{name} = {given:g}: expected {least:g} to {most:g}")


def films(parent: Path, folders: Sequence[Path], out: Path | None) -> tuple[dict[Path, Path], str]:
    """Film of each run of ``folders`` found in ``parent``, and a line on the format where MP4 cannot be written.

    Without ``out`` it lies in the run's folder; an ``out`` for several has the place of the run below ``parent`` in its
    name.
    """
    if out is not None and len(folders) == 1:
        return {folders[0]: out}, ""
    if out is not None:
        names = ["-".join(folder.resolve().relative_to(parent.resolve()).parts) for folder in folders]
        return {f: out.with_name(f"{out.stem}-{n}{out.suffix}") for f, n in zip(folders, names, strict=True)}, ""
    if has_encoder():
        return {folder: folder / "film.mp4" for folder in folders}, ""
    why = "GIF, as MP4 needs an encoder that is not installed: pip install 'knittest[animate]'"
    return {folder: folder / "film.gif" for folder in folders}, why


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
    fps, width = filmed.fps or FPS[out.suffix], filmed.width or WIDTH[out.suffix]
    reel = _Reel(Stage(run, recording, scale, filmed.look, width, filmed.tools), recording, values)
    count = max(2, round(fps * filmed.seconds))
    encode(out, _held(reel.images(count), round(LAST * fps)), fps, reel.images(TYPICAL))
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


class _Reel:
    """Images of a recording at any time between its frames."""

    def __init__(self, stage: Stage, recording: Recording, values: Array) -> None:
        self._stage, self._recording, self._values = stage, recording, values
        self._alive = recording.fields.get("alive", np.ones_like(values)) > 0.5

    def images(self, count: int) -> Iterator[Image]:
        """``count`` images from the first frame to the last, evenly in time."""
        time = self._recording.time
        return (self._at(float(moment)) for moment in np.linspace(time[0], time[-1], count))

    def _at(self, moment: float) -> Image:
        place, values = self._recording.position, self._values
        k, after, share = self._recording.around(moment)
        position = (1.0 - share) * place[k] + share * place[after]
        value = (1.0 - share) * values[k] + share * values[after]
        return self._stage.image(position, np.where(self._alive[k], value, np.nan), moment)


def _held(images: Iterator[Image], times: int) -> Iterator[Image]:
    """``images``, the last one ``times`` more."""
    image = None
    for image in images:
        yield image
    yield from repeat(image, times) if image is not None else ()
