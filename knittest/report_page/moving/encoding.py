"""Images one after the other into one file: MP4 by ffmpeg, GIF by Pillow."""

from collections.abc import Iterable, Iterator
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import resource_error
from knittest.base.errors import InputError

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
