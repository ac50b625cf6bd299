"""Files of a user's own that have the name of a shipped one: neither is taken for the other in silence."""

from collections.abc import Iterable
from pathlib import Path


def namesake(shipped: Path, others: Iterable[Path]) -> Path | None:
    """The first of ``others`` that exists, is not ``shipped`` itself, and has other contents."""
    for other in others:
        if not other.exists() or other.samefile(shipped):
            continue
        if _read(other) not in ({}, _read(shipped)):
            return other.resolve()
    return None


def _read(path: Path) -> dict[Path, bytes]:
    """Contents of a file, or of what an experiment is read from in a folder: its tables, and curves of imports."""
    files = [*path.glob("*.csv"), *path.glob("*/corridor.csv")] if path.is_dir() else [path]
    return {file.relative_to(path): file.read_bytes() for file in files if file.is_file()}
