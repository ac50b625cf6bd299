"""Text of a CSV file from anywhere: size limit, byte order marks, UTF-8, UTF-16 and Windows encodings."""

import codecs
import csv
import io
import stat
from pathlib import Path

from knittest.errors import InputError

#: a tensile test of 20 specimens at 100 Hz is about 4 MB; far beyond that a file is not what its name says
MAX_BYTES = 32 * 1024 * 1024
MAX_COLUMNS = 1000

Rows = list[list[str]]


def read_text(path: Path, max_bytes: int = MAX_BYTES) -> str:
    """Decode the regular file ``path``; raise :class:`InputError` when it is missing, too large, empty or binary."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{path}: expected a regular file")
        if status.st_size > max_bytes:
            raise InputError(
                f"{path}: {status.st_size / 2**20:.0f} MiB; expected a CSV of at most {max_bytes >> 20} MiB"
            )
        with path.open("rb") as stream:
            data = stream.read(max_bytes + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"{path}: cannot read: {reason}") from None
    text = _decode(data, path)
    if not text.strip():
        raise InputError(f"{path}: the file is empty")
    return text


def split_rows(text: str, delimiter: str, path: Path) -> Rows:
    """Cells of each line, stripped; row k of the result is line k + 1 unless quoted cells hold line breaks."""
    rows: Rows = []
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    try:
        for row in reader:
            if len(row) > MAX_COLUMNS:
                raise InputError(f"{path}:{reader.line_num}: {len(row)} columns; expected at most {MAX_COLUMNS}")
            # a quoted line break must not shift the row numbers of the messages
            rows.extend([] for _ in range(reader.line_num - 1 - len(rows)))
            rows.append([cell.strip() for cell in row])
    except csv.Error as error:
        raise InputError(f"{path}:{reader.line_num}: not a readable CSV: {error}") from None
    return rows


def _decode(data: bytes, path: Path) -> str:
    for mark, encoding in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if data.startswith(mark):
            return _strict(data, encoding, path)
    if b"\0" in data[:4096]:
        return _strict(data, _utf16_without_mark(data, path), path)
    try:
        return _strict(data, "utf-8", path)
    except InputError:
        return _strict(data, "cp1252", path)


def _utf16_without_mark(data: bytes, path: Path) -> str:
    """Western text as UTF-16 has its zero bytes at odd (little endian) or even (big endian) places only."""
    odd, even = data[1:4096:2].count(0), data[:4096:2].count(0)
    if odd > 0.5 * len(data[1:4096:2]) and even == 0:
        return "utf-16-le"
    if even > 0.5 * len(data[:4096:2]) and odd == 0:
        return "utf-16-be"
    raise InputError(f"{path}: not a text file (zero bytes); expected CSV in UTF-8, UTF-16 or Windows-1252")


def _strict(data: bytes, encoding: str, path: Path) -> str:
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: byte {error.start} is not {encoding}; expected UTF-8, UTF-16 or Windows-1252"
        ) from None
    if "\0" in text:
        raise InputError(f"{path}: not a text file (zero bytes); expected CSV in UTF-8, UTF-16 or Windows-1252")
    return text
