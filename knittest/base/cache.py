"""Folder of compiled kernels and relaxed cells, kept between runs where no other user can put anything."""

import os
import shutil
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.notes import tell
from knittest.base.private import make_private, weakness
from knittest.base.reading import size_on_disk

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
