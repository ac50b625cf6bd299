"""Writes films of a run as MP4 (ffmpeg) or GIF (Pillow), with frames interpolated in time."""

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
from knittest.report_page.loaded_run import load_run
from knittest.report_page.moving.recording import Array, Recording, Scale, read_recording, scale_of, scales_of
from knittest.report_page.moving.stage import Stage

Image = NDArray[np.uint8]
FORMATS = (".mp4", ".gif")
#: colours of a GIF; with all 256 it is 10 % larger and looks the same
COLOURS = 192


def encode(out: Path, images: Iterator[Image], fps: int, typical: Iterable[Image]) -> None:
    """Write ``images`` (rows, columns, 3) at ``fps`` per second as ``out``, a GIF with the colours of ``typical`` ones.

    Raises :class:`InputError` without the encoder, :class:`ResourceError` when the disk is full; then there is no file.
    """
    part = out.with_name(f".{out.stem}.part{out.suffix}")
    try:
        if out.suffix == ".gif":
            _write_gif(part, images, fps, palette(typical))
        else:
            _write_mp4(part, images, fps)
        part.replace(out)
    except OSError as error:
        raise resource_error(out, error) from error
    finally:
        part.unlink(missing_ok=True)


def has_encoder() -> bool:
    """Tell whether MP4 can be written."""
    return find_spec("imageio_ffmpeg") is not None


def _write_mp4(path: Path, images: Iterator[Image], fps: int) -> None:
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
    """Colours (:data:`COLOURS`, 3) for ``images``, chosen by distance, so that few prominent pixels keep theirs."""
    from PIL import Image as Pillow

    pixels = np.concatenate([image.reshape(-1, 3) for image in images])
    box = (pixels >> 4).astype(np.int64) @ [256, 16, 1]
    count = np.bincount(box, minlength=4096)
    mean = np.stack([np.bincount(box, channel, 4096) for channel in pixels.T], axis=1)[count > 0]
    distinct = np.round(mean / count[count > 0, None]).astype(np.uint8)
    chosen = Pillow.fromarray(distinct[None]).quantize(COLOURS - 1, Pillow.Quantize.MEDIANCUT)
    found = np.array(chosen.getpalette(), np.uint8)[: 3 * (COLOURS - 1)].reshape(-1, 3)
    return np.vstack([found, np.full((COLOURS - len(found), 3), 255, np.uint8)])


def _write_gif(path: Path, images: Iterator[Image], fps: int, colours: Image) -> None:
    from PIL import Image as Pillow

    table = Pillow.new("P", (1, 1))
    table.putpalette(colours.tobytes())
    plain = Pillow.Dither.NONE  # dots of a dither change from image to image and fill the file
    pages = (Pillow.fromarray(image).quantize(palette=table, dither=plain) for image in images)
    next(pages).save(path, save_all=True, append_images=pages, duration=1000 / fps, loop=0)


#: default images per second and width [pixel]; a GIF stores whole images, an MP4 only changes
FPS, WIDTH = {".mp4": 15, ".gif": 10}, {".mp4": 960, ".gif": 640}
#: seconds for which the last image is held
LAST_IMAGE_SECONDS = 1.0
#: images from which the colours of a GIF are chosen
SAMPLE_IMAGES = 5


@dataclass(frozen=True)
class FilmOptions:
    """Options of a film: ``colour`` is a field of the frames, ``height``, or empty for the first field; ``look`` is one
    of :data:`LOOKS`; ``seconds`` long at ``fps`` images per second, ``width`` pixels wide (default: of its format);
    with ``tools`` or without.
    """

    colour: str = ""
    look: str = "oblique"
    seconds: float = 5.0
    fps: int | None = None
    width: int | None = None
    tools: bool = True

    def check(self) -> None:
        """Raise :class:`InputError` for an invalid option."""
        if self.look not in LOOKS:
            raise InputError(f"look {self.look!r}: expected one of {', '.join(LOOKS)}")
        for name, least, most in (("seconds", 0.1, 600.0), ("fps", 1, 60), ("width", 320, 3840)):
            given = getattr(self, name)
            if given is not None and not least <= given <= most:
                raise InputError(f"{name} = {given:g}: expected {least:g} to {most:g}")


def film_paths(parent: Path, folders: Sequence[Path], out: Path | None) -> tuple[dict[Path, Path], str]:
    """Film of each run of ``folders`` in ``parent``, and a note without MP4; ``out`` is extended for several runs."""
    if out is None:
        mp4 = has_encoder()
        why = "GIF, since the encoder of MP4 is not installed: pip install 'knittest[animate]'"
        return {folder: folder / ("film.mp4" if mp4 else "film.gif") for folder in folders}, "" if mp4 else why
    if len(folders) == 1:
        return {folders[0]: out}, ""
    names = ["-".join(folder.resolve().relative_to(parent.resolve()).parts) for folder in folders]
    return {f: out.with_name(f"{out.stem}-{n}{out.suffix}") for f, n in zip(folders, names, strict=True)}, ""


def animate(folder: Path, out: Path, filmed: FilmOptions | None = None) -> Path:
    """Write the run in ``folder`` as the film ``out`` (.mp4 or .gif); returns its path.

    Raises :class:`InputError` for a folder without frames, an unknown field and another format, :class:`ResourceError`
    when the file cannot be written.
    """
    filmed = filmed or FilmOptions()
    filmed.check()
    if out.suffix not in FORMATS:
        raise InputError(f"{out}: expected a name that ends with {' or '.join(FORMATS)}")
    run, recording = load_run(folder), read_recording(folder)
    values, scale = _colour_values(recording, filmed.colour)
    fps, width = filmed.fps or FPS[out.suffix], filmed.width or WIDTH[out.suffix]
    stage = Stage(run, recording, scale, filmed.look, width, filmed.tools)
    images = _images(stage, recording, values, max(2, round(fps * filmed.seconds)))
    encode(
        out,
        _repeat_images(images, round(LAST_IMAGE_SECONDS * fps)),
        fps,
        _images(stage, recording, values, SAMPLE_IMAGES),
    )
    return out


def _colour_values(recording: Recording, colour: str) -> tuple[Array, Scale]:
    """Values (k, m) and scale of the field ``colour``, by default of the first field, else of the height."""
    height = recording.position[:, recording.cells, 2].mean(axis=2)
    known = scales_of(recording)
    name = colour or next(iter(known), "height")
    if name != "height" and name not in known:
        raise InputError(f"colour {name!r}: expected one of {', '.join([*known, 'height'])}")
    if name != "height":
        return recording.fields[name], known[name]
    return height, scale_of("height", height) or Scale("height", "mm", 1.0, -1.0, 1.0, True, 0.0, 0.0)


def _images(stage: Stage, recording: Recording, values: Array, count: int) -> Iterator[Image]:
    """``count`` images from the first frame to the last, evenly spaced in time."""
    place, alive = recording.position, recording.fields.get("alive", np.ones_like(values)) > 0.5
    for moment in np.linspace(recording.time[0], recording.time[-1], count).tolist():
        k, after, share = recording.around(moment)
        position = (1.0 - share) * place[k] + share * place[after]
        value = (1.0 - share) * values[k] + share * values[after]
        yield stage.image(position, np.where(alive[k], value, np.nan), moment)


def _repeat_images(images: Iterator[Image], times: int) -> Iterator[Image]:
    image = None
    for image in images:
        yield image
    yield from repeat(image, times) if image is not None else ()
