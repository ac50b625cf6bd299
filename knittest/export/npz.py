"""Checkpoint files: arrays with a checksum inside, written whole or not at all."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from knittest.base.atomic import replacing, resource_error
from knittest.base.sealed import Damaged, seal, unseal

__all__ = ["Damaged", "read_arrays", "write_arrays"]


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` with their checksum to ``path``, whole or not at all; raises :class:`ResourceError`."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        seal(stream, arrays)


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """The arrays of ``path``; raises :class:`Damaged` unless it is exactly what :func:`write_arrays` wrote, and
    :class:`ResourceError` if it is not there.
    """
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise resource_error(path, error) from error
    except OSError as error:
        raise Damaged(f"{path.name} cannot be read ({error.strerror})") from error
    return unseal(content, path.name)
