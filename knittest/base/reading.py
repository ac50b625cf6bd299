"""Reads files that others name: never a device or a pipe, and never more of them than asked for."""

import os
import stat
from contextlib import suppress
from pathlib import Path

from knittest.base.errors import InputError

#: most characters of a file's content in a message
EXCERPT = 100


def excerpt(text: str) -> str:
    """The first line of ``text``, printable and cut to :data:`EXCERPT` characters, for a message on a file."""
    line = next(iter(text.splitlines()), "")
    plain = "".join(c if c.isprintable() else "?" for c in line)
    return plain if len(plain) <= EXCERPT else plain[: EXCERPT - 3] + "..."


def read_regular(path: Path, limit: int, remedy: str) -> bytes:
    """Bytes of a regular file of at most ``limit`` bytes; ``remedy`` ends the message of a larger one.

    Raises :class:`InputError`, at once even for a pipe without a writer or an endless device.
    """
    try:
        # non-blocking, so that opening a pipe without a writer returns
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(handle, "rb") as stream:  # noqa: PTH123 - a descriptor
            if not stat.S_ISREG(os.fstat(handle).st_mode):
                raise InputError(f"{path}: not a regular file")
            raw = stream.read(limit + 1)
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(raw) > limit:
        size = f"{limit // 1_000_000} MB" if limit > 1_000_000 else f"{limit // 1000} kB"
        raise InputError(f"{path}: larger than {size}: {remedy}")
    return raw


def size_on_disk(folder: Path) -> int:
    """Bytes that ``folder`` takes on the disk; links in it are not followed, and what goes meanwhile counts nothing."""
    size = 0
    for place, _, names in os.walk(folder):
        for name in names:
            with suppress(OSError):
                size += 512 * (Path(place) / name).lstat().st_blocks
    return size
