"""Conditions of a laboratory test (widths, sides, forces) and its direction, as stated by file and user."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.fabric import Direction, Fabric
from knittest.config.rigs import StripRig
from knittest.config.run import rig_model
from knittest.experiment import lab_units
from knittest.experiment.lab_rows import Row
from knittest.experiment.lab_table import LabTable
from knittest.experiment.lab_units import NUMBER, read_number

#: value of a condition and the place that states it
Place = tuple[float, str]
_VALUE, _UP_TO = re.compile(r"([+-]?\d[\d.,]*)\s*(.*)", re.S), re.compile(r"[:=]")
#: largest difference [-] of equal numbers
SAME = 0.005
#: largest difference [-] of widths and lengths in one series
SERIES = 0.05


def check_within_bounds(value: float, model: type[BaseModel] | str, field: str, said: str, more: str = "") -> float:
    """Return ``value``; raises InputError outside the bounds of a ``field`` of ``model``, or of that rig."""
    try:
        check_bounds(value, field_meta(rig_model(model) if isinstance(model, str) else model, field))
    except BoundsError as error:
        raise InputError(f"{said}: {error.expected}{more}") from None
    return value


@dataclass(frozen=True)
class Condition:
    """A condition of results: its ``key`` in tables and labels, and its ``option`` on the command line.

    Its bounds are those of the field ``bounds`` of ``model``, or of the rig of that test.
    """

    key: str
    name: str
    option: str = ""
    unit: str = "mm"
    model: type[BaseModel] | str = ""
    bounds: str = ""

    @property
    def units(self) -> Mapping[str, float]:
        """Factors from the units of files to its own."""
        return next(units for units in lab_units.QUANTITIES.values() if self.unit in units)

    def names(self, cell: str, tiers: Iterable[int] | None = None) -> bool:
        """Return whether ``cell`` names this condition by a label of one of the ranks ``tiers``."""
        return any(lab_units.is_label(self.key, cell, tier) for tier in (self.tiers if tiers is None else tiers))

    @property
    def tiers(self) -> range:
        """Ranks of labels; a label counts if the file has none of an earlier rank."""
        return range(len(lab_units.name_table()["conditions"].get(self.key, {}).get("tiers", ())))

    def check_plausible(self, value: float, said: str) -> float:
        """Return ``value`` [unit]; raises :class:`InputError` outside the field's bounds, with the likely unit."""
        return check_within_bounds(value, self.model, self.bounds, f"{said} {value:g}") if self.bounds else value


GAUGE = Condition("gauge_length_mm", "gauge length", "--gauge-length", "mm", "tensile", "gauge_length")
EXTENSOMETER = Condition("extensometer_gauge_mm", "gauge length of the extensometer")
STANDARD = Condition("standard_gauge_mm", "gauge length of the standard travel")
WIDTH = Condition("strip_width_mm", "strip width", "--width", "mm", StripRig, "width")
FRAME_SIDE = Condition("frame_side_mm", "frame side", "--frame-side", "mm", "picture-frame", "frame_side")
FABRIC_SIDE = Condition("fabric_side_mm", "fabric side", "--fabric-side", "mm", "picture-frame", "side")
AREA_MASS = Condition("area_mass_g_m2", "area mass", "--area-mass", "g/m2", Fabric, "area_mass")
PLANE_ANGLE = Condition("plane_angle_deg", "angle of the plane", "--plane-angle", "deg", "cantilever", "plane_angle")
NORMAL_FORCE = Condition("normal_force_n", "normal force", "--normal-force", "N", "friction", "normal_force")
PLATE_LENGTH = Condition("plate_length_mm", "plate length", "--plate-length", "mm", "friction", "plate_length")
PLATE_WIDTH = Condition("plate_width_mm", "plate width", "--plate-width", "mm", "friction", "plate_width")
PLATE_DIAMETER = Condition("plate_diameter_mm", "plate diameter", "--plate-diameter")
PLATE_AREA = Condition("plate_area_mm2", "plate area", "", "mm2")
RATIO = Condition("strain_ratio", "strain ratio", "--ratio", "1", "biaxial", "ratio")
EMBEDDED = Condition("embedded_length_mm", "embedded length", "--embedded-length", "mm", "pull-out", "length")
CROSSING_DENSITY = Condition(
    "crossing_density_per_100_mm", "density of the crossing yarns", "--crossing-density", "yarn/100 mm", Fabric,
    "warp_density",
)  # fmt: skip
# conditions that an import finds, without label and option
CLAMPED_EDGES = Condition("clamped_edges", "number of clamped edges", "", "1")
SLID_PITCHES = Condition("slid_pitches", "number of pitches slid", "", "1")
CYCLES = Condition("cycles", "number of cycles", "", "1", "picture-frame", "cycles")
CYCLE_ANGLE = Condition("cycle_angle_deg", "reversal angle of the cycles", "", "deg", "picture-frame", "max_angle")


def sizes_agree(one: float, other: float) -> bool:
    """Return whether two numbers agree within :data:`SAME`."""
    return abs(one - other) <= SAME * abs(other)


