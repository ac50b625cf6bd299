"""Reads tensile exports of testing machines: specimens told apart, units and the strip's size found."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment import lab_units
from knittest.experiment.lab_conditions import GAUGE, WIDTH, agreed, agreeing, stated
from knittest.experiment.lab_direction import Said, said_by
from knittest.experiment.lab_numbers import NUMBER
from knittest.experiment.lab_sign import Sign, drawn, pulled
from knittest.experiment.lab_table import LabTable, columns, read_table, refuse_shared, with_nearest

Array = NDArray[np.float64]

#: strain above which unit or gauge length must be wrong [%]
MAX_STRAIN = 100.0
#: names of columns in English and German
FORCE = re.compile(r"force|kraft|load|last", re.I)
TRAVEL = re.compile(r"strain|dehnung|displacement|travel|weg|extension|elongation|verl", re.I)


@dataclass(frozen=True)
class Specimen:
    """Strain [%] and force [N] of one specimen, (n,) each; width and gauge length [mm] where they are known.

    ``path`` is its file, ``said`` the direction that the file states, if any, ``unit`` the unit of its forces there.
    """

    name: str
    strain: Array
    force: Array
    width: float | None = None
    gauge: float | None = None
    path: Path = Path()
    said: Said | None = None
    unit: str = "N"


def read_lab(
    path: Path, gauge_length: float | None = None, decimal: str | None = None, delimiter: str | None = None,
    width: float | None = None, sign: Sign = "positive",
) -> list[Specimen]:  # fmt: skip
    """Specimens in one export; several are told apart by repeated pairs of columns.

    Columns are found by name (force or Kraft; displacement, Weg, strain or Dehnung) and unit (row or brackets); travel
    becomes strain by ``gauge_length`` [mm], by default that in the file's head, as is ``width`` [mm]. Pull counts as
    ``sign`` says. Raises :class:`InputError` with the row for text, gaps, a travel that does not rise, a pull of the
    other sign, an unknown unit, lengths that the head contradicts, or numbers whose decimal mark cannot be told.
    """
    table = read_table(
        path, lambda cells: bool(_pairs(cells)), "a force and a displacement or strain column", decimal, delimiter
    )
    gauge = agreed(GAUGE, gauge_length, stated(GAUGE, path, table.head, table.mark))
    pairs = _pairs(table.names)
    refuse_shared(table, pairs)
    widths = _widths(table, len(pairs), width)
    said = said_by(path, table.head)
    specimens = []
    for number, (pair, wide) in enumerate(zip(pairs, widths, strict=True), 1):
        name = path.stem if len(pairs) == 1 else f"{path.stem}-{number}"
        strain, force = _curve(table, name, pair, gauge, sign)
        unit = _force_unit(table, pair[1])
        specimens.append(Specimen(name, strain, force, wide, gauge, path, said, unit))
    return specimens


def _force_unit(table: LabTable, column: int) -> str:
    return lab_units.force_unit(table.names[column], table.units[column], table.where)


def _to_strain(unit: str, gauge: float | None, where: str) -> float:
    """Factor from the travel's unit to %."""
    if unit in lab_units.STRAIN:
        return lab_units.STRAIN[unit]
    if gauge is None:
        raise InputError(f"{where}: travel in {unit}, and the file states no gauge length: give --gauge-length [mm]")
    return 100.0 * lab_units.LENGTH[unit] / gauge


def _pairs(cells: list[str]) -> list[tuple[int, int]]:
    """Columns of (travel, force), each force with the nearest travel before it, or after it if none is before."""
    forces = [k for k, c in enumerate(cells) if FORCE.search(c) and not NUMBER.match(c)]
    travels = [k for k, c in enumerate(cells) if TRAVEL.search(c) and not NUMBER.match(c) and k not in forces]
    return with_nearest(travels, forces)


def _widths(table: LabTable, count: int, given: float | None) -> list[float | None]:
    """Width [mm] of each of ``count`` specimens: from the head, from columns of widths, or as ``given``."""
    head = stated(WIDTH, table.path, table.head, table.mark)
    named = [k for k, name in enumerate(table.names) if any(WIDTH.names(name, t) for t in range(len(WIDTH.labels)))]
    if len(named) not in (0, 1, count):
        raise InputError(f"{table.where}: {len(named)} columns of widths for {count} specimens: expected one for each")
    own = [_column_width(table, k) for k in named]
    own = own * count if len(own) == 1 else own
    places = [([head] if head else []) + own[k : k + 1] for k in range(count)]
    return [agreed(WIDTH, given, agreeing(WIDTH, found) if found else None) for found in places]


def _column_width(table: LabTable, column: int) -> tuple[float, str]:
    """The one width [mm] in a column, and its place."""
    filled = [(line, cells) for line, cells in table.body if column < len(cells) and cells[column]]
    name = table.names[column]
    if not filled:
        raise InputError(f"{table.where}: column {name!r} is empty: give --width [mm] and leave it out")
    unit = lab_units.stated(name, table.units[column], lab_units.LENGTH, table.where) or "mm"
    found = []
    for line, cells in filled:
        where = f"{table.path}:{line}"
        value = table.number(line, cells[column]) * lab_units.LENGTH[unit]
        found.append((WIDTH.plausible(value, f"{where}: {name}"), where))
    return agreeing(WIDTH, found)


def _curve(
    table: LabTable, name: str, pair: tuple[int, int], gauge: float | None, sign: Sign
) -> tuple[Array, Array]:  # fmt: skip
    """Strain [%] and force [N] of the specimen in the columns ``pair``, (n,) each."""
    lines, values = columns(table, pair, name)
    travel, pull = pair
    unit = lab_units.travel_unit(table.names[travel], table.units[travel], table.where)
    factors = (
        _to_strain(unit, gauge, table.where),
        lab_units.FORCE[_force_unit(table, pull)],
    )
    where = f"{table.path}:{{}}: specimen {name}"
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        strain, force = (values * factors).T
    if not np.isfinite(force).all():
        raise InputError(f"{where.format(lines[int(np.argmin(np.isfinite(force)))])}: no finite force")
    strain, force = drawn(strain, sign), pulled(force, sign, f"{table.path}: specimen {name}")
    with np.errstate(over="ignore", invalid="ignore"):
        falls = np.flatnonzero(np.diff(strain) <= 0.0)
    if len(falls):
        raise InputError(
            f"{where.format(lines[falls[0] + 1])}: the travel repeats or goes back "
            f"({values[falls[0], 0]:g} then {values[falls[0] + 1, 0]:g}); {len(falls)} such rows"
        )
    if strain[-1] > MAX_STRAIN:
        raise InputError(
            f"{where.format(lines[-1])}: a travel of {values[-1, 0]:g} would be a strain of "
            f"{strain[-1]:.4g} %: check the unit of the travel and the gauge length"
        )
    return strain, force
