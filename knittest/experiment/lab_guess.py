"""Tells which test a laboratory file is of by what it says, so that no other one is taken for granted."""

import re
from collections.abc import Sequence
from pathlib import Path

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import FRAME_SIDE, PLATE_LENGTH, PLATE_WIDTH
from knittest.experiment.lab_numbers import NUMBER
from knittest.experiment.lab_rows import read_rows

#: rows of a file that may say what it is of
_HEAD = 60
_SHEARED = re.compile(r"shear[ _-]*angle|scherwinkel|picture[ _-]*frame|(?<![a-z])scherrahmen", re.I)
_BENT = re.compile(r"over ?hang|überhang|ueberhang|bending[ _-]*length|biege ?länge", re.I)
_RUBBED = re.compile(r"friction|reib(ung|versuch|kraft|beiwert|zahl)", re.I)
#: what names of files say
_NAMES = {
    "picture-frame": re.compile(r"(?<![a-z])(picture|frame|rahmen|scher)", re.I),
    "cantilever": re.compile(r"cantilever|overhang|überhang|ueberhang|biege|biegung", re.I),
    "friction": re.compile(r"friction|reib", re.I),
}


def looks_like(path: Path, delimiter: str | None = None) -> str:
    """Name of the test that the head of the file ``path`` states, or what its columns are; empty if of none."""
    try:
        rows = read_rows(path, delimiter)[:_HEAD]
    except InputError:
        return ""
    cells = [cell for _, row in rows for cell in row if not NUMBER.match(cell)]
    if any(FRAME_SIDE.names(cell, 0) or _SHEARED.search(cell) for cell in cells):
        return "picture-frame"
    if any(_BENT.search(cell) for cell in cells):
        return "cantilever"
    if any(PLATE_LENGTH.names(cell, 0) or PLATE_WIDTH.names(cell, 0) or _RUBBED.search(cell) for cell in cells):
        return "friction"
    return ""


def stated_test(test: str | None, files: Sequence[Path], delimiter: str | None = None) -> str:
    """``test`` as a user gave it, else tensile; raises :class:`InputError` for a file that then looks like another."""
    if test is not None:
        return test
    for path in files:
        if other := looks_like(path, delimiter):
            raise InputError(f"{path}: looks like a {other} test: give --test {other}, or --test tensile if it is one")
    return "tensile"


def hinted(error: InputError, test: str, path: Path, delimiter: str | None = None) -> InputError:
    """``error`` on reading ``path`` as of ``test``, with the other test that the file or its name looks like."""
    other = looks_like(path, delimiter) or next((t for t, name in _NAMES.items() if name.search(path.stem)), "")
    if not other or other == test:
        return error
    return InputError(f"{error}; or is it a {other} test? (--test {other})")
