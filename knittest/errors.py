"""Public errors and warnings; the command prints the same messages and exits with ``exit_code``."""

from knittest.base.errors import (
    InputError,
    KnittestError,
    NumericalError,
    OutOfTolerance,
    RefusedWarning,
    ResourceError,
)

__all__ = ["InputError", "KnittestError", "NumericalError", "OutOfTolerance", "RefusedWarning", "ResourceError"]
