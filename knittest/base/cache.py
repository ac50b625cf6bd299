"""Cache: folders that no other user can write to, and arrays stored there with a checksum."""

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

OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
#: largest number of links in a path, as in most systems
MOST_LINKS = 40


def write_access_fault(folder: Path) -> str:
    """Reason why another user could put files into ``folder`` or exchange it; empty if none could.

    Kernels are loaded from it, so it must be this user's and closed to others. Each folder of its path, links followed,
    must belong to this user or the system, and be closed to others or sticky as that of temporary files. Raises
    ``OSError``. Windows keeps access lists instead, which are not read: the folder counts as private.
    """
    if not hasattr(os, "geteuid"):
        return ""
    trusted = {0, os.geteuid(), os.lstat("/").st_uid}
    way = [(place, place.lstat()) for place in _path_parts(folder)]
    for place, state in way:
        last = place == way[-1][0]
        if state.st_uid not in trusted or (last and state.st_uid != os.geteuid()):
            return f"{place} belongs to user {state.st_uid}"
        is_open = stat.S_ISDIR(state.st_mode) and state.st_mode & OTHERS_WRITE  # the mode of a link has no meaning
        if is_open and (last or not state.st_mode & stat.S_ISVTX):
            return f"{place} can be written by others (mode {stat.S_IMODE(state.st_mode):o})"
    return ""


def make_private(folder: Path) -> None:
    """Make ``folder`` with its parents, closed to all others; raises ``OSError``."""
    missing = [folder]
    while not os.path.lexists(missing[-1].parent):
        missing.append(missing[-1].parent)
    for path in reversed(missing):
        path.mkdir(mode=0o700, exist_ok=True)


def _path_parts(folder: Path) -> Iterator[Path]:
    """Folders and links of the path of ``folder``, from the root; raises ``OSError``."""
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
#: folders of the cache, which may be emptied
FOLDERS = ("numba", "cells", "settled", "cards")


def cache_root() -> Path | None:
    """Cache folder that only this user can write: ``KNITTEST_CACHE_DIR``, else the user's cache folder.

    If that cannot be written, a private one in the folder for temporary files, else None, with a line on stderr. Raises
    :class:`InputError` if others can write the folder of the variable: they could run code as this user.
    """
    from platformdirs import user_cache_path

    given = os.environ.get(VARIABLE)
    return _find_usable_folder(Path(given), VARIABLE) if given else _find_usable_folder(user_cache_path("knittest"), "")


def cache_folder(*names: str) -> Path | None:
    """Folder ``names`` of the cache, made if missing; None if nothing is cached."""
    root = cache_root()
    if root is None:
        return None
    folder = root.joinpath(*names)
    problem = _find_problem(folder)
    if not problem:
        return folder
    if os.environ.get(VARIABLE):
        raise InputError(f"{VARIABLE}: {_refusal_text(problem)}")
    _say_once(f"{problem}: it is not used; remove it, it is only a cache")
    return None


def remove_cache(root: Path) -> int:
    """Remove the folders of the cache in ``root``, nothing else, and return their bytes."""
    folders = [path for path in map(root.joinpath, FOLDERS) if path.is_dir() and not path.is_symlink()]
    size = sum(map(size_on_disk, folders))
    for folder in folders:
        shutil.rmtree(folder)
    return size


@cache
def _find_usable_folder(folder: Path, variable: str) -> Path | None:
    problem = _find_problem(folder)
    if not problem and _can_write(folder):
        return folder
    if problem and variable:
        raise InputError(f"{variable}: {_refusal_text(problem)}")
    what = problem or f"{folder} cannot be written"
    remedy = f"set {VARIABLE} to a folder that only you can write to"
    with suppress(FileNotFoundError):  # no folder for temporary files
        user = f"-{os.geteuid()}" if hasattr(os, "geteuid") else ""  # Windows has a folder for each user
        spare = Path(tempfile.gettempdir()) / f"knittest-cache{user}"
        if not _find_problem(spare) and _can_write(spare):
            _say_once(f"{what}: the cache is {spare}; {remedy}")
            return spare
        what += f", and {spare} is no private folder"
    _say_once(f"{what}: nothing is cached, each run compiles its kernels; {remedy}")
    return None


def _refusal_text(problem: str) -> str:
    return (
        f"{problem}: others could run code as you from there. Expected a folder that only you can write to: choose "
        "another one, or remove it"
    )


def _find_problem(folder: Path) -> str:
    """Make ``folder`` if missing; return its fault, empty without one and if it cannot be made."""
    try:
        make_private(folder)
    except OSError:
        return ""
    try:
        return write_access_fault(folder)
    except OSError as error:
        return f"{folder} cannot be checked ({error.strerror or error})"


def _can_write(folder: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


_say_once = cache(tell)

CHECKSUM = "sha256"


class Damaged(Exception):
    """Error of a file that was changed since it was written."""


def seal(stream: IO[bytes], arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` with their checksum to ``stream``."""
    np.savez(stream, allow_pickle=False, **arrays, **{CHECKSUM: np.array(checksum(arrays))})


def unseal(content: bytes, name: str) -> dict[str, np.ndarray]:
    """Arrays in ``content`` of the file ``name``; raises :class:`Damaged` unless :func:`seal` wrote exactly it."""
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive.files}
    except Exception as error:  # parsers of damaged bytes may raise anything
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


def load_cached(path: Path | None, key: str) -> dict[str, np.ndarray] | None:
    """Arrays that :func:`save_cached` wrote to ``path`` for ``key``, or None; raises :class:`Damaged` for another
    file.
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


def save_cached(path: Path | None, key: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` whole or not at all; after an error of the disk they are computed again."""
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
