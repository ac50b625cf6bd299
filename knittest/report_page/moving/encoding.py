"""Images one after the other into one file: MP4 by ffmpeg, GIF by Pillow."""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import resource_error
from knittest.base.errors import InputError

Image = NDArray[np.uint8]

FORMATS = (".mp4", ".gif")


def encode(out: Path, images: Iterator[Image], fps: int) -> None:
    """Write ``images`` (rows, columns, 3), all of one size, at ``fps`` a second as ``out``, whole or not at all.

    Raises :class:`InputError` where the encoder is not installed, :class:`ResourceError` when the disk is full.
    """
    write = {".mp4": _mp4, ".gif": _gif}[out.suffix]
    part = out.with_name(f".{out.stem}.part{out.suffix}")
    try:
        write(part, images, fps)
        part.replace(out)
    except OSError as error:
        raise resource_error(out, error) from error
    finally:
        part.unlink(missing_ok=True)


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


def _gif(path: Path, images: Iterator[Image], fps: int) -> None:
    from PIL import Image as Pillow

    pages = (Pillow.fromarray(image) for image in images)
    next(pages).save(path, save_all=True, append_images=pages, duration=1000 / fps, loop=0)
