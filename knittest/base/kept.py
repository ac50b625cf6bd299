"""Arrays kept in the cache under a key of all that they follow from: the same arrays again, or none."""

import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from knittest.base.sealed import Damaged, seal, unseal

KEY = "key"


def kept(path: Path | None, key: str) -> dict[str, np.ndarray] | None:
    """The arrays that :func:`keep` wrote to ``path``; None if there are none.

    Raises :class:`Damaged` for a file that is not what was written, or that belongs to another ``key``.
    """
    if path is None:
        return None
    try:
        content = path.read_bytes()
    except OSError:
        return None
    arrays = unseal(content, path.name)
    if str(arrays.pop(KEY, "")) != key:
        raise Damaged(f"{path.name} is the cell of other inputs")
    return arrays


def keep(path: Path | None, key: str, arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` whole or not at all; if the disk refuses, they are only computed again."""
    if path is None:
        return
    temporary: Path | None = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as stream:
            temporary = Path(stream.name)
            seal(stream, {KEY: np.array(key), **arrays})
        temporary.replace(path)
    except OSError:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()
