"""JSON that every parser reads: plain numbers, and null where a number is not finite."""

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np


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
    """``value`` as JSON text with a closing newline; raise ``TypeError`` for what JSON cannot hold."""
    return json.dumps(json_ready(value), indent=indent, allow_nan=False, ensure_ascii=True) + "\n"
