"""Reference curves: CSV with a header that says whether it was measured, digitised, reconstructed or is an input."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast, get_args

import numpy as np

from knittest.errors import InputError
from knittest.experiment.text import Rows, read_text, split_rows
from knittest.history import Array

Kind = Literal["measured", "digitised", "reconstructed", "input"]
_END = ("end_x", "end_x_sd", "end_y", "end_y_sd")


@dataclass(frozen=True)
class EndPoint:
    """Peak ``y`` over its ``x``, mean and standard deviation over the specimens: a box, not a corridor."""

    x: float
    x_sd: float
    y: float
    y_sd: float


@dataclass(frozen=True)
class ReferenceCurve:
    """A curve to compare with: ``x`` (n,) rises strictly, ``mean`` and ``sd`` (n,) are in the unit ``y_name`` ends with.

    ``sd`` is ``None`` without a corridor; ``end`` carries the scatter of the end point where only that is known.
    """

    kind: Kind
    x: Array
    mean: Array
    sd: Array | None
    x_name: str
    y_name: str
    source: str
    end: EndPoint | None = None


def load_reference(path: Path) -> ReferenceCurve:
    """Read a curve: ``# key: value`` lines (``kind`` and ``source`` required), a header row, rows of numbers.

    Columns: x, y and optionally ``<y>_sd`` and ``n``. Optional keys end_x, end_x_sd, end_y, end_y_sd make the
    :class:`EndPoint`. Raises :class:`InputError` with file and line for anything else.
    """
    text = read_text(path)
    keys = _header(text)
    kind = keys.get("kind", "")
    if kind not in get_args(Kind):
        expected = ", ".join(get_args(Kind))
        raise InputError(f"{path}:1: kind = {kind!r}; expected a header line '# kind: ...' with one of {expected}")
    if not keys.get("source"):
        raise InputError(f"{path}:1: no header line '# source: ...'; expected where the curve comes from")
    rows = split_rows(text, ",", path)
    lines = [k for k, row in enumerate(rows) if any(row) and not row[0].startswith("#")]
    if not lines:
        raise InputError(f"{path}: no header row; expected the names of x and y")
    names = rows[lines[0]]
    _check_names(names, f"{path}:{lines[0] + 1}")
    table = _table(rows, lines[1:], names, path)
    sd = table[:, 2] if f"{names[1]}_sd" in names else None
    return ReferenceCurve(
        kind, table[:, 0], table[:, 1], sd, names[0], names[1], keys["source"], _end_point(keys, path)
    )


def _header(text: str) -> dict[str, str]:
    """``# key: value`` lines before the first other line; the first of a repeated key counts."""
    keys: dict[str, str] = {}
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        key, colon, value = line[1:].partition(":")
        if colon:
            keys.setdefault(key.strip(), value.strip())
    return keys


def _check_names(names: list[str], where: str) -> None:
    allowed = ([], [f"{names[1]}_sd"], [f"{names[1]}_sd", "n"], ["n"]) if len(names) > 1 else ()
    if names[2:] not in allowed or not all(names):
        raise InputError(f"{where}: columns {','.join(names)}; expected x,y and optionally <y>_sd,n")


def _table(rows: Rows, lines: list[int], names: list[str], path: Path) -> Array:
    table = np.array([_numbers(rows[k], names, f"{path}:{k + 1}") for k in lines]).reshape(-1, len(names))
    if len(table) < 2:
        raise InputError(f"{path}: {len(table)} rows of numbers; expected at least 2")
    back = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if back.size:
        k = int(back[0]) + 1
        raise InputError(
            f"{path}:{lines[k] + 1}: {names[0]} = {table[k, 0]:g} after {table[k - 1, 0]:g}; expected it to rise"
        )
    if f"{names[1]}_sd" in names and (negative := np.flatnonzero(table[:, 2] < 0)).size:
        raise InputError(f"{path}:{lines[int(negative[0])] + 1}: {names[2]} is negative; expected a standard deviation")
    return table


def _numbers(row: list[str], names: list[str], where: str) -> list[float]:
    if len(row) != len(names):
        raise InputError(f"{where}: {len(row)} cells; expected {len(names)} ({','.join(names)})")
    numbers = []
    for name, cell in zip(names, row, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise InputError(f"{where}: {name} = {cell!r}; expected a number with a decimal point")
        numbers.append(number)
    return numbers


def _end_point(keys: dict[str, str], path: Path) -> EndPoint | None:
    given = [key for key in _END if key in keys]
    if not given:
        return None
    if len(given) < len(_END):
        raise InputError(f"{path}: header has {', '.join(given)}; expected all of {', '.join(_END)} or none")
    end = EndPoint(*_numbers([keys[key] for key in _END], list(_END), str(path)))
    if end.x_sd < 0 or end.y_sd < 0:
        raise InputError(f"{path}: end_x_sd = {end.x_sd:g}, end_y_sd = {end.y_sd:g}; expected standard deviations >= 0")
    return end
