"""Tells which test a laboratory file is of by what it says, so that no other one is taken for granted."""

from collections.abc import Sequence
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT
from knittest.experiment.lab_kind import LAB_TESTS
from knittest.experiment.lab_numbers import NUMBER
from knittest.experiment.lab_rows import read_rows

#: rows of a file that may say what it is of
_HEAD = 60


def looks_like(path: Path, delimiter: str | None = None) -> str:
    """Name of the test that the head of the file ``path`` states, or what its columns are; empty if of none."""
    try:
        rows = read_rows(path, delimiter)[:_HEAD]
    except InputError:
        return ""
    cells = [cell for _, row in rows for cell in row if not NUMBER.match(cell)]
    return next((name for name, lab in LAB_TESTS.items() if lab.looks(cells)), "")


def stated_test(test: str | None, files: Sequence[Path], delimiter: str | None = None) -> str:
    """``test`` as a user gave it, else the default one; raises :class:`InputError` for a file that then looks like
    another.
    """
    if test is not None:
        return test
    for path in files:
        if other := looks_like(path, delimiter):
            raise InputError(
                f"{path}: looks like a {other} test: give --test {other}, or --test {DEFAULT} if it is one"
            )
    return DEFAULT


def hinted(error: InputError, test: str, path: Path, delimiter: str | None = None) -> InputError:
    """``error`` on reading ``path`` as of ``test``, with the other test that the file or its name looks like."""
    named = (name for name, lab in LAB_TESTS.items() if lab.named and lab.named.search(path.stem))
    other = looks_like(path, delimiter) or next(named, "")
    if not other or other == test:
        return error
    return InputError(f"{error}; or is it a {other} test? (--test {other})")
