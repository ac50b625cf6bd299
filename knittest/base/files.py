"""Files: atomic writing, safe reading of user files, tidy tables, shipped data."""

import csv
import errno
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from knittest.base.errors import InputError, ResourceError

#: largest number of characters of a file in a message
EXCERPT = 100


def excerpt(text: str) -> str:
    """First line of ``text``, printable and cut to :data:`EXCERPT` characters, for a message on a file."""
    line = next(iter(text.splitlines()), "")
    plain = "".join(c if c.isprintable() else "?" for c in line)
    return plain if len(plain) <= EXCERPT else plain[: EXCERPT - 3] + "..."


def read_regular(path: Path, limit: int, remedy: str) -> bytes:
    """Bytes of a regular file of at most ``limit`` bytes; ``remedy`` ends the message of a larger one.

    Raises :class:`InputError`, at once also for a pipe without a writer or an endless device.
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
        raise InputError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(raw) > limit:
        size = f"{limit // 1_000_000} MB" if limit > 1_000_000 else f"{limit // 1000} kB"
        raise InputError(f"{path}: larger than {size}: {remedy}")
    return raw


def size_on_disk(folder: Path) -> int:
    """Bytes of ``folder`` on the disk, without following links; files that vanish meanwhile are skipped."""
    size = 0
    for place, _, names in os.walk(folder):
        for name in names:
            with suppress(OSError):
                state = (Path(place) / name).lstat()
                size += 512 * state.st_blocks if hasattr(state, "st_blocks") else state.st_size
    return size


_NO_PERMISSION = "no permission to write there; choose another folder with --out"
_HINTS = {
    errno.ENOSPC: "the disk is full; free some space or choose another folder with --out",
    errno.EDQUOT: "the disk quota is used up; free some space or choose another folder with --out",
    errno.EROFS: "the file system is read-only; choose another folder with --out",
    errno.EACCES: _NO_PERMISSION,
    errno.EPERM: _NO_PERMISSION,
}

#: limits of the name of a folder, so that every file system accepts the names of its files
DEEPEST, LONGEST, LONGEST_NAME = 100, 3500, 200


def resource_error(path: Path, error: OSError) -> ResourceError:
    """Error that says which file could not be written, why, and what to do."""
    hint = _HINTS.get(error.errno or 0, error.strerror or str(error))
    return ResourceError(f"{path}: cannot write: {hint}")


def make_folder(path: Path) -> None:
    """Make ``path`` with its parents; raises :class:`InputError` for a bad name, else :class:`ResourceError`."""
    if len(path.parts) > DEEPEST or len(os.fsencode(path.absolute())) > LONGEST:
        raise InputError(
            f"{excerpt(str(path))}: the path has {len(path.parts)} folders and {len(os.fsencode(path))} bytes, "
            f"expected at most {DEEPEST} and {LONGEST}: choose a shorter path"
        )
    if longest := next((name for name in path.parts if len(os.fsencode(name)) > LONGEST_NAME), ""):
        raise InputError(
            f"{excerpt(longest)}: the name has {len(os.fsencode(longest))} bytes, expected at most {LONGEST_NAME}: "
            "choose a shorter one"
        )
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise resource_error(path, error) from error


@contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """Give a temporary file in the folder of ``path``, which is synced and replaces ``path`` on success.

    After an error the old ``path`` remains and the temporary file is gone; raises :class:`ResourceError` for errors of
    the operating system.
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
    """Write ``data`` (text as UTF-8) to ``path`` whole or not at all."""
    with replace_file(path) as temporary:
        temporary.write_bytes(data.encode() if isinstance(data, str) else data)


def _sync_folder(folder: Path) -> None:
    """Make a renaming durable, if the file system can sync a folder."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


COLUMNS = ["variant", "direction", "quantity", "mean", "sd", "n", "unit", "table"]


def variants(folder: Path) -> list[str]:
    """Variants in the tables of ``folder``; raises as :func:`read_tidy_rows` does."""
    return sorted({row["variant"] for _, _, row in read_tidy_rows(folder)})


def read_tidy_rows(folder: Path) -> Iterator[tuple[Path, int, dict[str, str]]]:
    """File, line and cells of every row in all tables of ``folder``; raises :class:`InputError` for bad tables."""
    files = sorted(folder.glob("*.csv"))
    if not files:
        raise InputError(f"{folder}: it has no tables of an experiment (*.csv): write them by knittest data import")
    for path in files:
        with path.open(encoding="utf-8", newline="") as stream:
            reader = csv.DictReader(stream)
            if reader.fieldnames != COLUMNS:
                raise InputError(f"{path}:1: expected the columns {','.join(COLUMNS)} of an experiment")
            for row in reader:
                yield path, reader.line_num, row


#: field that makes a fabric file a structure
STRUCTURE_FIELD = re.compile(r"^(stitches|layers):", re.M)
#: folder of the package
PACKAGE = Path(__file__).resolve().parent.parent


def configs_dir() -> Path:
    """Folder of the shipped configs (``fabrics/``, ``rigs/``)."""
    return _shipped_folder("configs")


def structures() -> dict[str, Path]:
    """Shipped fabric files that state stitches or layers of inlays, by name, but those of measured knits."""
    files = sorted((configs_dir() / "fabrics").glob("*.yaml"))
    texts = {p: p.read_text(encoding="utf-8") for p in files}
    return {p.stem: p for p, text in texts.items() if STRUCTURE_FIELD.search(text) and "soft_shell" not in text}


def data_dir() -> Path:
    """Folder of the shipped experimental data; data paths in a config are relative to it."""
    return _shipped_folder("data")


def _shipped_folder(name: str) -> Path:
    in_wheel = PACKAGE / "shipped" / name
    return in_wheel if in_wheel.is_dir() else PACKAGE.parent / name
