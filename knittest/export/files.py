"""JSON for every parser, and checkpoint files: arrays with a checksum, written whole or not at all."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.cache import Damaged, seal, unseal
from knittest.base.files import replace_file, resource_error

__all__ = ["Damaged", "json_ready", "json_text", "read_arrays", "write_arrays"]


def json_ready(value: object) -> Any:
    """Copy ``value`` with numpy types made plain, tuples made lists, and NaN and infinities made ``None``."""
    if isinstance(value, Mapping):
        return {str(key): json_ready(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [json_ready(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return json_ready(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def json_text(value: object, indent: int | None = 2) -> str:
    """Write ``value`` as JSON text with a closing newline; raises ``TypeError`` for types unknown to JSON."""
    return json.dumps(json_ready(value), indent=indent, allow_nan=False, ensure_ascii=True) + "\n"


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write ``arrays`` with their checksum to ``path``, whole or not at all; raises :class:`ResourceError`."""
    with replace_file(path) as temporary, temporary.open("wb") as stream:
        seal(stream, arrays)


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """Read the arrays of ``path``; raises :class:`Damaged` or, for a missing file, :class:`ResourceError`."""
    try:
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise resource_error(path, error) from error
    except OSError as error:
        raise Damaged(f"{path.name} cannot be read ({error.strerror})") from error
    return unseal(content, path.name)
