"""Reads the exports of testing machines: delimiter, decimal mark, encoding and unit row found, specimens told apart."""

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.config.yaml_loader import shown
from knittest.errors import InputError
from knittest.experiment import lab_units
from knittest.experiment.lab_gauge import agreed_gauge, stated_gauge
from knittest.experiment.lab_numbers import NUMBER, decimal_mark, read_number
from knittest.reading import read_regular

Array = NDArray[np.float64]

#: what a table of a machine stays below; together they bound memory to some 0.6 GB
MAX_BYTES, MAX_ROWS, MAX_ROW_LENGTH, MAX_HEAD = 20_000_000, 500_000, 20_000, 1000
#: strain above which unit or gauge length must be wrong [%]
MAX_STRAIN = 100.0
#: names of columns in English and German
FORCE = re.compile(r"force|kraft|load|last", re.I)
TRAVEL = re.compile(r"strain|dehnung|displacement|travel|weg|extension|elongation|verl", re.I)


@dataclass(frozen=True)
class Specimen:
    """Strain [%] and force [N] of one specimen, (n,) each."""

    name: str
    strain: Array
    force: Array


def read_lab(
    path: Path, gauge_length: float | None = None, decimal: str | None = None, delimiter: str | None = None
) -> list[Specimen]:
    """Specimens in one export; several are told apart by repeated pairs of columns.

    Columns are found by name (force or Kraft; displacement, Weg, strain or Dehnung) and unit (row or brackets); travel
    becomes strain by ``gauge_length`` [mm], by default that in the file's head. Raises :class:`InputError` with the row
    for text, gaps, a travel that does not rise, an unknown unit, a gauge length that the head contradicts, or numbers
    whose decimal mark cannot be told (pass ``decimal``).
    """
    rows = read_rows(path, delimiter)
    head = next((k for k, (_, cells) in enumerate(rows[:MAX_HEAD]) if _pairs(cells)), None)
    if head is None:
        raise InputError(f"{path}: no row names a force and a displacement or strain column")
    line, names = rows[head]
    body = rows[head + 1 :]
    below: list[str] = []
    if body and not any(NUMBER.match(cell) for cell in body[0][1] if cell):
        line, below = body[0]
        body = body[1:]
    below = _padded(below, len(names))
    _refuse_ragged(path, body, len(names))
    mark = decimal or decimal_mark(path, [cell for _, cells in body for cell in cells])
    gauge = agreed_gauge(gauge_length, stated_gauge(path, rows[:head], mark))
    pairs = _pairs(names)
    specimens = []
    for number, (travel, force) in enumerate(pairs, 1):
        name = path.stem if len(pairs) == 1 else f"{path.stem}-{number}"
        where = f"{path}:{line}"
        unit = lab_units.travel_unit(names[travel], below[travel], where)
        factors = _to_strain(unit, gauge, where), lab_units.force_factor(names[force], below[force], where)
        specimens.append(_specimen(path, name, body, (travel, force), factors, mark))
    return specimens


def _to_strain(unit: str, gauge: float | None, where: str) -> float:
    """Factor from the travel's unit to %."""
    if unit in lab_units.STRAIN:
        return lab_units.STRAIN[unit]
    if gauge is None:
        raise InputError(f"{where}: travel in {unit}, and the file states no gauge length: give --gauge-length [mm]")
    return 100.0 * lab_units.LENGTH[unit] / gauge


def read_rows(path: Path, delimiter: str | None = None) -> list[tuple[int, list[str]]]:
    """Line number and stripped cells of every line that is not empty; raises as :func:`read_lab` does."""
    text = _decode(path, read_regular(path, MAX_BYTES, "export fewer points"))
    if delimiter is None:
        counts = {mark: text.count(mark) for mark in ("\t", ";")}
        delimiter = max(counts, key=lambda mark: counts[mark]) if max(counts.values()) else ","
    if len(delimiter) != 1 or delimiter in '"\r\n':
        raise InputError(f"--delimiter {shown(delimiter)}: expected one character")
    rows: list[tuple[int, list[str]]] = []
    pulled = 0

    def lines() -> Iterator[str]:
        nonlocal pulled
        for line in io.StringIO(text):
            pulled += len(line)
            if pulled > MAX_ROW_LENGTH:
                raise InputError(
                    f"{path}:{reader.line_num + 1}: a row of more than {MAX_ROW_LENGTH} characters: not a table"
                )
            yield line

    reader = csv.reader(lines(), delimiter=delimiter)
    try:
        for number, cells in enumerate(reader):
            pulled = 0
            stripped = [c.strip() for c in cells]
            if any(stripped):
                rows.append((reader.line_num, stripped))
            if number > MAX_ROWS:
                raise InputError(f"{path}: more than {MAX_ROWS} rows; export fewer points")
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: not a table: {error}") from None
    return rows


def _decode(path: Path, raw: bytes) -> str:
    marked = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    encodings = ["utf-16"] if marked else ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise InputError(f"{path}: is not text in UTF-8, UTF-16 or Windows-1252")


def _pairs(cells: list[str]) -> list[tuple[int, int]]:
    """Columns of (travel, force), each force with the nearest travel before it, or after it if none is before."""
    forces = [k for k, c in enumerate(cells) if FORCE.search(c) and not NUMBER.match(c)]
    travels = [k for k, c in enumerate(cells) if TRAVEL.search(c) and not NUMBER.match(c) and k not in forces]
    if not forces or not travels:
        return []
    return [(max([t for t in travels if t < f] or [min(travels)]), f) for f in forces]


def _refuse_ragged(path: Path, body: list[tuple[int, list[str]]], columns: int) -> None:
    """A number torn at its own decimal comma would be read as two."""
    for line, cells in body:
        if any(cells[columns:]):
            raise InputError(
                f"{path}:{line}: {len(cells)} cells below {columns} columns: is the delimiter also the decimal mark?"
            )


def _padded(cells: list[str], n: int) -> list[str]:
    return (cells + [""] * n)[:n]


def _specimen(
    path: Path, name: str, body: list[tuple[int, list[str]]], columns: tuple[int, int],
    factors: tuple[float, float], mark: str,
) -> Specimen:  # fmt: skip
    rows = []
    ended = 0
    for line, cells in body:
        pair = [cells[k] if k < len(cells) else "" for k in columns]
        if pair == ["", ""]:
            ended = ended or line
            continue
        if ended:
            raise InputError(f"{path}:{line}: specimen {name} goes on after a gap at line {ended}")
        rows.append((line, [read_number(path, line, cell, mark) for cell in pair]))
    if len(rows) < 2:
        raise InputError(f"{path}: specimen {name} has {len(rows)} points; at least two are needed")
    values = np.array([v for _, v in rows])
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        strain, force = (values * factors).T
        falls = np.flatnonzero(np.diff(strain) <= 0.0)
    if len(falls):
        raise InputError(
            f"{path}:{rows[falls[0] + 1][0]}: specimen {name}: the travel repeats or goes back "
            f"({values[falls[0], 0]:g} then {values[falls[0] + 1, 0]:g}); {len(falls)} such rows"
        )
    if strain[-1] > MAX_STRAIN:
        raise InputError(
            f"{path}:{rows[-1][0]}: specimen {name}: a travel of {values[-1, 0]:g} would be a strain of "
            f"{strain[-1]:.4g} %: check the unit of the travel and the gauge length"
        )
    if not np.isfinite(force).all():
        raise InputError(f"{path}:{rows[int(np.argmin(np.isfinite(force)))][0]}: specimen {name}: no finite force")
    return Specimen(name, strain, force)
