"""Folders that nobody but their owner can put files into: what is loaded from them is run."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

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
