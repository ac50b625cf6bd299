"""Tables in files of testing machines: column names, units, numbers, and the conditions above them."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.yaml_loader import value_excerpt
from knittest.experiment import lab_units
from knittest.experiment.lab_rows import Row, read_sheets
from knittest.experiment.lab_units import NUMBER, decimal_mark, has_number, number, read_number

Array = NDArray[np.float64]
Sign = Literal["positive", "negative"]
Preload = Literal["subtract", "keep"]
Clamped = Literal["sides", "far"]
Loading = Literal["first", "cycles"]
#: groups of roles; a test needs one role of each group
Wanted = Sequence[tuple[str, ...]]
#: rows above a table that are read, and rows of a table below which a block of one row may count
MAX_HEAD, SHORT = 1000, 10
#: share of falling steps from which a rising travel has noise; rounded values repeat, but do not fall
FALLING = 0.03
#: a travel has returned within this share of its range, if the range is this multiple of its noise
ENDED, CLEAR = 0.1, 20.0
#: a number, also with its unit
_STATED = re.compile(r"[+-]?\d[\d.,]*\s?\D{0,8}")
#: roles of which a specimen has one
LEADING = ("force", "pressure", "coefficient", "overhang")
#: advice for a file without known column names where the command has no options for them
RENAME = "write a header row such as strain_pct,force_n above the numbers, or use corridor.csv of knittest data import"
#: number of unnamed columns up to which roles are guessed
FEW = 20


def noise(values: Array) -> float:
    """Standard deviation of the noise of ``values`` (n,) by second differences; 0 if they hardly ever fall."""
    with np.errstate(over="ignore", invalid="ignore"):
        if len(values) < 8 or np.count_nonzero(np.diff(values) < 0.0) < FALLING * len(values):
            return 0.0
        return float(1.4826 * np.median(np.abs(np.diff(values, 2))) / np.sqrt(6.0))


@dataclass(frozen=True)
class ReadOptions:
    """Options of the user on format, conditions by key, and meaning of the curve; ``None``: not stated.

    ``columns`` are the roles of all columns in order, ``named`` those of columns by their names in lower case;
    ``has_column_options``: the command has options that state them.
    """

    decimal: str | None = None
    delimiter: str | None = None
    sign: Sign = "positive"
    sizes: Mapping[str, float] = field(default_factory=dict)
    zero: float | None = None
    preload: Preload | None = None
    faces: int = 2
    clamped: Clamped | None = None
    loading: Loading | None = None
    columns: tuple[str, ...] = ()
    named: Mapping[str, str] = field(default_factory=dict)
    has_column_options: bool = True


@dataclass
class LabTable:
    """One table at ``place``: column ``names`` and ``roles`` at ``line``, ``units`` below, rows of numbers, rows above
    as ``head``, the ``count`` of specimens and ``notes`` on skipped rows.
    """

    place: str
    head: list[Row]
    line: int
    names: list[str]
    units: list[str]
    body: list[Row]
    mark: str
    roles: list[str]
    notes: list[str] = field(default_factory=list)
    count: int = 1

    @property
    def header_place(self) -> str:
        """File and line of the column names, or of the units below them."""
        return f"{self.place}:{self.line}"

    def numbers(self, which: Sequence[int]) -> Array:
        """Read the columns ``which`` (n, columns), nan for empty cells; raises :class:`InputError` for a text."""
        values = np.full((len(self.body), len(which)), np.nan)
        for at, (line, row) in enumerate(self.body):
            for place, column in enumerate(which):
                if column < len(row) and has_number(row[column]):
                    values[at, place] = read_number(self.place, line, row[column], self.mark)
        return values

    def columns_of_roles(self, *roles: str) -> list[int]:
        """Columns of any of ``roles``, in their order."""
        return [k for k, role in enumerate(self.roles) if role in roles]

    def unit(self, column: int, units: Mapping[str, float]) -> str:
        """Unit of a column; raises :class:`InputError` for one that is not in ``units``."""
        return lab_units.find_stated_unit(self.names[column], self.units[column], units, self.header_place)


def read_tables(path: Path, given: ReadOptions, wanted: Wanted, words: str, own: tuple[str, ...]) -> list[LabTable]:
    """Read the tables of a file with a column of each of the ``wanted`` roles, named by ``words``, of ``own`` tests."""
    sheets = read_sheets(path, given.delimiter)
    found: list[LabTable] = []
    others: list[Row] = []
    for sheet, rows in sheets:
        tables = _find_tables(rows, f"{path}, sheet {sheet!r}" if len(sheets) > 1 else str(path), given, wanted)
        found += tables
        others += [] if tables else rows
    for k, table in enumerate(found):
        table.head = table.head + others + _conditions_in_columns(table.head + others, k, len(found))
        _refuse_foreign(path, table.head, table.names, own)
        table.mark = given.decimal or decimal_mark(path, [cell for _, row in table.body for cell in row])
    if not found:
        _refuse_foreign(path, others, [], own)
        raise _missing_names_error(str(path), others, wanted, words, given)
    return found


def _find_roles(names: Sequence[str], units: Sequence[str], given: ReadOptions) -> list[str]:
    """Roles of columns: stated by the user, with no other column of that role, else by the table of names."""
    found = []
    for name, below in zip(names, units, strict=True):
        bare = re.split(r"[\[(]", name)[0].strip().lower()
        role = given.named.get(name.strip().lower()) or given.named.get(bare, "")
        if not role and name and not NUMBER.match(name):
            key = bare.replace(" ", "_")
            is_role = given.columns and key in lab_units.name_table()["columns"]
            role = key if is_role else lab_units.find_role(name, below)[0]
            role = "" if role in given.named.values() else role
        found.append(role)
    means = {k for k, name in enumerate(names) if lab_units.matches(name, "kinds", "mean")}
    beside = [role for k, role in enumerate(found) if k not in means]
    left = means  # of several specimens; of two sensors the mean counts
    if sum(role in LEADING for role in beside) == 1:
        left = {k for k in means if found[k] in LEADING}
        left |= {k for k, role in enumerate(found) if k not in means and role in {found[m] for m in means - left}}
    return ["result" if k in left and role in beside else role for k, role in enumerate(found)]


def _missing_roles(roles: Sequence[str], wanted: Wanted) -> list[str]:
    """Return the most likely role for each of ``wanted`` that no column has."""
    return ["travel" if "travel" in some else some[0] for some in wanted if not set(some) & set(roles)]


def _find_tables(rows: list[Row], place: str, given: ReadOptions, wanted: Wanted) -> list[LabTable]:
    rows = _insert_names(rows, given.columns, place) if given.columns else rows
    found: list[LabTable] = []
    k = end = 0

    def names_all(cells: list[str]) -> bool:
        texts = [cell for cell in cells if cell and not NUMBER.match(cell)]
        return 2 * len(texts) > sum(map(bool, cells)) and not _missing_roles(
            _find_roles(cells, [""] * len(cells), given), wanted
        )

    while k < len(rows):
        names = rows[k][1]
        if not names_all(names):
            k += 1
            continue
        first, units, line = _find_units(rows, k)
        roles = _find_roles(names, units, given)
        if _missing_roles(roles, wanted):
            for name, below in zip(names, units, strict=True):  # of a wanted name, and a unit of another quantity?
                _, role = lab_units.find_role(name, below)
                if role in ("force", "overhang", "thickness", "pressure") and role in sum(wanted, ()):
                    quantity = lab_units.name_table()["columns"][role]["quantity"][0]
                    lab_units.find_stated_unit(name, below, lab_units.QUANTITIES[quantity], f"{place}:{line}")
            k += 1
            continue
        needed = [c for c, role in enumerate(roles) if role in sum(wanted, ())]
        own = {cells[0] for _, cells in rows[end:k] if len(cells) > 1}
        shared = found[0].head if found else []
        head = [*(row for row in shared if row[1][0] not in own), *rows[end:k]][-MAX_HEAD:]
        blocks, k, notes, between = _split_blocks(rows, first, needed, names_all)
        last = blocks[-1][-1][0] if blocks[-1] else line
        end = next((n for n in range(first, k) if rows[n][0] > last), k)
        for block in blocks:
            table = LabTable(place, head, line, names, units, block, ".", roles, notes)
            for at, cells in block:  # a number split at its decimal comma would be read as two
                if any(cells[len(names) :]):
                    message = f"{place}:{at}: {len(cells)} cells below {len(names)} columns"
                    raise InputError(f"{message}; export with a delimiter that is not the decimal mark")
            if found and found[-1].names == names and _continues(found[-1], table):
                ends = found[-1].body[-1][0], block[0][0]
                lost = [_skipped(row) for row in between if ends[0] < row[0] < ends[1]]
                found[-1].notes = [*found[-1].notes, *lost]
                found[-1].body += block
            else:
                found.append(table)
    longest = max((len(table.body) for table in found), default=0)
    names = next((table.names for table in found if len(table.body) == longest), [])
    kept = [table for table in found if table.names == names and (len(table.body) > 1 or longest < SHORT)]
    return [part for table in kept for part in _split_by_specimen(table)] if len(wanted) > 1 else kept


def _split_by_specimen(table: LabTable) -> list[LabTable]:
    """Split a ``table`` whose recordings follow each other, if a column names their specimens."""
    for k in table.columns_of_roles("specimen"):
        labels = [cells[k] if k < len(cells) else "" for _, cells in table.body]
        starts = [0, *(row for row, (one, other) in enumerate(pairwise(labels), 1) if one != other), len(labels)]
        parts = [replace(table, body=table.body[start:end]) for start, end in pairwise(starts)]
        if all(len(part.body) > 2 for part in parts) and not any(_continues(*two) for two in pairwise(parts)):
            return parts
    return [table]


def _find_units(rows: list[Row], k: int) -> tuple[int, list[str], int]:
    """Find the row of the first numbers below the names in row ``k``, the units, and the line of units or names."""
    line, names = rows[k]
    below: list[tuple[int, int]] = []
    for at in range(k + 1, min(k + 4, len(rows))):
        cells = rows[at][1]
        if any(NUMBER.match(cell) for cell in cells if cell) or cells == names:
            break
        if sum(map(bool, cells)) > 1 or len([n for n in names if n]) == 1 or all(map(lab_units.is_unit, cells)):
            below.append((-sum(bool(cell) and lab_units.is_unit(cell) for cell in cells), at))
    if not below or (len(names) == 1 and lab_units.is_statistic(rows[below[0][1]][1][0])):
        return k + 1, [""] * len(names), line
    _, at = min(below)
    return max(b for _, b in below) + 1, (rows[at][1] + [""] * len(names))[: len(names)], rows[at][0]


def _split_blocks(
    rows: list[Row], first: int, needed: list[int], names_all: Callable[[list[str]], bool]
) -> tuple[list[list[Row]], int, list[str], list[Row]]:
    """Split rows from ``first`` on at gaps and texts.

    Returns blocks, the row after them, notes on skipped rows, and texts between blocks. These are titles of recordings,
    or rows of one recording that cannot be read.
    """
    blocks: list[list[Row]] = [[]]
    left: list[Row] = []
    between: list[Row] = []
    ended, k = False, first
    while k < len(rows):
        line, cells = rows[k]
        texts = [c for c in cells if c and not NUMBER.match(c) and has_number(c)]
        alone = len(texts) == sum(map(bool, cells))
        if texts and alone and names_all(cells):
            break
        k += 1
        numbered = not texts or any(NUMBER.match(cells[c]) for c in needed if c < len(cells))
        if any(map(lab_units.is_statistic, texts)) or ended:
            ended = ended or sum(map(bool, cells)) == 1
            left.append((line, cells))
        elif numbered or len(needed) == len(rows[first][1]) == 1:
            if blocks[-1] and line > blocks[-1][-1][0] + 1:
                blocks.append([])
            blocks[-1].append((line, cells))
        elif (alone and len(texts) > 1) or not blocks[-1]:
            ended = alone and len(texts) > 1  # names of another table
            left.append((line, cells))
        else:
            blocks.append([])
            between.append((line, cells))
    for block in blocks if 0 in needed else ():  # labels below the last row of numbers
        while len(block) > 1 < len(block[-1][1]) and has_number(cell := block[-1][1][0]) and not NUMBER.match(cell):
            left.append(block.pop())
    notes = [_skipped(row) for row in left]
    more = [f"{len(notes) - 3} more line{'s' * (len(notes) > 4)} skipped"] if len(notes) > 3 else []
    return [block for block in blocks if block] or [[]], k, notes[:3] + more, between


def _skipped(row: Row) -> str:
    line, cells = row
    return f"line {line} skipped: {' '.join(filter(None, cells))[:40]!r}"


def _continues(one: LabTable, other: LabTable) -> bool:
    """Return whether ``other`` continues the recording ``one`` by time or travel; a travel that returned has ended."""
    moves = one.columns_of_roles("time") + one.columns_of_roles("travel", "extensometer", "angle", "pressure")
    rows = [*one.body[:: len(one.body) // 500 + 1], one.body[-1], other.body[0]] if one.body and other.body else []
    cells = [cells[moves[0]] if moves[0] < len(cells) else "" for _, cells in rows] if moves else []
    if not cells or not all(NUMBER.match(cells[k]) for k in (0, -2, -1)):
        return False
    mark = "," if any("," in cell for cell in cells) else "."
    *values, then = (number(cell, mark) for cell in cells if NUMBER.match(cell))
    start, last, way = values[0], values[-1], np.ptp(values)
    ended = abs(last - start) <= ENDED * way and way > CLEAR * noise(np.array(values))
    return bool(abs(then - last) <= abs(then - start)) and not (way > 0.0 and ended)


def _find_numbers(rows: list[Row]) -> int | None:
    return next((k for k, (_, c) in enumerate(rows) if len(c) > 1 and all(NUMBER.match(x) for x in c if x)), None)


def _insert_names(rows: list[Row], columns: Sequence[str], place: str) -> list[Row]:
    """Insert the column names of the user above the numbers."""
    first = _find_numbers(rows)
    if first is None:
        raise InputError(f"{place}: --columns: the file has no row of numbers")
    line, cells = rows[first]
    if len(cells) != len(columns):
        raise InputError(
            f"{place}:{line}: --columns names {len(columns)} columns, but the row has {len(cells)}; name all in their "
            "order, with '-' for one that is not needed"
        )
    names: Row = (line, [f"column {k + 1}" if name in ("", "-") else name for k, name in enumerate(columns)])
    return [*rows[:first], names, *rows[first:]]


def _refuse_foreign(path: Path, head: Sequence[Row], names: Sequence[str], own: tuple[str, ...]) -> None:
    """Raise :class:`InputError` if title, columns or name of a file name another test."""
    texts = [path.stem, *names]
    for _, cells in head[:MAX_HEAD]:
        filled = [cell for cell in cells if cell]
        if len(filled) > 1 and all(lab_units.pattern("denied").fullmatch(cell) for cell in filled[1:]):
            continue
        label = filled[0] if filled else ""
        texts += filled if len(filled) == 1 or lab_units.pattern("test_labels").search(label[:80]) else [label]
        texts += [cell for cell in filled if len(filled) > 3 and not NUMBER.match(cell)]
    if other := lab_units.find_foreign_test(texts, own):
        kind, text = other
        raise InputError(
            f"{path}: {value_excerpt(text)} names another test ({kind}); remove the file, or correct this text"
        )


def _missing_names_error(path: str, rows: list[Row], wanted: Wanted, words: str, given: ReadOptions) -> InputError:
    """Error for a file without known column names, with the option that states their roles."""
    at, message = _find_numbers(rows), f"{path}: no header row names {words}"
    if at is None:
        return InputError(message)
    line, cells = rows[at]
    above = [
        row for row in rows[max(at - 3, 0) : at]
        if len(row[1]) == len(cells) and not any(map(NUMBER.match, row[1])) and sum(map(bool, row[1])) > 1
    ]  # fmt: skip
    if not above:
        block = [row for _, row in rows[at:] if len(row) == len(cells)]
        few = len(cells) <= FEW
        guess = ",".join(_guess_roles(block, _missing_roles([], wanted))) if few else "NAME,NAME,..."
        message += f"; line {line} has numbers without names"
        if not given.has_column_options:
            return InputError(f"{message}: {RENAME}")
        return InputError(f"{message}: give --columns {guess}, in their order")
    names = [name for name in above[0][1] if name]
    roles = dict(zip(names, _find_roles(names, [""] * len(names), given), strict=True))
    lacking = _missing_roles(list(roles.values()), wanted)
    units = dict(zip(above[0][1], above[1][1] if len(above) > 1 else [], strict=False))
    free = sorted((n for n, role in roles.items() if role not in sum(wanted, ())), key=lambda n: bool(roles[n]))

    def misfit(name: str, role: str) -> tuple[bool, bool]:  # a name in another unit fits best, then a unit
        below = units.get(name, "")
        return lab_units.find_role(name, below)[1] != role, not lab_units.unit_fits_role(role, name, below)

    fitting = [min(free, key=partial(misfit, role=role), default="") for role in lacking]
    free = list(filter(None, dict.fromkeys([*fitting, *free])))
    if lacking == ["overhang"]:  # all of them are readings of a strip
        lacking *= sum(not roles[name] for name in free) or 1
    lost = [name for name in given.named if name not in (n.lower() for n in names)]
    stress = next((name for name, role in roles.items() if role == "pressure" and "force" in lacking), "")
    more = f"; {stress!r} is a stress, not a force" if stress else ""
    more += f"; --column names {lost[0]!r}, which the file does not have" if lost else ""
    options = " ".join(f'--column {role}="{name}"' for role, name in zip(lacking, free, strict=False))
    listed = ", ".join(map(repr, names[:12]))
    advice = f"state their roles, such as {options}" if given.has_column_options else RENAME
    return InputError(f"{message}; the columns in line {above[0][0]} are {listed}{more}: {advice}")


def _guess_roles(rows: list[list[str]], needed: list[str]) -> list[str]:
    """Guess the roles of columns of numbers: equal steps are a time, then the wanted roles by size."""
    mark = "," if any("," in cell for row in rows[:50] for cell in row) else "."
    columns = np.array([[number(cell, mark) for cell in row] for row in rows]).T
    names, size = ["-"] * len(columns), np.nan_to_num(np.abs(columns)).max(axis=1)
    free = sorted(range(len(columns)), key=lambda k: -float(size[k]))
    for k, steps in enumerate(np.diff(columns)):
        if len(columns) > len(needed) and len(steps) > 2 and steps.min() > 0.0 and np.ptp(steps) < 0.02 * steps.mean():
            names[k] = "time"
            free.remove(k)
            break
    for k, role in zip(free, needed, strict=False):
        names[k] = role
    return names


def _conditions_in_columns(head: list[Row], number: int, count: int) -> list[Row]:
    """Read conditions from a table of results as rows of label, number and unit; of ``count`` rows the ``number``."""
    found: list[Row] = []
    for (_, names), (k, _) in zip(head, enumerate(head), strict=True):
        if len([n for n in names if n]) < 2 or any(_STATED.fullmatch(n) for n in names):
            continue
        first, units, _ = _find_units(head, k)
        values = []
        for row in head[first:]:
            filled = [c for c, n in enumerate(names) if n and c < len(row[1]) and NUMBER.match(row[1][c])]
            if len(filled) < 2 or any(map(lab_units.is_statistic, row[1])):
                break
            values.append((row, filled))
        if len(values) == count and count > 1:
            values = values[number : number + 1]
        found += [(line, [names[c], cells[c], units[c]]) for (line, cells), filled in values for c in filled]
    return found
