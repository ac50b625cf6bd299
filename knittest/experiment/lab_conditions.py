"""Conditions of a laboratory test (widths, sides, forces) and its direction: what file and user state of them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.fabric import Direction, Fabric
from knittest.config.rigs import StripRig
from knittest.config.run import rig_model
from knittest.experiment import lab_names, lab_units
from knittest.experiment.lab_rows import Row
from knittest.experiment.lab_table import LabTable
from knittest.experiment.lab_units import NUMBER, read_number

_VALUE = re.compile(r"([+-]?\d[\d.,]*)\s*(.*)", re.S)
#: difference [-] of two numbers that are meant to be the same
SAME = 0.005
_UP_TO = re.compile(r"[:=]")


def within(value: float, model: type[BaseModel] | str, field: str, said: str, more: str = "") -> float:
    """``value``; raises :class:`InputError` outside the bounds of a ``field`` of ``model``, or of the rig of that name.

    The message is what is ``said``, what was expected, with the likely unit, and ``more``.
    """
    try:
        check_bounds(value, field_meta(rig_model(model) if isinstance(model, str) else model, field))
    except BoundsError as error:
        raise InputError(f"{said}: {error.expected}{more}") from None
    return value


@dataclass(frozen=True)
class Condition:
    """A number that results of a test hang on: ``key`` names it in tables, ``option`` on the command line.

    ``units`` are factors to ``unit``. Its bounds are those of the field ``bounds`` of ``model``, or of the rig of the
    test that it names; none without. The labels that state it stand in the table of names.
    """

    key: str
    name: str
    option: str = ""
    unit: str = "mm"
    units: Mapping[str, float] = field(default_factory=lambda: lab_units.LENGTH, hash=False)
    model: type[BaseModel] | str = ""
    bounds: str = ""

    @property
    def one(self) -> str:
        """Name with its article."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"

    @property
    def tiers(self) -> int:
        """Number of ranks of labels; a label counts where no earlier rank stands in the file."""
        return len(lab_names.table()["conditions"].get(self.key, {}).get("tiers", ()))

    def names(self, cell: str, tier: int = 0) -> bool:
        """Tell whether ``cell`` names this condition by a label of rank ``tier``."""
        return lab_names.labels(self.key, cell, tier)

    def plausible(self, value: float, said: str) -> float:
        """``value`` [unit]; raises :class:`InputError` outside the field's bounds, with the likely unit."""
        return within(value, self.model, self.bounds, f"{said} {value:g}") if self.bounds else value


_MM = ("mm", lab_units.LENGTH)
GAUGE = Condition("gauge_length_mm", "gauge length", "--gauge-length", *_MM, "tensile", "gauge_length")
EXTENSOMETER = Condition("extensometer_gauge_mm", "gauge length of the extensometer")
STANDARD = Condition("standard_gauge_mm", "gauge length of the standard travel")
WIDTH = Condition("strip_width_mm", "strip width", "--width", *_MM, StripRig, "width")
FRAME_SIDE = Condition("frame_side_mm", "frame side", "--frame-side", *_MM, "picture-frame", "frame_side")
FABRIC_SIDE = Condition("fabric_side_mm", "fabric side", "--fabric-side", *_MM, "picture-frame", "side")
AREA_MASS = Condition(
    "area_mass_g_m2", "area mass", "--area-mass", "g/m2", lab_units.AREA_MASS, Fabric, "area_mass"
)  # fmt: skip
PLANE_ANGLE = Condition(
    "plane_angle_deg", "angle of the plane", "--plane-angle", "deg", lab_units.ANGLE, "cantilever", "plane_angle"
)
NORMAL_FORCE = Condition(
    "normal_force_n", "normal force", "--normal-force", "N", lab_units.FORCE, "friction", "normal_force"
)
PLATE_LENGTH = Condition("plate_length_mm", "plate length", "--plate-length", *_MM, "friction", "plate_length")
PLATE_WIDTH = Condition("plate_width_mm", "plate width", "--plate-width", *_MM, "friction", "plate_width")
PLATE_DIAMETER = Condition("plate_diameter_mm", "plate diameter", "--plate-diameter", *_MM)
PLATE_AREA = Condition("plate_area_mm2", "plate area", "", "mm2", lab_units.AREA)
RATIO = Condition("strain_ratio", "strain ratio", "--ratio", "1", {"1": 1.0}, "biaxial", "ratio")
EMBEDDED = Condition("embedded_length_mm", "embedded length", "--embedded-length", *_MM, "pull-out", "length")
CROSSING_DENSITY = Condition(
    "crossing_density_per_100_mm", "density of the crossing yarns", "--crossing-density", "yarn/100 mm",
    lab_units.DENSITY, Fabric, "warp_density",
)  # fmt: skip
# those that an import finds by itself: no label and no option states them
CLAMPED_EDGES = Condition("clamped_edges", "number of clamped edges", "", "1", {})
SLID_PITCHES = Condition("slid_pitches", "number of pitches slid", "", "1", {})
CYCLES = Condition("cycles", "number of cycles", "", "1", {}, "picture-frame", "cycles")
CYCLE_ANGLE = Condition("cycle_angle_deg", "angle at which cycles turn", "", "deg", {}, "picture-frame", "max_angle")


