"""Errors that reach a user as a message and an exit code, never as a traceback."""

import errno
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

OUT_OF_MEMORY = "out of memory; free some memory, raise its limit (ulimit -v) or use a smaller preset"
#: what libraries say of it
MEMORY_WORDS = ("failed to map segment from shared object", "annot allocate memory", "can't start new thread")


class KnittestError(Exception):
    """Base of all expected failures; ``exit_code`` is the process status."""

    exit_code = 1


class InputError(KnittestError):
    """Bad input: names file, line, field, value and what was expected."""

    exit_code = 2


class NumericalError(KnittestError):
    """The simulation cannot be trusted further: names the entity and the time.

    ``partial`` is what was simulated until then, if anything was.
    """

    exit_code = 3
    partial: object = None


class ResourceError(KnittestError):
    """Disk, memory, cache or a locked folder; ``folder`` is that of the run it ended, if any."""

    exit_code = 4
    folder: Path | None = None


class OutOfTolerance(KnittestError):
    """A comparison or regression is out of tolerance."""

    exit_code = 5


class RefusedWarning(UserWarning):
    """A run ended, but its gates refuse the comparison: its results do not count."""


def is_out_of_memory(error: BaseException | None) -> bool:
    """Tell whether ``error``, or what it was raised from, means that memory is short.

    A library that cannot be loaded, or a thread that cannot be started, says so in words only.
    """
    if error is None:
        return False
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    before = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    return any(words in str(error) for words in MEMORY_WORDS) or is_out_of_memory(before)


@contextmanager
def reporting_memory() -> Iterator[None]:
    """Raise :class:`ResourceError` where memory is short inside; the arrays of what was stopped are freed before."""
    try:
        yield
    except Exception as error:
        if not is_out_of_memory(error):
            raise
        traceback.clear_frames(error.__traceback__)
        raise ResourceError(OUT_OF_MEMORY) from error
