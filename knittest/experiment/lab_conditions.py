"""Conditions of a laboratory test (widths, sides, forces): what its file states, and whether the user says the same."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.fabric import Fabric
from knittest.config.rigs import StripRig
from knittest.config.run import rig_model
from knittest.experiment import lab_units
from knittest.experiment.lab_numbers import NUMBER, read_number
from knittest.experiment.lab_rows import Row

_VALUE = re.compile(r"([+-]?\d[\d.,]*)\s*(.*)", re.S)
#: difference [-] of two numbers that are meant to be the same
SAME = 0.005
_UP_TO = re.compile(r"[:=]")
_LONGEST_LABEL = 200


@dataclass(frozen=True)
class Condition:
    """A number that results of a test hang on, with its place in files and commands.

    ``key`` names it in tables and in heads of curves, ``option`` on the command line. A cell names it by the first of
    ``labels`` that any cell of a head matches, unless ``other`` matches too; ``units`` are factors to ``unit``. Its
    bounds are those of the field ``field`` of ``model``, or of the rig of the test that it names; none without.
    """

    key: str
    name: str
    option: str
    unit: str
    labels: tuple[str, ...]
    other: str
    units: dict[str, float]
    model: type[BaseModel] | str
    field: str

    @property
    def one(self) -> str:
        """Name with its article."""
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"

    def names(self, cell: str, tier: int) -> bool:
        """Tell whether ``cell`` names this condition by label ``tier``."""
        cell = cell[:_LONGEST_LABEL]
        return bool(re.search(self.labels[tier], cell, re.I)) and not re.search(self.other, cell, re.I)

    def plausible(self, value: float, said: str) -> float:
        """``value`` [unit]; raises :class:`InputError` outside the field's bounds, with the likely unit."""
        if not self.field:
            return value
        model = rig_model(self.model) if isinstance(self.model, str) else self.model
        try:
            check_bounds(value, field_meta(model, self.field))
        except BoundsError as error:
            raise InputError(f"{said} {value:g}: {error.expected}") from None
        return value


#: parts of machines and yarns, whose widths and lengths are others
_MACHINE = r"jaw|clamp|grip|klemm|einspann|backe|yarn|garn|roll|ware"
_PIECE = r"strip|specimen|sample|test ?piece|coupon|initial|nominal|original"
_STUECK = r"proben?|streifen|prüflings?|prüfkörper|muster|anfangs"
GAUGE = Condition(
    "gauge_length_mm", "gauge length", "--gauge-length", "mm",
    # an extensometer's gauge ("Messlänge") is another length
    (r"einspannl|klemml|gau?ge[ _-]?length|grip sep|clamp(ing)? (dist|len)|distance of the clamps",
     r"anfangsl|ausgangsl|\bL0\b"),
    r"extensometer", lab_units.LENGTH, "tensile", "gauge_length",
)  # fmt: skip
WIDTH = Condition(
    "strip_width_mm", "strip width", "--width", "mm",
    (rf"({_PIECE})[ _-]*width(?![a-z])|(?<![a-zäöü])({_STUECK})[ _-]*breite(?![a-z])",
     r"^\W*width(?![a-z])|^\W*breite(?![a-z])", r"^\W*b_?0?\W*(mm|cm|m)?\W*$"),
    _MACHINE + r"|plate|platte|frame|rahmen|tolerance|toleranz", lab_units.LENGTH, StripRig, "width",
)  # fmt: skip

FRAME_SIDE = Condition(
    "frame_side_mm", "frame side", "--frame-side", "mm",
    (r"(frame|arm)[ _-]*(side|length)|(side|length)[ _-]of[ _-]the[ _-](frame|arms?)|"
     r"rahmen(seite|länge|kante)|schenkell",),
    r"fabric|specimen|sample|probe|gewebe|stoff", lab_units.LENGTH, "picture-frame", "frame_side",
)  # fmt: skip
FABRIC_SIDE = Condition(
    "fabric_side_mm", "fabric side", "--fabric-side", "mm",
    (r"(fabric|specimen|sample)[ _-]*(side|length)|side[ _-]of[ _-]the[ _-](fabric|specimen|sample)|"
     r"(proben?|stoff|gewebe|prüf)[ _-]*(seite|seitenlänge|kante|kantenlänge)(?![a-z])",),
    r"frame|rahmen", lab_units.LENGTH, "picture-frame", "side",
)  # fmt: skip
AREA_MASS = Condition(
    "area_mass_g_m2", "area mass", "--area-mass", "g/m2",
    (r"area[ _-]*(mass|weight|density)|areal[ _-]*(mass|weight|density)|mass per (unit )?area|grammage|"
     r"fl[äa]chen(masse|gewicht)|grammatur",),
    r"plate|platte|yarn|garn", lab_units.AREA_MASS, Fabric, "area_mass",
)  # fmt: skip
PLANE_ANGLE = Condition(
    "plane_angle_deg", "angle of the plane", "--plane-angle", "deg",
    (r"angle of the plane|plane[ _-]*angle|(bending|chord|slope|inclin\w*)[ _-]*angle|neigungswinkel|ebenenwinkel|"
     r"messwinkel|biegewinkel",),
    r"shear|scher", lab_units.ANGLE, "cantilever", "plane_angle",
)  # fmt: skip
NORMAL_FORCE = Condition(
    "normal_force_n", "normal force", "--normal-force", "N",
    (r"normal[ _-]*(force|load)|normalkraft|andruckkraft|anpresskraft|clamping force",),
    r"coefficient", lab_units.FORCE, "friction", "normal_force",
)  # fmt: skip
PLATE_LENGTH = Condition(
    "plate_length_mm", "plate length", "--plate-length", "mm",
    (r"(plate|sled)[ _-]*length|length[ _-]of[ _-]the[ _-]plate|(platten|schlitten)[ _-]*länge",),
    r"strip|specimen|probe", lab_units.LENGTH, "friction", "plate_length",
)  # fmt: skip
PLATE_WIDTH = Condition(
    "plate_width_mm", "plate width", "--plate-width", "mm",
    (r"(plate|sled)[ _-]*width|width[ _-]of[ _-]the[ _-]plate|(platten|schlitten)[ _-]*breite",),
    r"strip|specimen|probe", lab_units.LENGTH, "friction", "plate_width",
)  # fmt: skip

