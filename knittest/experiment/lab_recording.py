"""Recordings, one a specimen: its columns by their roles, in one unit each."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.yaml_loader import shown
from knittest.experiment import lab_names, lab_units
from knittest.experiment.lab_conditions import Condition, Said, known, needed, said_by
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_table import LabTable, Wanted, read_tables
from knittest.experiment.lab_units import has_number

Array = NDArray[np.float64]
SpecimenT = TypeVar("SpecimenT")


@dataclass(frozen=True)
class Origin:
    """Name and file of a specimen, the direction that the file states, the unit of its forces there, and notes on how
    it was read. Specimens of a test derive from it.
    """

    name: str
    _: KW_ONLY
    path: Path = Path()
    said: Said | None = None
    unit: str = "N"
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recording:
    """Columns (n,) of one specimen by role, without rows that have empty cells in them; ``lines`` of the rows.

    Units: N, mm, % (a travel or extensometer in a unit of strain has the role strain), deg, kPa, 1. ``number`` counts
    the specimens of ``table``.
    """

    origin: Origin
    table: LabTable
    number: int
    lines: Sequence[int]
    values: Mapping[str, Array]
    columns: Mapping[str, int]

    @property
    def name(self) -> str:
        """Name of the specimen."""
        return self.origin.name

    @property
    def where(self) -> str:
        """File and specimen, for messages."""
        return f"{self.table.place}: specimen {self.name}"

    def title(self, role: str) -> str:
        """Name of the column with that ``role`` in the file."""
        return self.table.names[self.columns[role]]

    def travel(self) -> Array:
        """Travel [mm]; raises :class:`InputError` where the column is a strain."""
        if "travel" not in self.values:
            raise InputError(f"{self.where}: column {self.title('strain')!r}: a strain: expected a travel [mm]")
        return self.values["travel"]

    def known(self, what: Condition, given: Given) -> float | None:
        """``what`` by the head of the file or the user, ``None`` where neither states it."""
        return known(what, self.table, given.sizes, self.number)

    def needed(self, wanted: Sequence[Condition], given: Given) -> list[float]:
        """The same of each of ``wanted``; raises :class:`InputError` naming the option of those that nobody states."""
        return needed(wanted, self.table, self.origin.path, given.sizes, self.number)


def of(recording: Recording) -> dict[str, Any]:
    """The fields of :class:`Origin`, for a specimen that derives from it."""
    return dict(vars(recording.origin))


def reader(
    wanted: Wanted, words: str, specimen: Callable[[Recording, Given], SpecimenT], **more: Any
) -> Callable[[Path, Given], list[SpecimenT]]:
    """Reads the :func:`recordings` of a file into specimens."""
    return lambda path, given: [specimen(r, given) for r in recordings(path, given, wanted, words, **more)]


def recordings(
    path: Path, given: Given, wanted: Wanted, words: str, *, own: tuple[str, ...] = (), optional: tuple[str, ...] = (),
    shared: bool = False, unit_needed: bool = False,
) -> list[Recording]:  # fmt: skip
    """Specimens in the file ``path``, one a column of the first of ``wanted``: roles of which it needs one each.

    The first role of each that is there counts. ``words`` name them in messages; ``optional`` are roles beside them,
    ``own`` other kinds of tests that the file may name; ``shared`` lets several specimens share a travel, and
    ``unit_needed`` asks every column for its unit. Raises :class:`InputError`.
    """
    lead, moves = tuple(wanted[0]), tuple(role for some in wanted[1:] for role in some)
    tables = read_tables(path, given, wanted, words, own)
    found = []
    for name, table, group, number in specimens_in(tables, lead, moves, shared):
        chosen = {}
        for some in (*wanted, *((role,) for role in optional)):
            role = next((role for role in some if any(table.roles[k] == role for k in group)), None)
            if role is not None:
                chosen[role] = min((k for k in group if table.roles[k] == role), key=lambda k: _rank(table.names[k]))
        lines, cells = columns(table, list(chosen.values()), name)
        values, which, unit = {}, {}, "N"
        for (role, k), raw in zip(chosen.items(), cells.T, strict=True):
            stated, factor = unit_of(table, k, unit_needed)
            kept = "strain" if stated in lab_units.STRAIN and role in ("travel", "extensometer") else role
            with np.errstate(over="ignore", invalid="ignore"):
                values[kept] = raw * factor
            which[kept], unit = k, stated if role == "force" else unit
            if not np.isfinite(values[kept]).all():
                raise InputError(f"{table.place}: specimen {name}: no finite {role.replace('_', ' ')}")
        notes = (*told(table, {k: role.replace("_", " ") for role, k in which.items()}, group), *table.notes_of(name))
        origin = Origin(name=name, path=path, said=said_by(path, table.head), unit=unit, notes=notes)
        found.append(Recording(origin, table, number, lines, values, which))
    return found


def columns(table: LabTable, which: Sequence[int], name: str) -> tuple[list[int], Array]:
    """Lines (n) and numbers (n, columns) of the columns ``which``, rows with empty cells left out and noted.

    Raises :class:`InputError` with the row for text, for fewer than two rows, and where a row that is left out holds
    the largest number of the first column; ``name`` is for messages.
    """
    values = np.full((len(table.body), len(which)), np.nan)
    empty = np.ones(values.shape, bool)
    for at, (line, row) in enumerate(table.body):
        for place, column in enumerate(which):
            if column < len(row) and has_number(row[column]):
                values[at, place], empty[at, place] = table.number(line, row[column]), False
    partly = np.flatnonzero(empty.any(axis=1) & ~empty.all(axis=1))
    for k in partly:
        if len(table.body[k][1]) <= max(which) and len(table.body[k][1]) < 2:
            raise InputError(
                f"{table.place}:{table.body[k][0]}: '' is not a number: one cell below {len(table.names)} columns"
            )
    note = ""
    if len(partly):
        line, row = table.body[partly[0]]
        cell = next((row[c] for c in which if c < len(row) and not has_number(row[c])), "")
        note = f"{len(partly)} rows with empty cells left out, the first at {table.place}:{line}: {shown(cell)}"
        note = note.replace("1 rows", "1 row") if len(partly) == 1 else note
    kept = np.flatnonzero(~empty.any(axis=1))
    if len(kept) < 2:
        left = f" ({note})" if note else ""
        raise InputError(f"{table.place}: specimen {name} has {len(kept)} points; at least two are needed{left}")
    size = np.abs(np.nan_to_num(values[:, 0]))
    if (top := int(np.argmax(size))) not in kept and size[top] > size[kept].max():
        raise InputError(
            f"{table.place}:{table.body[top][0]}: specimen {name}: the largest {table.names[which[0]]!r} stands in a "
            "row with an empty cell: fill it in, or leave the column out"
        )
    table.notes += [f"{name}: {note}"] if note else []
    return [table.body[k][0] for k in kept], values[kept]


def specimens_in(
    tables: Sequence[LabTable], lead: Sequence[str], moves: Sequence[str], shared: bool = False
) -> Iterator[tuple[str, LabTable, list[int], int]]:
    """Name, table and columns of each specimen, one a column of ``lead`` with those of ``moves`` beside it, and its
    number in the table.
    """
    found = []
    for table in tables:
        first = next(role for role in lead if role in table.roles)
        groups = _groups(table, first, moves, shared)
        table.count = len(groups)
        found += [(table, *one) for one in enumerate(groups)]
    for k, (table, place, group) in enumerate(found, 1):
        yield (table.stem if len(found) == 1 else f"{table.stem}-{k}"), table, group, place


def _groups(table: LabTable, lead: str, moves: Sequence[str], shared: bool) -> list[list[int]]:
    leads, others = table.having(lead), table.having(*moves)
    if len(leads) < 2 or not others:
        return [list(range(len(table.names)))]
    for timed in (table.having("time"), []):
        relevant = sorted([*leads, *others, *timed])
        size, rest = divmod(len(relevant), len(leads))
        kinds = [table.roles[k] for k in relevant]
        if not rest and size > 1 and kinds == kinds[:size] * len(leads):
            starts = [0, *(relevant[k * size] for k in range(1, len(leads))), len(table.names)]
            return [list(range(a, b)) for a, b in pairwise(starts)]
    beside = [cs for role in set(table.roles) - {lead, *moves} if len(cs := table.having(role)) == len(leads)]
    found: list[list[int]] = []
    first: dict[int, int] = {}
    for at, k in enumerate(leads):
        move = max([m for m in others if m < k] or [min(others)])
        if move in first and not shared:
            one, other, over = (table.names[c] for c in (first[move], k, move))
            raise InputError(
                f"{table.where}: columns {one!r} and {other!r} are both over {over!r}: two forces of one specimen? "
                f'Leave one out, or say which counts, --column {lead}="{one}"; of two specimens each needs '
                "its own travel beside its force"
            )
        first[move] = k
        found.append([move, k, *(cs[at] for cs in beside)])
    return found


def unit_of(table: LabTable, column: int, needed: bool = False) -> tuple[str, float]:
    """Unit of a column by its role, N or mm where none is stated, and its factor to N, mm, %, deg, kPa or 1.

    Raises :class:`InputError` where it is ``needed``, or for a strain, and not stated, and for a force per width.
    """
    name, entry = table.names[column], lab_names.table()["columns"][table.roles[column]]
    quantities: list[str] = entry["quantity"]
    units = {unit: quantity for quantity in quantities for unit in lab_units.QUANTITIES[quantity]}
    if "force" in quantities and lab_names.is_kind("per_width", name):
        raise InputError(
            f"{table.where}: column {name!r}: a force per width: expected the force of the whole strip [N]"
        )
    unit = lab_units.stated(name, table.units[column], dict.fromkeys(units, 1.0), table.where)
    is_strain = "strain" in quantities and lab_names.is_kind("strain", name)
    if not unit and (needed or is_strain or "unit" not in entry):
        quantity = "strain" if is_strain else quantities[0]
        first, *more = lab_units.QUANTITIES[quantity]
        raise InputError(
            f"{table.where}: column {name!r}: {'an' if quantity == 'angle' else 'a'} {quantity} without a unit: write "
            f"'{name} [{first}]', or {', '.join(more)}"
        )
    unit = unit or str(entry["unit"])
    return unit, lab_units.QUANTITIES[units[unit]][unit]


def told(
    table: LabTable, used: Mapping[int, str], group: Sequence[int], why: Mapping[int, str] = MappingProxyType({})
) -> list[str]:  # fmt: skip
    """Lines that name the columns of ``group`` that are ``used``, as what, and those that are not, and ``why``, if that
    does not follow from their roles.
    """
    words = lab_names.table()["unused"]
    left = [k for k in group if k not in used and table.names[k].strip()]
    reasons = [f"{table.names[k]!r} ({why.get(k) or words.get(table.roles[k], words['other'])})" for k in left]
    taken = [f"{table.names[k]!r} ({what})" for k, what in used.items()]
    return [f"columns used: {', '.join(taken)}", *([f"columns not used: {', '.join(reasons)}"] if reasons else [])]


def _rank(name: str) -> int:
    """Order of columns of one role: standard travel, one without a word to it, absolute position of the machine."""
    better = lab_names.is_kind("standard", name) or lab_names.is_kind("corrected", name)
    return 0 if better else 2 if lab_names.is_kind("machine", name) else 1
