"""Read the rows of tables from testing machines: text files in any encoding and workbooks, of limited size."""

import csv
import io
import json
import re
import subprocess
import sys
import unicodedata
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.base.files import read_regular
from knittest.config.yaml_loader import value_excerpt
from knittest.experiment import lab_units
from knittest.experiment.lab_units import NUMBER

#: limits of a file from a testing machine; together they limit the memory to some 0.6 GB
MAX_BYTES, MAX_ROWS, MAX_ROW_LENGTH = 20_000_000, 500_000, 20_000
BLANKS = " "
#: program that reads a workbook, limited to 2 GB where the system allows it, and its time limit [s]
_READER = """
import io, json, sys
try:
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (2**31, 2**31))
except (ImportError, ValueError, OSError):
    pass
from python_calamine import CalamineWorkbook
book = CalamineWorkbook.from_filelike(io.BytesIO(sys.stdin.buffer.read()))
sheets = [(name, book.get_sheet_by_name(name).to_python(skip_empty_area=False)) for name in book.sheet_names]
json.dump(sheets, sys.stdout, default=str)
"""
_PATIENCE = 60.0
#: encodings without a byte-order mark, the most likely first; the one with most known words is used
ENCODINGS = ("cp1252", "cp1250", "iso8859-2", "cp932", "gb18030")
#: lines from which the delimiter is found
_SAMPLE = 4000
_THOUSANDS = re.compile(r"[+-]?\d{1,3}([ '’]\d{3})+([.,]\d*)?")

#: line number and stripped cells
Row = tuple[int, list[str]]


def read_rows(path: Path, delimiter: str | None = None) -> list[Row]:
    """Return all lines of all sheets that are not empty; raises :class:`InputError` if the file is no table."""
    return [row for _, rows in read_sheets(path, delimiter) for row in rows]


def read_sheets(path: Path, delimiter: str | None = None) -> list[tuple[str, list[Row]]]:
    """Return name and rows of each sheet of a workbook; a text file is one sheet without a name."""
    raw = read_regular(path, MAX_BYTES, "export fewer points")
    if raw.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        return _read_workbook(path, raw)
    text = _normalise(_decode(path, raw))
    delimiter = _find_delimiter(text) if delimiter is None else delimiter
    if len(delimiter) != 1 or delimiter in '"\r\n':
        raise InputError(f"--delimiter {value_excerpt(delimiter)}: expected one character")
    return [("", _split_rows(path, text, delimiter))]


def _read_workbook(path: Path, raw: bytes) -> list[tuple[str, list[Row]]]:
    """Read the sheets in another process: a damaged workbook can crash the reader or use all memory."""
    try:
        read = subprocess.run([sys.executable, "-c", _READER], input=raw, capture_output=True, timeout=_PATIENCE)
        sheets = json.loads(read.stdout) if read.returncode == 0 else None
    except (subprocess.TimeoutExpired, ValueError):
        sheets = None
    if sheets is None:
        raise InputError(f"{path}: this workbook cannot be read; save it again, or export a text file (csv)")
    found = []
    for name, cells in sheets:
        if len(cells) > MAX_ROWS:
            raise InputError(f"{path}: more than {MAX_ROWS} rows; export fewer points")
        rows = [(k, [_cell(value) for value in row]) for k, row in enumerate(cells, 1)]
        found.append((str(name), [row for row in rows if any(row[1])]))
    return found


def _cell(value: Any) -> str:
    if isinstance(value, int | float):
        return "" if value != value else f"{value:.15g}"
    text = _strip_cell(_normalise(str(value)))
    if re.fullmatch(r"[+-]?\d{1,3}(\.\d{3})*,\d+|[+-]?\d+,\d+", text):  # real numbers have a point
        return text.replace(".", "").replace(",", ".")
    return "" if text in ("nan", "NaT") else text