def find_condition(
    what: Condition, table: LabTable, given: Mapping[str, float], number: int = 0, tiers: Sequence[int] | None = None
) -> float | None:
    """Value of ``what`` in the head of ``table``, a column or ``given``, which must agree; ``None`` if not stated.

    Several columns belong to specimens by ``number``. With ``tiers`` only labels of these ranks count.
    """
    places = next(
        filter(None, (_read_head(what, table, tier) for tier in (what.tiers if tiers is None else tiers))), []
    )
    named = [k for k, role in enumerate(table.roles) if role in ("", what.key.rpartition("_")[0])]
    named = [k for k in named if tiers is None and what.names(table.names[k])]
    if len(named) not in (0, 1, table.count):
        raise InputError(
            f"{table.header_place}: {len(named)} columns of {what.name} for {table.count} specimens; expected one each"
        )
    places += _read_column(what, table, named[number if len(named) > 1 else 0]) if named else []
    for value, place in places[1:]:
        if not sizes_agree(value, places[0][0]):
            raise InputError(
                f"{place}: {what.name} {value:g} {what.unit}, but {places[0][1]} states {places[0][0]:g} {what.unit}; "
                "keep the right value, or put specimens of different size into separate files"
            )
    own = given.get(what.key) if tiers is None else None
    if own is None:
        return places[0][0] if places else None
    what.check_plausible(own, what.option)
    for value, place in places[:1]:
        if not sizes_agree(own, value):
            raise InputError(
                f"{place}: {what.name} {value:g} {what.unit}, but {what.option} is {own:g} {what.unit}; correct one"
            )
    return own


def _read_head(what: Condition, table: LabTable, tier: int) -> list[Place]:
    """Read the values in rows above ``table`` with a label of rank ``tier``."""
    return [
        (what.check_plausible(*value), f"{table.place}:{line}")
        for line, cells in table.head
        for k, cell in enumerate(cells)
        if what.names(_split(cell)[0], [tier]) and (value := _read_value(what, table, line, cells[k:])) is not None
    ]


def _read_column(what: Condition, table: LabTable, column: int) -> list[Place]:
    """Read the different values of ``what`` in its column."""
    name, factor = table.names[column], what.units[table.unit(column, what.units) or what.unit]
    places: dict[float, str] = {}
    for (line, _), value in zip(table.body, table.numbers([column])[:, 0], strict=True):
        if not np.isnan(value):
            places.setdefault(float(value) * factor, f"{table.place}:{line}")
    if not places:
        raise InputError(
            f"{table.header_place}: column {name!r} is empty; remove it and give {what.option} [{what.unit}]"
        )
    return [(what.check_plausible(value, f"{place}: {name}"), place) for value, place in places.items()]


def _split(cell: str) -> tuple[str, str]:
    """Split a cell into label and number at its colon or equals sign."""
    label, *rest = _UP_TO.split(cell, maxsplit=1)
    behind = rest[0].strip() if rest else ""
    return (label.strip("# \t"), behind) if not behind or _VALUE.match(behind) else (cell.strip("# \t"), "")


def _read_value(what: Condition, table: LabTable, line: int, cells: Sequence[str]) -> Place | None:
    """Read the number in or after a cell with a label, and its name in messages; ``None`` without a number."""
    label, rest = _split(cells[0])
    behind = [cell for cell in (rest, *cells[1:]) if cell]
    found = _VALUE.match(behind[0]) if behind else None
    if found is None:
        return None
    unit = found[2].strip()
    if not unit and len(behind) > 1 and not NUMBER.match(behind[1]):
        labels_another = len(behind) > 2 and _VALUE.match(behind[2]) and not lab_units.find_unit(behind[1], what.units)
        unit = "" if labels_another else behind[1]
    own = re.fullmatch(r"[+-]?\d+([.,])(\d*)", found[1])  # a mark that cannot stand for thousands is its own
    value = read_number(table.place, line, found[1], own[1] if own and len(own[2]) != 3 else table.mark)
    plain = re.sub(r"\(([^()]*)\)", lambda text: text[0] if lab_units.is_unit(text[1]) else "", label)
    named = lab_units.find_stated_unit(plain, unit, what.units, f"{table.place}:{line}") or what.unit
    return value * what.units[named], f"{table.place}:{line}: {label}"


def unstated_error(missing: Sequence[Condition], path: object) -> InputError:
    """Error for a file that does not state the conditions ``missing``."""
    names = " and no ".join(w.name for w in missing)
    options = " and ".join(f"{w.option} [{w.unit}]" for w in missing)
    return InputError(f"{path}: the file states no {names}: give {options}")


def common_value(what: Condition, values: Sequence[float | None], specimens: Sequence[object]) -> float:
    """Mean of ``what`` over specimens, or files; raises :class:`InputError` if one lacks it or differs."""
    paths = [getattr(one, "path", one) for one in specimens]
    if None in values:
        raise unstated_error([what], paths[list(values).index(None)])
    found = [v for v in values if v is not None]
    for value, path in zip(found, paths, strict=True):
        if abs(value - found[0]) > SERIES * found[0]:
            raise InputError(
                f"{path}: {what.name} {value:g} {what.unit}, but {paths[0]} has {found[0]:g} {what.unit}; "
                "import series of different size into separate folders"
            )
    return found[0] if np.ptp(found) == 0.0 else float(np.mean(found))


@dataclass(frozen=True)
class StatedDirection:
    """A direction and the place that states it: a row, the file name or the folder name."""

    direction: Direction
    where: str


def find_direction(path: Path, head: Iterable[Row]) -> StatedDirection | None:
    """Find the direction in ``head``, the file name or the folder name; ``None`` if none of them names just one."""
    rows = ((f"{path}:{line}", " ".join(cells)) for line, cells in head)
    names = ((f"{path}: the file name", path.stem), (f"{path}: the folder name", path.parent.name))
    for where, text in (*rows, *names):
        plain = lab_units.pattern("directions", "fabric").sub(" ", lab_units.clean_name(text))
        named = [direction for direction in get_args(Direction) if lab_units.matches(plain, "directions", direction)]
        if len(named) == 1:
            return StatedDirection(named[0], where)
    return None