def stated(what: Condition, table: LabTable, tiers: Iterable[int] | None = None) -> tuple[float, str] | None:
    """Value of ``what`` [its unit] in the rows above ``table``, and ``file:line``; ``None`` when no row states one.

    Raises :class:`InputError` for an unknown unit, an implausible number, or rows that contradict each other.
    """
    for tier in range(what.tiers) if tiers is None else tiers:
        found = [
            (what.plausible(*value), f"{table.place}:{line}")
            for line, cells in table.head
            for k, cell in enumerate(cells)
            if what.names(_split(cell)[0], tier) and (value := _value(what, table, line, cells[k:])) is not None
        ]
        if found:
            return agreeing(what, found)
    return None


def agreeing(what: Condition, found: Sequence[tuple[float, str]]) -> tuple[float, str]:
    """The first of ``found``, value and place; raises :class:`InputError` if another one differs."""
    first, where = found[0]
    for value, place in found[1:]:
        if not same(value, first):
            raise InputError(
                f"{place}: states {what.one} of {value:g} {what.unit}, {where} one of {first:g} {what.unit}: "
                "which is it? Leave the right one in; specimens that differ go into files of their own"
            )
    return first, where


def agreed(what: Condition, given: float | None, said: tuple[float, str] | None) -> float | None:
    """The value of the option or of the file; raises :class:`InputError` if they contradict each other."""
    if given is not None:
        what.plausible(given, what.option)
    if said is None or given is None:
        return given if said is None else said[0]
    value, where = said
    if not same(given, value):
        raise InputError(
            f"{where}: the file states {what.one} of {value:g} {what.unit}, {what.option} says {given:g} {what.unit}"
        )
    return given


def known(what: Condition, table: LabTable, given: Mapping[str, float], number: int = 0) -> float | None:
    """Value of ``what`` by the head of ``table``, by a column that names it and by the user; ``None`` where none does.

    Of several columns it is that of the specimen ``number``.
    """
    head, named = stated(what, table), columns_of(what, table)
    if len(named) not in (0, 1, table.count):
        raise InputError(
            f"{table.where}: {len(named)} columns of a {what.name} for {table.count} specimens: expected one for each"
        )
    places = [head] if head else []
    places += [in_column(what, table, named[number if len(named) > 1 else 0])] if named else []
    return agreed(what, given.get(what.key), agreeing(what, places) if places else None)


def columns_of(what: Condition, table: LabTable) -> list[int]:
    """Columns that name ``what`` and have no other role in a recording."""
    named = [k for k, role in enumerate(table.roles) if role in ("", what.key.rpartition("_")[0])]
    return [k for k in named if any(what.names(table.names[k], tier) for tier in range(what.tiers))]


def needed(
    wanted: Sequence[Condition], table: LabTable, path: object, given: Mapping[str, float], number: int = 0
) -> list[float]:
    """:func:`known` of each of ``wanted``; raises :class:`InputError` naming those that nobody states."""
    values = [known(what, table, given, number) for what in wanted]
    if missing := [what for what, value in zip(wanted, values, strict=True) if value is None]:
        raise unstated(missing, path)
    return [value for value in values if value is not None]


