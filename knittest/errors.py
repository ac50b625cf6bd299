"""Errors and warnings that calls of knittest raise: the public names.

The message is the one that the command prints; ``exit_code`` is the one that it ends with.
"""

from knittest.base.errors import (
    InputError,
    KnittestError,
    NumericalError,
    OutOfTolerance,
    RefusedWarning,
    ResourceError,
)

__all__ = ["InputError", "KnittestError", "NumericalError", "OutOfTolerance", "RefusedWarning", "ResourceError"]
