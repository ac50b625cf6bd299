"""Published results: tidy tables of means and standard deviations."""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from knittest.errors import InputError

COLUMNS = ["variant", "direction", "quantity", "mean", "sd", "n", "unit", "table"]
TENSILE = ("peak_force_n", "fracture_strain_pct")


@dataclass(frozen=True)
class PublishedValue:
    """One row: mean and standard deviation (NaN: not stated) of ``n`` specimens (0: not stated) in ``unit``."""

    quantity: str
    mean: float
    sd: float
    n: int
    unit: str
    table: str


def published(
    folder: Path, variant: str, direction: str, quantities: tuple[str, ...] = TENSILE
) -> list[PublishedValue]:
    """Rows of ``variant`` and ``direction``, or of no direction, in all tables of ``folder``, in the order of
    ``quantities``.

    Raises :class:`InputError` for a missing folder, a wrong header or a value that is no number.
    """
    found = {}
    for path, line, row in _rows(folder):
        if row["variant"] == variant and row["direction"] in (direction, "") and row["quantity"] in quantities:
            found[row["quantity"]] = _value(path, line, row)
    return [found[q] for q in quantities if q in found]


def variants(folder: Path) -> list[str]:
    """Variants that the tables of ``folder`` have rows of; raises as :func:`published` does."""
    return sorted({row["variant"] for _, _, row in _rows(folder)})


def _rows(folder: Path) -> Iterator[tuple[Path, int, dict[str, str]]]:
    """File, line and cells of every row in all tables of ``folder``."""
    files = sorted(folder.glob("*.csv"))
    if not files:
        raise InputError(f"{folder}: no tables of an experiment (*.csv) here; knittest data import writes some")
    for path in files:
        with path.open(encoding="utf-8", newline="") as stream:
            reader = csv.DictReader(stream)
            if reader.fieldnames != COLUMNS:
                raise InputError(f"{path}:1: no table of an experiment: expected the columns {','.join(COLUMNS)}")
            for row in reader:
                yield path, reader.line_num, row


def _value(path: Path, line: int, row: dict[str, str]) -> PublishedValue:
    try:
        return PublishedValue(
            row["quantity"],
            float(row["mean"]),
            float(row["sd"] or "nan"),
            int(row["n"] or 0),
            row["unit"],
            row["table"],
        )
    except ValueError as error:
        raise InputError(f"{path}:{line}: {row['quantity']}: expected numbers for mean, sd and n ({error})") from None