def unstated(missing: Sequence[Condition], path: object) -> InputError:
    """The refusal of a file that leaves open what its results hang on."""
    names = " and no ".join(w.name for w in missing)
    options = " and ".join(f"{w.option} [{w.unit}]" for w in missing)
    return InputError(f"{path}: the file states no {names}: give {options}")


def in_column(what: Condition, table: LabTable, column: int) -> tuple[float, str]:
    """The one value of ``what`` in a column that it names, and its place."""
    filled = [(line, cells) for line, cells in table.body if column < len(cells) and cells[column]]
    name = table.names[column]
    if not filled:
        raise InputError(f"{table.where}: column {name!r} is empty: give {what.option} [{what.unit}] and leave it out")
    factor = what.units[table.unit(column, what.units) or what.unit]
    values = {cells[column]: line for line, cells in reversed(filled)}
    found = [
        (what.plausible(table.number(line, cell) * factor, f"{table.place}:{line}: {name}"), f"{table.place}:{line}")
        for cell, line in sorted(values.items(), key=lambda item: item[1])
    ]
    return agreeing(what, found)


def same(one: float, other: float) -> bool:
    """Tell whether two numbers are meant to be the same."""
    return abs(one - other) <= SAME * abs(other)


def _split(cell: str) -> tuple[str, str]:
    """Label of a cell and what stands behind its colon or equals sign, if that is a number."""
    label, *rest = _UP_TO.split(cell, maxsplit=1)
    behind = rest[0].strip() if rest else ""
    return (label.strip("# \t"), behind) if not behind or _VALUE.match(behind) else (cell.strip("# \t"), "")


def _value(what: Condition, table: LabTable, line: int, cells: Sequence[str]) -> tuple[float, str] | None:
    """Number and its name in messages, from a cell with a label and those behind it; ``None`` without a number."""
    label, rest = _split(cells[0])
    behind = [cell for cell in (rest, *cells[1:]) if cell]
    found = _VALUE.match(behind[0]) if behind else None
    if found is None:
        return None
    unit = found[2].strip()
    if not unit and len(behind) > 1 and not NUMBER.match(behind[1]):
        labels_another = len(behind) > 2 and _VALUE.match(behind[2]) and not lab_units.known(behind[1], what.units)
        unit = "" if labels_another else behind[1]
    own = re.fullmatch(r"[+-]?\d+([.,])(\d*)", found[1])  # a mark that cannot stand for thousands is its own
    value = read_number(table.place, line, found[1], own[1] if own and len(own[2]) != 3 else table.mark)
    plain = re.sub(r"\(([^()]*)\)", lambda text: text[0] if lab_units.is_unit(text[1]) else "", label)
    named = lab_units.stated(plain, unit, what.units, f"{table.place}:{line}") or what.unit
    return value * what.units[named], f"{table.place}:{line}: {label}"


@dataclass(frozen=True)
class Said:
    """A direction and the place that states it: a row of the file, or the name of the file or of its folder."""

    direction: Direction
    where: str
    by: Literal["row", "name", "folder"] = "row"


def said_by(path: Path, head: Iterable[Row]) -> Said | None:
    """Direction by the rows of ``head``, else the file's name, else its folder's; ``None`` if none names just one."""
    places: list[tuple[str, str, Literal["row", "name", "folder"]]] = [
        *((f"{path}:{line}", " ".join(cells), "row") for line, cells in head),
        (f"{path}: its name", path.stem, "name"),
        (f"{path}: its folder", path.parent.name, "folder"),
    ]
    directions: tuple[Direction, ...] = ("warp", "weft")
    for where, text, by in places:
        plain = lab_names.pattern("directions", "fabric").sub(" ", text[: lab_names.LONGEST].replace("_", " "))
        named = [direction for direction in directions if lab_names.pattern("directions", direction).search(plain)]
        if len(named) == 1:
            return Said(named[0], where, by)
    return None


def refuse_other(said: Iterable[Said | None], direction: str) -> None:
    """Raise :class:`InputError` for a file that names the other direction than ``direction``."""
    for one in said:
        if one is not None and one.direction != direction:
            raise InputError(
                f"{one.where} says {one.direction}, --direction says {direction}: which is it? "
                "--trust-direction goes by the option"
            )
