"""Errors that reach a user as a message and an exit code, never as a traceback."""

from pathlib import Path


class KnittestError(Exception):
    """Base of all expected failures; ``exit_code`` is the process status."""

    exit_code = 1


class InputError(KnittestError):
    """Bad input: names file, line, field, value and what was expected."""

    exit_code = 2


class NumericalError(KnittestError):
    """The simulation cannot be trusted further: names the entity and the time."""

    exit_code = 3


class ResourceError(KnittestError):
    """Disk, memory, cache or a locked folder; ``folder`` is that of the run it ended, if any."""

    exit_code = 4
    folder: Path | None = None


class OutOfTolerance(KnittestError):
    """A comparison or regression is out of tolerance."""

    exit_code = 5


class RefusedWarning(UserWarning):
    """A run ended, but its gates refuse the comparison: its results do not count."""
