"""Errors that reach the user as a message and an exit code, never as a traceback."""

import errno
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

OUT_OF_MEMORY = "out of memory: free memory, raise the limit (ulimit -v) or use a smaller preset"
#: words of libraries for it
MEMORY_WORDS = ("failed to map segment from shared object", "annot allocate memory", "can't start new thread")


class KnittestError(Exception):
    """Base of all expected errors; ``exit_code`` is the process status."""

    exit_code = 1


class InputError(KnittestError):
    """Bad input; the message names file, line, field, value and expectation."""

    exit_code = 2


class NumericalError(KnittestError):
    """Failed simulation; the message names entity and time, ``partial`` is its result until then, if any."""

    exit_code = 3
    partial: object = None


class ResourceError(KnittestError):
    """Fault of disk, memory, cache or a locked folder; ``folder`` is that of the failed run, if any."""

    exit_code = 4
    folder: Path | None = None


class OutOfTolerance(KnittestError):
    """Comparison or regression out of tolerance."""

    exit_code = 5


class RefusedWarning(UserWarning):
    """Warning about a run that failed its quality checks: its results are not compared with the experiment."""


def is_out_of_memory(error: BaseException | None) -> bool:
    """Tell whether ``error``, or its cause, means that memory is short; some libraries say so in words only."""
    if error is None:
        return False
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.ENOMEM):
        return True
    before = error.__cause__ or (None if error.__suppress_context__ else error.__context__)
    return any(words in str(error) for words in MEMORY_WORDS) or is_out_of_memory(before)


@contextmanager
def report_memory_shortage() -> Iterator[None]:
    """Raise :class:`ResourceError` if memory is short inside the block, after freeing the arrays of the block."""
    try:
        yield
    except Exception as error:
        if not is_out_of_memory(error):
            raise
        traceback.clear_frames(error.__traceback__)
        raise ResourceError(OUT_OF_MEMORY) from error