RATIO = Condition(
    "strain_ratio", "strain ratio", "--ratio", "1",
    (r"strain[ _-]*ratio|ratio[ _-]of[ _-](the[ _-])?strains|dehnungsverhältnis",),
    r"force|kraft", {"1": 1.0}, "biaxial", "ratio",
)  # fmt: skip

EMBEDDED = Condition(
    "embedded_length_mm", "embedded length", "--embedded-length", "mm",
    (r"embedded[ _-]*length|(?<!un)eingebettete[ _-]*länge|einbettlänge",), r"loop|masche", lab_units.LENGTH,
    "pull-out", "length",
)  # fmt: skip
CROSSING_DENSITY = Condition(
    "crossing_density_per_100_mm", "density of the crossing yarns", "--crossing-density", "yarn/100 mm",
    (r"(crossing|cross)[ _-]*(yarns?[ _-]*)?density|density[ _-]of[ _-]the[ _-]crossing[ _-]yarns|kreuzungsdichte|"
     r"dichte[ _-]der[ _-]kreuzenden",),
    r"area|linear|fläche", {"yarn/100 mm": 1.0, "yarn/cm": 10.0, "yarn/inch": 100.0 / 25.4}, Fabric, "warp_density",
)  # fmt: skip


def _found(key: str, name: str, unit: str, model: str = "", field: str = "") -> Condition:
    """Condition that an import finds by itself: no label and no option states it."""
    return Condition(key, name, "", unit, (), "", {}, model, field)


CLAMPED_EDGES = _found("clamped_edges", "number of clamped edges", "1")
SLID_PITCHES = _found("slid_pitches", "number of pitches slid", "1")
CYCLES = _found("cycles", "number of cycles", "1", "picture-frame", "cycles")
CYCLE_ANGLE = _found("cycle_angle_deg", "angle at which cycles turn", "deg", "picture-frame", "max_angle")


def stated(what: Condition, path: Path, head: Sequence[Row], mark: str) -> tuple[float, str] | None:
    """Value of ``what`` [its unit] in the rows above a table, and ``file:line``; ``None`` when no row states one.

    ``mark`` is the decimal mark of the table. Raises :class:`InputError` for an unknown unit, an implausible number, or
    rows that contradict each other.
    """
    for tier in range(len(what.labels)):
        found = [
            (what.plausible(*value), where)
            for line, cells in head
            for k, cell in enumerate(cells)
            if what.names(_split(cell)[0], tier)
            and (where := f"{path}:{line}")
            and (value := _value(what, path, line, cells[k:], mark)) is not None
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


def needed(what: Condition, path: Path, head: Sequence[Row], mark: str, given: Mapping[str, float]) -> float:
    """The value of ``what`` by the file's ``head`` and by the user (by key); raises where neither states it."""
    value = agreed(what, given.get(what.key), stated(what, path, head, mark))
    if value is None:
        raise unstated([what], path)
    return value


def unstated(wanted: Iterable[Condition], path: object) -> InputError:
    """The refusal of a file that leaves open what its results hang on."""
    missing = list(wanted)
    names = " and no ".join(w.name for w in missing)
    options = " and ".join(f"{w.option} [{w.unit}]" for w in missing)
    return InputError(f"{path}: the file states no {names}: give {options}")


def same(one: float, other: float) -> bool:
    """Tell whether two numbers are meant to be the same."""
    return abs(one - other) <= SAME * abs(other)


def _split(cell: str) -> tuple[str, str]:
    """Label of a cell and what stands behind its colon or equals sign."""
    label, *rest = _UP_TO.split(cell, maxsplit=1)
    return label.strip("# \t"), rest[0].strip() if rest else ""


def _value(what: Condition, path: Path, line: int, cells: Sequence[str], mark: str) -> tuple[float, str] | None:
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
    value = read_number(path, line, found[1], _mark(found[1], mark))
    named = lab_units.stated(label, unit, what.units, f"{path}:{line}") or what.unit
    return value * what.units[named], f"{path}:{line}: {label}"


def _mark(text: str, table: str) -> str:
    """Decimal mark of one number: that of the table, unless its only mark cannot stand for thousands."""
    own = re.fullmatch(r"[+-]?\d+([.,])(\d*)", text)
    return own[1] if own and len(own[2]) != 3 else table
