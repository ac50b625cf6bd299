"""A machine's table taken apart: head, names of columns, units, body; and its columns as numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_numbers import NUMBER, decimal_mark, read_number
from knittest.experiment.lab_rows import Row, read_rows

Array = NDArray[np.float64]

MAX_HEAD = 1000


@dataclass(frozen=True)
class LabTable:
    """Rows above the table, the row of ``names`` at ``line`` with the ``units`` below it, and the rows of numbers."""

    path: Path
    head: list[Row]
    line: int
    names: list[str]
    units: list[str]
    body: list[Row]
    mark: str

    @property
    def where(self) -> str:
        """File and line of the names or of the units below them."""
        return f"{self.path}:{self.line}"

    def number(self, line: int, cell: str) -> float:
        """The number in ``cell`` of ``line``; raises :class:`InputError`."""
        return read_number(self.path, line, cell, self.mark)


def read_table(
    path: Path, is_names: Callable[[list[str]], bool], wanted: str, decimal: str | None, delimiter: str | None
) -> LabTable:
    """The table whose row of names satisfies ``is_names``; ``wanted`` says in messages what that row names.

    Raises :class:`InputError` for no such row, rows longer than it, and a decimal mark that cannot be told.
    """
    rows = read_rows(path, delimiter)
    head = next((k for k, (_, cells) in enumerate(rows[:MAX_HEAD]) if is_names(cells)), None)
    if head is None:
        raise InputError(f"{path}: no row names {wanted}")
    line, names = rows[head]
    body = rows[head + 1 :]
    below: list[str] = []
    if body and not any(NUMBER.match(cell) for cell in body[0][1] if cell):
        line, below = body[0]
        body = body[1:]
    _refuse_ragged(path, body, len(names))
    mark = decimal or decimal_mark(path, [cell for _, cells in body for cell in cells])
    units = (below + [""] * len(names))[: len(names)]
    return LabTable(path, rows[:head], line, names, units, body, mark)


def columns(table: LabTable, which: Sequence[int], name: str) -> tuple[list[int], Array]:
    """Lines (n) and numbers (n, columns) of the columns ``which`` up to where they end; ``name`` is for messages.

    Raises :class:`InputError` with the row for text, gaps and fewer than two rows.
    """
    lines, rows = [], []
    ended = 0
    for line, cells in table.body:
        found = [cells[k] if k < len(cells) else "" for k in which]
        if not any(found):
            ended = ended or line
            continue
        if ended:
            raise InputError(f"{table.path}:{line}: specimen {name} goes on after a gap at line {ended}")
        lines.append(line)
        rows.append([table.number(line, cell) for cell in found])
    if len(rows) < 2:
        raise InputError(f"{table.path}: specimen {name} has {len(rows)} points; at least two are needed")
    return lines, np.array(rows)


def with_nearest(moves: Sequence[int], forces: Sequence[int]) -> list[tuple[int, int]]:
    """Columns of (travel, force): each of ``forces`` with the nearest of ``moves`` before it, else the first of all."""
    if not moves:
        return []
    return [(max([m for m in moves if m < f] or [min(moves)]), f) for f in forces]


def refuse_shared(table: LabTable, pairs: Sequence[tuple[int, int]]) -> None:
    """Raise :class:`InputError` for two forces over one travel: of one specimen they would count as two."""
    first: dict[int, int] = {}
    for move, force in pairs:
        if move in first:
            one, other, over = (table.names[k] for k in (first[move], force, move))
            raise InputError(
                f"{table.where}: columns {one!r} and {other!r} are both over {over!r}: two forces of one specimen? "
                "Leave one out; of two specimens each needs its own travel beside its force"
            )
        first[move] = force


def _refuse_ragged(path: Path, body: list[Row], width: int) -> None:
    """A number torn at its own decimal comma would be read as two."""
    for line, cells in body:
        if any(cells[width:]):
            raise InputError(
                f"{path}:{line}: {len(cells)} cells below {width} columns: is the delimiter also the decimal mark?"
            )
