"""Reads the exports of testing machines: delimiter, decimal mark, encoding and unit row found, specimens told apart."""

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.errors import InputError

Array = NDArray[np.float64]

MAX_BYTES = 50_000_000
#: names of columns in English and German, and units with the factor to N, mm and %
FORCE = re.compile(r"force|kraft|load|last", re.I)
TRAVEL = re.compile(r"strain|dehnung|displacement|travel|weg|extension|elongation|verl", re.I)
UNITS = {"n": 1.0, "kn": 1e3, "cn": 1e-2, "mn": 1e-3, "mm": 1.0, "cm": 10.0, "um": 1e-3, "µm": 1e-3, "%": 1.0, "": 1.0}
NUMBER = re.compile(r"[+-]?[\d.,]*\d[\d.,]*(e[+-]?\d+)?$", re.I)


@dataclass(frozen=True)
class Specimen:
    """Strain [%] and force [N] of one specimen, (n,) each."""

    name: str
    strain: Array
    force: Array


def read_lab(
    path: Path, gauge_length: float, decimal: str | None = None, delimiter: str | None = None
) -> list[Specimen]:
    """Specimens in one export; several are told apart by repeated pairs of columns.

    Columns are found by name (force or Kraft; displacement, Weg, strain or Dehnung) and unit (row or brackets); travel
    in mm becomes strain by ``gauge_length`` [mm]. Raises :class:`InputError` with the row for text, gaps, a travel that
    does not rise, or numbers whose decimal mark cannot be told (pass ``decimal``).
    """
    rows = _rows(path, delimiter)
    head = next((k for k, (_, cells) in enumerate(rows) if _pairs(cells)), None)
    if head is None:
        raise InputError(f"{path}: no row names a force and a displacement or strain column")
    names = rows[head][1]
    body = rows[head + 1 :]
    units = [_unit_of(name) for name in names]
    if body and not any(NUMBER.match(cell) for cell in body[0][1] if cell):
        units = [_clean_unit(cell) or unit for cell, unit in zip(_padded(body[0][1], len(names)), units, strict=True)]
        body = body[1:]
    mark = decimal or _decimal_mark(path, [cell for _, cells in body for cell in cells])
    pairs = _pairs(names)
    specimens = []
    for number, (travel, force) in enumerate(pairs, 1):
        name = path.stem if len(pairs) == 1 else f"{path.stem}-{number}"
        specimens.append(
            _specimen(path, name, body, (travel, units[travel]), (force, units[force]), mark, gauge_length)
        )
    return specimens


def _rows(path: Path, delimiter: str | None) -> list[tuple[int, list[str]]]:
    """Line number and stripped cells of every line that is not empty."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"{path}: larger than {MAX_BYTES // 1_000_000} MB; export fewer points")
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    text = _decode(path, raw)
    if delimiter is None:
        counts = {mark: text.count(mark) for mark in ("\t", ";")}
        delimiter = max(counts, key=lambda mark: counts[mark]) if max(counts.values()) else ","
    reader = csv.reader(io.StringIO(text), delimiter=delimiter)
    try:
        return [(reader.line_num, [c.strip() for c in cells]) for cells in reader if any(c.strip() for c in cells)]
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: not a table: {error}") from None


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


def _unit_of(name: str) -> str:
    found = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]|\bin\s+(\S+)$", name)
    return _clean_unit((found[1] or found[2]) if found else "")


def _clean_unit(text: str) -> str:
    unit = text.strip("[]() ").lower()
    return unit if unit in UNITS else ""


def _padded(cells: list[str], n: int) -> list[str]:
    return (cells + [""] * n)[:n]


def _decimal_mark(path: Path, cells: list[str]) -> str:
    """The decimal mark of an export; refuses to guess when every number could be in thousands."""
    numbers = [c for c in cells if c and NUMBER.match(c) and re.search(r"[.,]", c)]
    for mark, other in ((",", "."), (".", ",")):
        if any(other in c and mark in c and c.rindex(mark) > c.rindex(other) for c in numbers):
            return mark
    marks = {m for c in numbers for m in ".," if m in c}
    if len(marks) == 2:
        raise InputError(f"{path}: both '.' and ',' appear as decimal marks; say which with --decimal")
    if not marks:
        return "."
    mark = marks.pop()
    if all(re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+", c) for c in numbers):
        raise InputError(
            f"{path}: {numbers[0]!r} could be a thousand or a decimal; say which with --decimal . or --decimal ,"
        )
    return mark


def _specimen(
    path: Path, name: str, body: list[tuple[int, list[str]]], travel: tuple[int, str], force: tuple[int, str],
    mark: str, gauge_length: float,
) -> Specimen:  # fmt: skip
    rows = []
    ended = 0
    for line, cells in body:
        pair = [_padded(cells, max(travel[0], force[0]) + 1)[k] for k in (travel[0], force[0])]
        if pair == ["", ""]:
            ended = ended or line
            continue
        if ended:
            raise InputError(f"{path}:{line}: specimen {name} goes on after a gap at line {ended}")
        rows.append((line, [_number(path, line, cell, mark) for cell in pair]))
    if len(rows) < 2:
        raise InputError(f"{path}: specimen {name} has {len(rows)} points; at least two are needed")
    values = np.array([v for _, v in rows])
    strain = values[:, 0] * UNITS[travel[1]] * (1.0 if travel[1] == "%" else 100.0 / gauge_length)
    falls = np.flatnonzero(np.diff(strain) <= 0.0)
    if len(falls):
        raise InputError(
            f"{path}:{rows[falls[0] + 1][0]}: specimen {name}: the travel repeats or goes back "
            f"({values[falls[0], 0]:g} then {values[falls[0] + 1, 0]:g}); {len(falls)} such rows"
        )
    return Specimen(name, strain, values[:, 1] * UNITS[force[1]])


def _number(path: Path, line: int, cell: str, mark: str) -> float:
    plain = cell.replace("." if mark == "," else ",", "").replace(mark, ".")
    if not NUMBER.match(cell) or plain.count(".") > 1:
        raise InputError(f"{path}:{line}: {cell!r} is not a number with decimal mark {mark!r}")
    try:
        value = float(plain)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{path}:{line}: {cell!r} is not a finite number")
    return value
