"""Rows of the text tables that testing machines write: encoding and delimiter found, size bounded."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.reading import read_regular
from knittest.config.yaml_loader import shown

#: what a table of a machine stays below; together they bound memory to some 0.6 GB
MAX_BYTES, MAX_ROWS, MAX_ROW_LENGTH = 20_000_000, 500_000, 20_000

#: line number and stripped cells
Row = tuple[int, list[str]]


def read_rows(path: Path, delimiter: str | None = None) -> list[Row]:
    """Every line that is not empty; raises :class:`InputError` for what is no table."""
    text = _decode(path, read_regular(path, MAX_BYTES, "export fewer points"))
    if delimiter is None:
        counts = {mark: text.count(mark) for mark in ("\t", ";")}
        delimiter = max(counts, key=lambda mark: counts[mark]) if max(counts.values()) else ","
    if len(delimiter) != 1 or delimiter in '"\r\n':
        raise InputError(f"--delimiter {shown(delimiter)}: expected one character")
    rows: list[Row] = []
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
