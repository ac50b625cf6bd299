"""Common part of batches, calibrations and homogenisations: the folder that they go on in, and how they say so."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from knittest.base.atomic import make_folder, resource_error, write_atomic
from knittest.base.errors import InputError
from knittest.base.interrupts import Interrupted


class Studied(NamedTuple):
    """Folder of a study that went to its end, and the exit code of its command."""

    folder: Path
    exit_code: int


def study_folder(folder: Path, marker: str, content: bytes | str, what: str) -> Path:
    """Make ``folder`` that of a study, with the file ``marker`` that says what it is; returns it.

    Raises :class:`InputError` where it is a file or holds something else than ``what``, :class:`ResourceError` where
    it cannot be written.
    """
    if os.path.lexists(folder) and not folder.is_dir():
        raise InputError(f"--out {folder}: is a file, expected a folder")
    make_folder(folder)
    try:
        names = [entry.name for entry in folder.iterdir() if not entry.name.startswith(".")]
    except OSError as error:
        raise resource_error(folder, error) from error
    if names and marker not in names:
        raise InputError(f"--out {folder}: holds {names[0]}, but no {what}: choose a new folder")
    write_atomic(folder / marker, content)
    return folder


@contextmanager
def says_how_to_go_on() -> Iterator[None]:
    """Let an interruption say that the same command goes on."""
    try:
        yield
    except Interrupted as error:
        raise Interrupted(f"{error}; what is finished is kept: go on with the same command") from None
