"""Folder of the machine code of the kernels, the same one wherever their sources are installed.

Numba's own folders are named after the path of a source, so that of two installations of the same sources each would
compile, though the folder here is named after all that the kernels are.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from numba.core.caching import CacheImpl, _CacheLocator, _SourceFileBackedLocatorMixin

PACKAGE = Path(__file__).parent


class KernelCode(_SourceFileBackedLocatorMixin, _CacheLocator):
    """Locator of the machine code of functions of this package."""

    folder: Path | None = None

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._py_file, self._lineno = py_file, py_func.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        """One folder for all of them: Numba's file names hold module, function and line."""
        return str(self.folder)

    def get_source_stamp(self) -> str:
        """The source as it is on disk; Numba before 0.62 takes its date, which differs between installations."""
        return hashlib.sha256(Path(self._py_file).read_bytes()).hexdigest()

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> Any:
        """None where the function is not of this package or nothing is cached; Numba then looks elsewhere."""
        if cls.folder is None or Path(py_file).parent != PACKAGE:
            return None
        return super().from_function(py_func, py_file)


def keep_code_in(folder: Path) -> None:
    """Keep the code of this package's functions in ``folder``."""
    KernelCode.folder = folder
    if KernelCode not in CacheImpl._locator_classes:
        CacheImpl._locator_classes.insert(0, KernelCode)
