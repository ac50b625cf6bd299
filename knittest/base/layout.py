"""Text for the width of a terminal: tables with wrapped cells, lines with indented continuation; nothing is cut."""

import os
import re
import shutil
import textwrap
from collections.abc import Collection, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TextIO

#: characters after which a long cell may be broken
_JOINTS = re.compile(r"(?<=[/\-_=,])(?=.)")


def width_of(stream: TextIO) -> int | None:
    """Columns of a line on ``stream``: those of a terminal or of COLUMNS; None for a pipe or a file."""
    if "COLUMNS" in os.environ or stream.isatty():
        return shutil.get_terminal_size().columns
    return None


def wrap_line(line: str, width: int | None) -> list[str]:
    """Wrap ``line`` to ``width``, further lines indented; a longer word stays whole."""
    if width is None or len(line) <= width:
        return [line]
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    return textwrap.wrap(
        line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False, drop_whitespace=True
    )


def table(
    rows: Sequence[Sequence[str]], width: int | None = None, right: Collection[int] = (), indent: str = ""
) -> list[list[str]]:
    """Lines of each of ``rows`` in columns, those of ``right`` right-aligned; a table beyond ``width`` wraps."""
    gap, widths = _widths(rows, None if width is None else width - len(indent))
    return [[indent + line for line in _row_lines(row, widths, right, gap)] for row in rows]


def shorten_path(path: Path | str) -> str:
    """Path relative to the working directory, if that is shorter."""
    text = str(path)
    try:
        relative = os.path.relpath(text)
    except (OSError, ValueError):  # no working directory; another drive
        return text
    return relative if len(relative) < len(text) else text


def _widths(rows: Sequence[Sequence[str]], width: int | None) -> tuple[str, list[int]]:
    """Gap and widths of the columns; the widest ones shrink to their longest word, then below."""
    columns = list(zip(*rows, strict=True))
    natural = [max(map(len, column)) for column in columns]
    words = [max((len(word) for cell in column for word in cell.split()), default=0) for column in columns]
    parts = [max(map(len, _split_cell(" ".join(column))), default=0) for column in columns]
    for least in (words, parts):
        for gap in ("  ", " "):
            found = list(natural)
            while width is not None and sum(found) + len(gap) * (len(found) - 1) > width:
                room = [size if size > low else 0 for size, low in zip(found, least, strict=True)]
                if not any(room):
                    break
                found[room.index(max(room))] -= 1
            else:
                return gap, found
    return " ", parts


def _split_cell(cell: str) -> list[str]:
    return [part for word in cell.split() for part in _JOINTS.split(word)]


def _row_lines(row: Sequence[str], widths: Sequence[int], right: Collection[int], gap: str) -> list[str]:
    cells = [_cell_lines(cell, width) for cell, width in zip(row, widths, strict=True)]
    lines = []
    for parts in zip_longest(*cells, fillvalue=""):
        padded = (
            part.rjust(width) if column in right else part.ljust(width)
            for column, (part, width) in enumerate(zip(parts, widths, strict=True))
        )
        lines.append(gap.join(padded).rstrip())
    return lines


def _cell_lines(cell: str, width: int) -> list[str]:
    """Break ``cell`` into lines of at most ``width``, at spaces, and in a longer word at its joints."""
    lines = [""]
    for word in cell.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) <= width:
            lines[-1] += f" {word}"
            continue
        if lines[-1]:
            lines.append("")
        for part in [word] if len(word) <= width else _JOINTS.split(word):
            if len(lines[-1]) + len(part) > width and lines[-1]:
                lines.append("")
            lines[-1] += part
    return lines
