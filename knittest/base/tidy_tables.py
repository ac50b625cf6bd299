"""Tidy tables of an experiment: one number a row, as imports write and everyone reads them."""

import csv
from collections.abc import Iterator
from pathlib import Path

from knittest.base.errors import InputError

COLUMNS = ["variant", "direction", "quantity", "mean", "sd", "n", "unit", "table"]


def variants(folder: Path) -> list[str]:
    """Variants that the tables of ``folder`` have rows of; raises as :func:`tidy_rows` does."""
    return sorted({row["variant"] for _, _, row in tidy_rows(folder)})


def tidy_rows(folder: Path) -> Iterator[tuple[Path, int, dict[str, str]]]:
    """File, line and cells of every row in all tables of ``folder``.

    Raises :class:`InputError` for a folder without tables and for a wrong header.
    """
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
