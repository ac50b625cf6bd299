"""Files that are either the old one or the complete new one, whatever happens in between."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from knittest.base.errors import InputError, ResourceError
from knittest.base.reading import excerpt

_HINTS = {
    errno.ENOSPC: "the disk is full; free some space or choose another folder with --out",
    errno.EDQUOT: "the disk quota is used up; free some space or choose another folder with --out",
    errno.EROFS: "the file system is read-only; choose another folder with --out",
    errno.EACCES: "no permission to write there; choose another folder with --out",
    errno.EPERM: "no permission to write there; choose another folder with --out",
}

#: what a folder may be called, so that the files in it have names that every file system takes
DEEPEST, LONGEST, LONGEST_NAME = 100, 3500, 200


def resource_error(path: Path, error: OSError) -> ResourceError:
    """Say in one line which file could not be written, why, and what to do."""
    hint = _HINTS.get(error.errno or 0, error.strerror or str(error))
    return ResourceError(f"{path}: cannot write: {hint}")


def make_folder(path: Path) -> None:
    """Make ``path`` and the folders it lies in; raises :class:`InputError` for a name that no file system takes,
    :class:`ResourceError` where it cannot be written.
    """
    if len(path.parts) > DEEPEST or len(os.fsencode(path.absolute())) > LONGEST:
        raise InputError(
            f"{excerpt(str(path))}: {len(path.parts)} folders deep, {len(os.fsencode(path))} bytes long; expected at "
            f"most {DEEPEST} and {LONGEST}: choose a shorter path"
        )
    if longest := next((name for name in path.parts if len(os.fsencode(name)) > LONGEST_NAME), ""):
        raise InputError(
            f"{excerpt(longest)}: a name of {len(os.fsencode(longest))} bytes; expected at most {LONGEST_NAME}: choose "
            "a shorter one"
        )
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise resource_error(path, error) from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary file in the folder of ``path``; on success it is synced and takes the place of ``path``.

    After any error the old ``path`` stands and the temporary file is gone; raises :class:`ResourceError` for the
    errors of the operating system.
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.tmp{path.suffix}")
    try:
        yield temporary
        with temporary.open("rb+") as stream:
            os.fsync(stream.fileno())
        temporary.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        raise resource_error(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_atomic(path: Path, data: bytes | str) -> None:
    """Write ``data`` (text as UTF-8) to ``path`` by way of :func:`replacing`."""
    with replacing(path) as temporary:
        temporary.write_bytes(data.encode() if isinstance(data, str) else data)


def _sync_folder(folder: Path) -> None:
    """Make the renaming itself durable; some file systems cannot sync a folder, which loses nothing already there."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
