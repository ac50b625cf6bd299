"""Published results of an experiment: tidy CSV tables in a folder."""

import math
from dataclasses import dataclass
from pathlib import Path

from knittest.errors import InputError
from knittest.experiment.text import read_text, split_rows

COLUMNS = ["variant", "direction", "quantity", "mean", "sd", "n", "unit", "table"]


@dataclass(frozen=True)
class PublishedValue:
    """One printed number in ``unit``; ``sd`` and ``n`` are ``None`` where the source does not print them."""

    quantity: str
    mean: float
    sd: float | None
    n: int | None
    unit: str
    table: str


def published(folder: Path, variant: str, direction: str) -> list[PublishedValue]:
    """Rows of ``folder``'s ``table*.csv`` for a variant and a direction (``warp``, ``weft``, or empty), in file order.

    Raises :class:`InputError` for a missing folder or table, a malformed row (with file and line), or a variant
    that the tables do not know.
    """
    files = sorted(folder.glob("table*.csv"))
    if not files:
        raise InputError(f"{folder}: no table*.csv; expected a folder of published results")
    rows = [entry for file in files for entry in _read(file)]
    variants = dict.fromkeys(key for key, _, _ in rows)
    if variant not in variants:
        raise InputError(f"{folder}: unknown variant {variant!r}; the tables hold {', '.join(variants) or 'none'}")
    return [value for key, along, value in rows if key == variant and along == direction]


def one(rows: list[PublishedValue], quantity: str) -> PublishedValue:
    """The row of ``quantity``; raise :class:`InputError` when it is missing or given twice."""
    found = [row for row in rows if row.quantity == quantity]
    if len(found) != 1:
        names = ", ".join(row.quantity for row in rows) or "none"
        raise InputError(f"published results: expected {quantity} once, found it {len(found)} times among {names}")
    return found[0]


def _read(path: Path) -> list[tuple[str, str, PublishedValue]]:
    rows = split_rows(read_text(path), ",", path)
    if rows[0] != COLUMNS:
        raise InputError(f"{path}:1: columns {','.join(rows[0])}; expected {','.join(COLUMNS)}")
    return [_value(row, f"{path}:{line}") for line, row in enumerate(rows[1:], 2) if any(row)]


def _value(row: list[str], where: str) -> tuple[str, str, PublishedValue]:
    if len(row) != len(COLUMNS):
        raise InputError(f"{where}: {len(row)} cells; expected {len(COLUMNS)} ({','.join(COLUMNS)})")
    cells = dict(zip(COLUMNS, row, strict=True))
    sd = _number(cells["sd"], f"{where}: sd") if cells["sd"] else None
    n = _number(cells["n"], f"{where}: n") if cells["n"] else None
    if (sd is not None and sd < 0) or (n is not None and (n < 1 or n != int(n))):
        raise InputError(f"{where}: sd = {cells['sd']}, n = {cells['n']}; expected sd >= 0 and a whole n >= 1")
    mean = _number(cells["mean"], f"{where}: mean")
    value = PublishedValue(cells["quantity"], mean, sd, None if n is None else int(n), cells["unit"], cells["table"])
    return cells["variant"], cells["direction"], value


def _number(text: str, where: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{where} = {text!r}; expected a number with a decimal point")
    return number
