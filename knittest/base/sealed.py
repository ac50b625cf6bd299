"""Arrays as the bytes of an NPZ with a checksum inside: whole, or known not to be; never unpickled."""

import hashlib
import io
from collections.abc import Mapping
from typing import IO

import numpy as np

from knittest.base.errors import is_out_of_memory

CHECKSUM = "sha256"


class Damaged(Exception):
    """The file is not what was written; the message says what is wrong with it."""


def seal(stream: IO[bytes], arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` with their checksum to ``stream``."""
    np.savez(stream, allow_pickle=False, **arrays, **{CHECKSUM: np.array(checksum(arrays))})


def unseal(content: bytes, name: str) -> dict[str, np.ndarray]:
    """The arrays in ``content`` of the file ``name``; raises :class:`Damaged` unless :func:`seal` wrote exactly it."""
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive.files}
    except Exception as error:  # zip, header and array parsers raise whatever the damaged bytes lead them to
        if is_out_of_memory(error):
            raise
        raise Damaged(f"{name} cannot be read ({type(error).__name__})") from error
    stated = arrays.pop(CHECKSUM, None)
    if stated is None or str(stated) != checksum(arrays):
        raise Damaged(f"the checksum of {name} is wrong")
    return arrays


def checksum(arrays: Mapping[str, np.ndarray]) -> str:
    """SHA-256 of names, types, shapes and bytes of ``arrays``."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {array.dtype.str} {arrays[name].shape} ".encode())
        digest.update(array.reshape(-1).view(np.uint8).data)
    return digest.hexdigest()
