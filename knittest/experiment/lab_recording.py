"""Recordings of specimens: their columns by role, in fixed units."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from knittest.base.errors import InputError
from knittest.config.yaml_loader import value_excerpt
from knittest.experiment import lab_units
from knittest.experiment.lab_conditions import (
    Condition,
    StatedDirection,
    find_condition,
    find_direction,
    unstated_error,
)
from knittest.experiment.lab_table import Array, LabTable, ReadOptions, Wanted, read_tables
from knittest.experiment.lab_units import has_number

SpecimenT = TypeVar("SpecimenT")


@dataclass(frozen=True)
class Origin:
    """Name and file of a specimen, the direction stated there, the unit of its forces, and notes on the reading."""

    name: str
    _: KW_ONLY
    path: Path = Path()
    said: StatedDirection | None = None
    unit: str = "N"
    notes: tuple[str, ...] = ()

    @property
    def place(self) -> str:
        """File and specimen, for messages."""
        return f"{self.path}: specimen {self.name}"


@dataclass
class Recording:
    """Columns ``group`` of the specimen ``number`` in ``table``.

    ``values`` (n,) by role come from the ``columns``, without rows with empty cells, times ``factors``, in N, mm, % (a
    travel or extensometer in a unit of strain has the role strain), deg, kPa, 1. ``unstated`` are the units taken for
    columns without one.
    """

    name: str
    path: Path
    table: LabTable
    group: Sequence[int]
    number: int
    given: ReadOptions
    wanted: Wanted
    values: dict[str, Array] = field(default_factory=dict)
    columns: dict[str, int] = field(default_factory=dict)
    factors: dict[str, float] = field(default_factory=dict)
    unit: str = "N"
    notes: list[str] = field(default_factory=list)
    unstated: dict[int, str] = field(default_factory=dict)

    @property
    def place(self) -> str:
        """File and specimen, for messages."""
        return f"{self.table.place}: specimen {self.name}"

    def title(self, role: str) -> str:
        """Name of the column with that ``role`` in the file."""
        return self.table.names[self.columns[role]]

    def is_kind(self, column: int, kind: str) -> bool:
        """Return whether the name of a ``column`` is of a ``kind`` in the table of names, such as machine."""
        return lab_units.matches(self.table.names[column], "kinds", kind)

    def rank(self, column: int) -> int:
        """Rank columns of one role: standard travel, others, absolute position of the machine."""
        better = self.is_kind(column, "standard") or self.is_kind(column, "corrected")
        return 0 if better else 2 if self.is_kind(column, "machine") else 1

    def travel(self) -> Array:
        """Travel [mm]; raises :class:`InputError` where the column is a strain."""
        if "travel" not in self.values:
            raise InputError(f"{self.place}: column {self.title('strain')!r} is a strain; expected a travel [mm]")
        return self.values["travel"]

    def find(self, what: Condition, tiers: Sequence[int] | None = None) -> float | None:
        """Return ``what`` as stated by the file or the user; ``None`` if it is not stated."""
        return find_condition(what, self.table, self.given.sizes, self.number, tiers)

    def require(self, *wanted: Condition) -> list[float]:
        """Return all of ``wanted``; raises :class:`InputError` with the options of those that are not stated."""
        values = [self.find(what) for what in wanted]
        if missing := [what for what, value in zip(wanted, values, strict=True) if value is None]:
            raise unstated_error(missing, self.path)
        return [value for value in values if value is not None]

    def origin(
        self, used: Mapping[int, str], why: Mapping[int, str] = MappingProxyType({}), notes: Sequence[str] = ()
    ) -> dict[str, Any]:
        """Return the fields of :class:`Origin`; notes list the columns ``used`` and ``why`` others are not."""
        words, names, roles = lab_units.name_table()["unused"], self.table.names, self.table.roles
        left = [k for k in self.group if k not in used and names[k].strip()]
        reasons = [f"{names[k]!r} ({why.get(k) or words.get(roles[k], words['other'])})" for k in left]
        columns = ["columns used: " + ", ".join(f"{names[k]!r} ({what})" for k, what in used.items())]
        columns += ["columns not used: " + ", ".join(reasons)] if reasons else []
        columns += [
            f"column {names[k]!r} has no unit: taken as {unit}" for k, unit in self.unstated.items()
            if k in used and unit != "1"
        ]  # fmt: skip
        notes = tuple(dict.fromkeys([*columns, *notes, *self.table.notes, *self.notes]))
        said = find_direction(self.path, self.table.head)
        return {"name": self.name, "path": self.path, "said": said, "unit": self.unit, "notes": notes}

    def read(self, optional: Sequence[str] = (), unit_needed: bool = False) -> dict[str, Any]:
        """Read the first available role of each of ``wanted``, and ``optional`` ones; returns the origin."""
        chosen = {}
        for some in (*self.wanted, *((role,) for role in optional)):
            for role in some:
                if named := [k for k in self.group if self.table.roles[k] == role]:
                    chosen[role] = min(named, key=self.rank)
                    break
        _, cells = self.fetch(list(chosen.values()))
        for (role, k), raw in zip(chosen.items(), cells.T, strict=True):
            unit, factor = self.unit_of(k, unit_needed)
            kept = "strain" if unit in lab_units.QUANTITIES["strain"] and role in ("travel", "extensometer") else role
            with np.errstate(over="ignore", invalid="ignore"):
                self.values[kept] = raw * factor
            self.columns[kept], self.factors[kept] = k, factor
            self.unit = unit if role == "force" else self.unit
            if not np.isfinite(self.values[kept]).all():
                raise InputError(f"{self.place}: the {role.replace('_', ' ')} is not a finite number")
        return self.origin({k: role.replace("_", " ") for role, k in self.columns.items()})

    def fetch(self, which: Sequence[int]) -> tuple[list[int], Array]:
        """Read lines (n) and numbers (n, columns) of the columns ``which``; without rows with empty cells."""
        table, values, note = self.table, self.table.numbers(which), ""
        empty = np.isnan(values)
        partly = np.flatnonzero(empty.any(axis=1) & ~empty.all(axis=1))
        for line, row in (table.body[k] for k in partly):
            if len(row) <= max(which) and len(row) < 2:
                raise InputError(f"{table.place}:{line}: the row has one cell for {len(table.names)} columns")
        if len(partly):
            line, row = table.body[partly[0]]
            cell = next((row[c] for c in which if c < len(row) and not has_number(row[c])), "")
            rows = f"{len(partly)} row{'s' * (len(partly) > 1)}"
            note = f"{rows} with empty cells skipped, the first at {table.place}:{line}: {value_excerpt(cell)}"
        kept = np.flatnonzero(~empty.any(axis=1))
        if len(kept) < 2:
            raise InputError(f"{self.place} has {len(kept)} points; at least two are needed{note and f' ({note})'}")
        size = np.abs(np.nan_to_num(values[:, 0]))
        if (top := int(np.argmax(size))) not in kept and size[top] > size[kept].max():
            raise InputError(
                f"{table.place}:{table.body[top][0]}: specimen {self.name}: the largest {table.names[which[0]]!r} "
                "is in a row with an empty cell; complete the row, or remove the column"
            )
        self.notes += [note] if note else []
        return [table.body[k][0] for k in kept], values[kept]

    def unit_of(self, column: int, needed: bool = False) -> tuple[str, float]:
        """Return unit (N or mm by default unless ``needed``) and factor to N, mm, %, deg, kPa of a column."""
        name, where = self.table.names[column], f"{self.table.header_place}: column {self.table.names[column]!r}"
        entry = lab_units.name_table()["columns"][self.table.roles[column]]
        quantities: list[str] = entry["quantity"]
        units = {unit: factor for quantity in quantities for unit, factor in lab_units.QUANTITIES[quantity].items()}
        if "force" in quantities and self.is_kind(column, "per_width"):
            raise InputError(f"{where} is a force per width; expected the force of the whole strip [N]")
        unit = self.table.unit(column, units)
        is_strain = "strain" in quantities and self.is_kind(column, "strain")
        if not unit and (needed or is_strain or "unit" not in entry):
            quantity = "strain" if is_strain else quantities[0]
            first, *more = lab_units.QUANTITIES[quantity]
            raise InputError(f"{where} has no unit of {quantity}; write '{name} [{first}]', or {', '.join(more)}")
        if not unit:
            unit = self.unstated[column] = str(entry["unit"])
        return unit, units[unit]


def make_reader(
    wanted: Wanted, words: str, specimen: Callable[[Recording], SpecimenT], **more: Any
) -> Callable[[Path, ReadOptions], list[SpecimenT]]:
    """Return a function that reads the :func:`recordings` of a file into specimens."""
    return lambda path, given: [specimen(r) for r in recordings(path, given, wanted, words, **more)]


def recordings(
    path: Path, given: ReadOptions, wanted: Wanted, words: str, *, own: tuple[str, ...] = (), shared: bool = False
) -> list[Recording]:
    """Read the specimens of the file ``path``, one for each column of the first of the ``wanted`` roles.

    ``words`` name the roles in messages; files may name ``own`` kinds of tests; ``shared`` specimens have one travel.
    """
    moves = tuple(role for some in wanted[1:] for role in some)
    found = []
    for table in read_tables(path, given, wanted, words, own):
        groups = _groups(table, next(role for role in wanted[0] if role in table.roles), moves, shared)
        table.count = len(groups)
        found += [(table, group, number) for number, group in enumerate(groups)]
    names = [path.stem if len(found) == 1 else f"{path.stem}-{k}" for k in range(1, len(found) + 1)]
    return [Recording(name, path, *one, given, wanted) for name, one in zip(names, found, strict=True)]


def _groups(table: LabTable, lead: str, moves: Sequence[str], shared: bool) -> list[list[int]]:
    leads, others = table.columns_of_roles(lead), table.columns_of_roles(*moves)
    if len(leads) < 2 or not others:
        return [list(range(len(table.names)))]
    for timed in (table.columns_of_roles("time"), []):
        relevant = sorted([*leads, *others, *timed])
        size, rest = divmod(len(relevant), len(leads))
        kinds = [table.roles[k] for k in relevant]
        if not rest and size > 1 and kinds == kinds[:size] * len(leads):
            starts = [0, *(relevant[k * size] for k in range(1, len(leads))), len(table.names)]
            return [list(range(a, b)) for a, b in pairwise(starts)]
    beside = [cs for role in set(table.roles) - {lead, *moves} if len(cs := table.columns_of_roles(role)) == len(leads)]
    first: dict[int, int] = {}
    found: list[list[int]] = []
    for at, k in enumerate(leads):
        move = max([m for m in others if m < k] or [min(others)])
        if move in first and not shared:
            one, other, over = (table.names[c] for c in (first[move], k, move))
            raise InputError(
                f"{table.header_place}: columns {one!r} and {other!r} share the column {over!r}. For one specimen, "
                f'remove one of them or import with --column {lead}="{one}"; for two, give each its own travel'
            )
        first[move] = k
        found.append([move, k, *(cs[at] for cs in beside)])
    return found
