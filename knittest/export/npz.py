"""Arrays in a file that is whole, or known not to be: an NPZ with a checksum inside, never unpickled."""

import hashlib
import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from knittest.export.atomic import replacing, resource_error

CHECKSUM = "sha256"


class Damaged(Exception):
    """The file is not what was written; the message says what is wrong with it."""


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` with their checksum to ``path``, whole or not at all; raises :class:`ResourceError`."""
    with replacing(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **arrays, **{CHECKSUM: np.array(_checksum(arrays))})


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """The arrays of ``path``; raises :class:`Damaged` unless it is exactly what :func:`write_arrays` wrote."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise resource_error(path, error) from error
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except Exception as error:  # zip, header and array parsers raise whatever the damaged bytes lead them to
        raise Damaged(f"{path.name} cannot be read ({type(error).__name__})") from error
    stated = arrays.pop(CHECKSUM, None)
    if stated is None or str(stated) != _checksum(arrays):
        raise Damaged(f"the checksum of {path.name} is wrong")
    return arrays


def _checksum(arrays: Mapping[str, np.ndarray]) -> str:
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {arrays[name].shape} ".encode())
        digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()
