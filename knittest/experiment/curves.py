"""Reference curves: CSV files whose header says what kind of curve they hold."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from knittest.errors import InputError

Array = NDArray[np.float64]
Kind = Literal["measured", "digitised", "reconstructed", "input"]


@dataclass(frozen=True)
class ReferenceCurve:
    """Curve ``mean`` over ``x``, (n,) each, with its scatter ``sd`` if known; names hold the units."""

    kind: Kind
    x: Array
    mean: Array
    sd: Array | None
    x_name: str
    y_name: str
    source: str


def load_curve(path: Path) -> ReferenceCurve:
    """Read a curve CSV: ``# kind: ...`` comment lines, a header row, then x, y and optionally the sd of y.

    Raises :class:`InputError` naming file and line for an unknown kind, text, NaN or an x that does not rise.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot read the curve: {error}") from None
    notes = {}
    for line in lines:
        if line.startswith("#"):
            key, _, value = line[1:].partition(":")
            notes[key.strip()] = value.strip()
    kind = notes.get("kind", "")
    if kind not in get_args(Kind):
        raise InputError(f"{path}:1: # kind: {kind or 'missing'}; expected one of {', '.join(get_args(Kind))}")
    body = [(n, line) for n, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if len(body) < 3:
        raise InputError(f"{path}: a curve needs a header and at least two points")
    names = body[0][1].split(",")
    rows = np.array([_row(path, n, line, len(names)) for n, line in body[1:]])
    falls = np.flatnonzero(np.diff(rows[:, 0]) <= 0.0)
    if len(falls):
        raise InputError(f"{path}:{body[falls[0] + 2][0]}: {names[0]} must rise from row to row")
    sd = rows[:, 2] if rows.shape[1] > 2 else None
    return ReferenceCurve(kind, rows[:, 0], rows[:, 1], sd, names[0], names[1], notes.get("source", path.name))  # type: ignore[arg-type]


def _row(path: Path, number: int, line: str, columns: int) -> list[float]:
    cells = line.split(",")
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        values = []
    if len(cells) != columns or len(values) != columns or not np.isfinite(values).all():
        raise InputError(f"{path}:{number}: {line!r}: expected {columns} finite numbers")
    return values