def _split_rows(path: Path, text: str, delimiter: str) -> list[Row]:
    text = text.replace("\t", "  ") if delimiter == BLANKS else text
    for number, line in enumerate(lines := io.StringIO(text, newline=None), 1):
        if len(line) > MAX_ROW_LENGTH:
            raise InputError(f"{path}:{number}: the row exceeds {MAX_ROW_LENGTH} characters; expected a table")
    lines.seek(0)
    if delimiter == BLANKS:
        return [(number, cells) for number, line in enumerate(lines, 1) if (cells := _split_at_blanks(line.strip()))]
    rows: list[Row] = []
    reader, limit = csv.reader(lines, delimiter=delimiter, skipinitialspace=True), csv.field_size_limit(MAX_ROW_LENGTH)
    try:
        for number, cells in enumerate(reader):
            stripped = [_strip_cell(c) for c in cells]
            if any(stripped):
                rows.append((reader.line_num, stripped))
            if number > MAX_ROWS:
                raise InputError(f"{path}:{reader.line_num}: more than {MAX_ROWS} rows; export fewer points")
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: the row cannot be read: {error}") from None
    finally:
        csv.field_size_limit(limit)
    return rows


def _split_at_blanks(line: str) -> list[str]:
    """Split a line at blanks: numbers at each blank, names at two or more blanks where there are any."""
    words, wide = line.split(), re.split(r"\s{2,}", line)
    if not words or all(NUMBER.match(word) for word in words):
        return words
    stated = re.fullmatch(r"(.*?\D)\s+([+-]?\d[\d.,]*)\s*([^\d\s]\S*)?\s*", line)
    if stated and len(wide) == 1 and ":" not in line:
        return [cell or "" for cell in stated.groups()]
    return wide if len(wide) > 1 or re.search(r"[:=]", line) else words


def _find_delimiter(text: str) -> str:
    """Find the mark that splits most rows into numbers; else tab or semicolon if one occurs, else the comma."""
    sample = text[: 40 * _SAMPLE].splitlines()[:_SAMPLE]
    best, most = "", 0
    for mark in ("\t", ";", ",", BLANKS):
        score = 0
        for line in sample:
            cells = line.split() if mark == BLANKS else [c.strip(' "') for c in line[:MAX_ROW_LENGTH].split(mark)]
            filled = [c for c in cells if c]
            numbers = sum(bool(NUMBER.match(c)) and c[-1:].isdigit() for c in filled)
            if len(cells) > 1 and numbers:
                score += (10 if len(filled) > 1 else 2) if numbers == len(filled) else 1 if mark != BLANKS else 0
        if score > most:
            best, most = mark, score
    if best and not (best == BLANKS and most < 20):
        return best
    counts = {mark: text.count(mark) for mark in ("\t", ";")}
    return max(counts, key=lambda mark: counts[mark]) if max(counts.values()) else ","


def _normalise(text: str) -> str:
    """Normalise minus signs and the width of letters."""
    return text if text.isascii() else unicodedata.normalize("NFKC", text.replace("\u2212", "-").replace("…", "..."))


def _strip_cell(cell: str) -> str:
    """Remove outer blanks, and blanks or apostrophes that separate thousands."""
    cell = cell.strip()
    return re.sub("[ '’]", "", cell) if cell[:1] in "+-0123456789" and _THOUSANDS.fullmatch(cell) else cell


def _decode(path: Path, raw: bytes) -> str:
    """Decode UTF-8 or UTF-16, else use the encoding with most known words."""
    odd, even = raw[1:4000:2].count(0), raw[0:4000:2].count(0)
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings: tuple[str, ...] = ("utf-16",)
    elif odd + even > len(raw[:4000]) // 4:
        encodings, raw = ("utf-16-le" if odd > even else "utf-16-be",), raw[: len(raw) // 2 * 2]
    else:
        encodings = ("utf-8-sig",) if _try_decode(raw, "utf-8-sig") else ENCODINGS
    found = [text for encoding in encodings if (text := _try_decode(raw, encoding))]
    if not found and raw:
        raise InputError(f"{path}: unknown text encoding; save the file as UTF-8")
    best = max(found, key=lab_units.count_known, default="")
    if len(found) > 1 and not lab_units.count_known(best):
        from charset_normalizer import from_bytes

        guess = from_bytes(raw[:200_000]).best()
        return (guess and _try_decode(raw, guess.encoding)) or best
    return best


def _try_decode(raw: bytes, encoding: str) -> str:
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        return ""
    return "" if "\0" in text else text
