"""Cache folders that no other user can write to, and arrays kept in them with a checksum."""

import hashlib
import io
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import IO

import numpy as np

from knittest.base.errors import InputError, is_out_of_memory
from knittest.base.files import size_on_disk
from knittest.base.progress import tell

# Folders that nobody but their owner can put files into: what is loaded from them is run.

OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
#: links on the way to a folder, as most systems allow
MOST_LINKS = 40


def weakness(folder: Path) -> str:
    """Reason why another user could put files into ``folder`` or exchange it; empty when none could.

    The folder is this user's and nobody else writes to it; each folder on the way to it, links followed, is this
    user's or the system's and closed to others, or sticky as that for temporary files is. Raises ``OSError``.
    """
    trusted = {0, os.geteuid(), os.lstat("/").st_uid}
    way = [(place, place.lstat()) for place in _way(folder)]
    for place, state in way:
        if state.st_uid not in trusted:
            return f"{place} belongs to user {state.st_uid}"
        if _open_to_others(state) and not state.st_mode & stat.S_ISVTX:
            return f"{place} can be written by others (mode {stat.S_IMODE(state.st_mode):o})"
    place, state = way[-1]
    if state.st_uid != os.geteuid():
        return f"{place} belongs to user {state.st_uid}"
    if _open_to_others(state):
        return f"{place} can be written by others (mode {stat.S_IMODE(state.st_mode):o})"
    return ""


def _open_to_others(state: os.stat_result) -> bool:
    """Tell whether it is a folder in which another user can make files; the mode of a link says nothing."""
    return stat.S_ISDIR(state.st_mode) and bool(state.st_mode & OTHERS_WRITE)


def make_private(folder: Path) -> None:
    """Make ``folder`` and what is missing of the way to it, closed to all others; raises ``OSError``."""
    missing = [folder]
    while not os.path.lexists(missing[-1].parent):
        missing.append(missing[-1].parent)
    for path in reversed(missing):
        path.mkdir(mode=0o700, exist_ok=True)


def _way(folder: Path) -> Iterator[Path]:
    """Every folder and link from the root to ``folder``, which may be a link itself; raises ``OSError``."""
    place, links = Path("/"), 0
    yield place
    left = [*reversed(folder.absolute().parts[1:])]
    while left:
        name = left.pop()
        if name == "..":
            place = place.parent
            continue
        yield place / name
        if not (place / name).is_symlink():
            place = place / name
            continue
        links += 1
        if links > MOST_LINKS:
            raise OSError(f"{folder}: too many links")
        target = (place / name).readlink()
        left.extend(reversed(target.parts[1:] if target.is_absolute() else target.parts))
        place = Path("/") if target.is_absolute() else place


VARIABLE = "KNITTEST_CACHE_DIR"
#: folders in the cache: those that may be emptied
FOLDERS = ("numba", "cells", "settled", "cards")


def cache_root() -> Path | None:
    """Cache folder that only this user writes: ``KNITTEST_CACHE_DIR``, else the user's cache folder.

    Where that cannot be written, one in the system's folder for temporary files if that is private too, else None:
    nothing is kept. A line on stderr says so. Raises :class:`InputError` when the folder of the variable is open to
    others: kernels are loaded from it, and whoever writes there runs code as this user.
    """
    from platformdirs import user_cache_path

    given = os.environ.get(VARIABLE)
    return _usable(Path(given), VARIABLE) if given else _usable(user_cache_path("knittest"), "")


def cache_folder(*names: str) -> Path | None:
    """The folder ``names`` of the cache, made where it is missing; None where nothing is kept."""
    root = cache_root()
    if root is None:
        return None
    folder = root.joinpath(*names)
    problem = _problem(folder)
    if not problem:
        return folder
    if os.environ.get(VARIABLE):
        raise InputError(f"{VARIABLE}: {_refusal(problem)}")
    _say_once(f"{problem}: nothing is kept there; remove it, it is only a cache")
    return None


def clear(root: Path) -> int:
    """Remove the folders of the cache in ``root``, none of another's in it, and return their bytes."""
    folders = [path for path in map(root.joinpath, FOLDERS) if path.is_dir() and not path.is_symlink()]
    size = sum(map(size_on_disk, folders))
    for folder in folders:
        shutil.rmtree(folder)
    return size


@cache
def _usable(folder: Path, variable: str) -> Path | None:
    problem = _problem(folder)
    if not problem and _can_write(folder):
        return folder
    if problem and variable:
        raise InputError(f"{variable}: {_refusal(problem)}")
    what = problem or f"{folder} cannot be written"
    remedy = f"set {VARIABLE} to a folder that only you can write to"
    with suppress(FileNotFoundError):  # no folder for temporary files either
        spare = Path(tempfile.gettempdir()) / f"knittest-cache-{os.geteuid()}"
        if not _problem(spare) and _can_write(spare):
            _say_once(f"{what}: caching in {spare}; {remedy}")
            return spare
        what += f", nor is {spare} a private folder"
    _say_once(f"{what}: nothing is cached, kernels are compiled anew each time; {remedy}")
    return None


def _refusal(problem: str) -> str:
    return (
        f"{problem}, and whoever can put files there could run code as you; expected a folder that only you can write "
        "to: choose another one, or remove it and let it be made anew"
    )


def _problem(folder: Path) -> str:
    """Fault of ``folder``, which is made where it is missing; empty without one and where it cannot be made."""
    try:
        make_private(folder)
    except OSError:
        return ""
    try:
        return weakness(folder)
    except OSError as error:
        return f"{folder} cannot be looked at ({error.strerror or error})"


def _can_write(folder: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@cache
def _say_once(text: str) -> None:
    tell(text)


CHECKSUM = "sha256"


class Damaged(Exception):
    """The file is not what was written; the message says what is wrong with it."""


def seal(stream: IO[bytes], arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` with their checksum to ``stream``."""
    np.savez(stream, allow_pickle=False, **arrays, **{CHECKSUM: np.array(checksum(arrays))})


def unseal(content: bytes, name: str) -> dict[str, np.ndarray]:
    """The arrays in ``content`` of the file ``name``; raises :class:`Damaged` unless :func:`seal` wrote exactly it."""
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive.files}
    except Exception as error:  # zip, header and array parsers raise whatever the damaged bytes lead them to
        if is_out_of_memory(error):
            raise
        raise Damaged(f"{name} cannot be read ({type(error).__name__})") from error
    stated = arrays.pop(CHECKSUM, None)
    if stated is None or str(stated) != checksum(arrays):
        raise Damaged(f"the checksum of {name} is wrong")
    return arrays


def checksum(arrays: Mapping[str, np.ndarray]) -> str:
    """SHA-256 of names, types, shapes and bytes of ``arrays``."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {arrays[name].shape} ".encode())
        digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()


KEY = "key"


def kept(path: Path | None, key: str) -> dict[str, np.ndarray] | None:
    """The arrays that :func:`keep` wrote to ``path``; None if there are none.

    Raises :class:`Damaged` for a file that is not what was written, or that belongs to another ``key``.
    """
    if path is None:
        return None
    try:
        content = path.read_bytes()
    except OSError:
        return None
    arrays = unseal(content, path.name)
    if str(arrays.pop(KEY, "")) != key:
        raise Damaged(f"{path.name} is the cell of other inputs")
    return arrays


def keep(path: Path | None, key: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` whole or not at all; if the disk refuses, they are only computed again."""
    if path is None:
        return
    temporary: Path | None = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as stream:
            temporary = Path(stream.name)
            seal(stream, {KEY: np.array(key), **arrays})
        temporary.replace(path)
    except OSError:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()
