"""Reads tables of overhang lengths (cantilever, DIN 53362): one row a reading; and what they say of the stiffness."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.fabric import MacroMaterial
from knittest.experiment import lab_units
from knittest.experiment.lab_checks import common, digest, refuse_apart
from knittest.experiment.lab_conditions import AREA_MASS, PLANE_ANGLE, WIDTH, Condition, agreed, needed, stated
from knittest.experiment.lab_direction import Said, refuse_other, said_by
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import DIRECTIONS, folder_name, read_statistics
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_numbers import NUMBER
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.lab_table import LabTable, read_table
from knittest.laboratory.cantilever.config import CantileverRig
from knittest.materials.heavy_elastica import STANDARD_ANGLE, bending_stiffness, overhang_ratio

Array = NDArray[np.float64]

OVERHANG = re.compile(r"over ?hang|überhang|ueberhang|(?<![a-z])l_?o(?![a-z])", re.I)
BENDING_LENGTH = re.compile(r"bending[ _-]*length|biege ?länge", re.I)
SPECIMEN = re.compile(r"specimen|sample|probe|prüfling|muster|(?<![a-z])(no|nr|id)(?![a-z])", re.I)
GRAVITY = 9.81
UNITS = {"overhang_mm": "mm", "bending_stiffness_n_mm_per_width": "N mm", "bending_stiffness_mncm2": "mN cm2"}
HEADS = {
    "overhang_mm": "overhang", "bending_stiffness_n_mm_per_width": "B per width",
    "bending_stiffness_mncm2": "B of the strip",
}  # fmt: skip


@dataclass(frozen=True)
class Bent:
    """Mean overhang [mm] of ``readings`` of one strip, as it would be at 41.5 deg; measured at ``angle`` [deg].

    ``area_mass`` in g/m2; ``width`` of the strip [mm] where it is known.
    """

    name: str
    overhang: float
    readings: tuple[float, ...]
    angle: float
    area_mass: float
    width: float | None
    path: Path
    said: Said | None

    @property
    def stiffness(self) -> float:
        """Bending stiffness per width [N mm] (Eq. 2)."""
        return bending_stiffness(self.overhang, to_kernel(self.area_mass, "g/m2") * to_kernel(GRAVITY, "m/s2"))


def read_overhangs(path: Path, given: Given) -> list[Bent]:
    """Strips in one table; readings with the same name in a column of specimens are those of one strip.

    The overhang needs a unit; area mass, plane angle (41.5 deg if not stated) and width come from the head or from
    ``given``. Raises :class:`InputError` with the row for what is no length, for bending lengths, which are half an
    overhang, and without an area mass.
    """
    table = read_table(
        path, lambda cells: _column(OVERHANG, cells) is not None or _column(BENDING_LENGTH, cells) is not None,
        "an overhang length", given.decimal, given.delimiter,
    )  # fmt: skip
    column = _column(OVERHANG, table.names)
    if column is None:
        raise InputError(f"{table.where}: a bending length is half the overhang at 41.5 deg: give the overhang lengths")
    name = table.names[column]
    unit = lab_units.stated(name, table.units[column], lab_units.LENGTH, table.where)
    if not unit:
        raise InputError(f"{table.where}: column {name!r}: a length without a unit: write '{name} [mm]' or '[cm]'")
    mass = needed(AREA_MASS, path, table.head, table.mark, given.sizes)
    angle, width = (
        agreed(w, given.sizes.get(w.key), stated(w, path, table.head, table.mark)) for w in (PLANE_ANGLE, WIDTH)
    )
    angle = STANDARD_ANGLE if angle is None else angle
    factor, said = at_standard_angle(angle), said_by(path, table.head)
    return [
        Bent(label, factor * float(np.mean(values)), tuple(values), angle, mass, width, path, said)
        for label, values in _readings(table, column, lab_units.LENGTH[unit]).items()
    ]


def at_standard_angle(angle: float) -> float:
    """Overhang at 41.5 deg over that at ``angle`` [deg], of the heavy elastica; raises :class:`InputError` where it is
    hardly bent, or hangs.
    """
    if not 5.0 <= angle <= 80.0:
        raise InputError(f"{PLANE_ANGLE.option} {angle:g}: expected 5 to 80 deg")
    return overhang_ratio(STANDARD_ANGLE, angle)


def _column(word: re.Pattern[str], cells: Sequence[str]) -> int | None:
    return next((k for k, cell in enumerate(cells) if word.search(cell) and not NUMBER.match(cell)), None)


def _readings(table: LabTable, column: int, factor: float) -> dict[str, list[float]]:
    """Overhangs [mm] of each specimen."""
    who = next((k for k, cell in enumerate(table.names) if k != column and SPECIMEN.search(cell)), None)
    found: dict[str, list[float]] = {}
    for line, cells in table.body:
        cell = cells[column] if column < len(cells) else ""
        where = f"{table.path}:{line}"
        if not cell:
            raise InputError(f"{where}: no overhang in column {table.names[column]!r}")
        value = table.number(line, cell) * factor
        try:
            check_bounds(value, field_meta(CantileverRig, "overhang"))
        except BoundsError as error:
            raise InputError(f"{where}: overhang {value:g} mm: {error.expected}") from None
        label = cells[who] if who is not None and who < len(cells) else ""
        found.setdefault(f"{table.path.stem}-{label or len(found) + 1}", []).append(value)
    if not found:
        raise InputError(f"{table.path}: no overhang lengths below line {table.line}")
    for name, values in found.items():
        refuse_apart([(name, table.path)] * len(values), np.array(values), "overhang", "mm")
    return found


def cantilever_results(strips: Sequence[Bent], direction: str, files: Sequence[str]) -> Results:
    """Overhangs and stiffnesses of ``strips`` of one series; raises :class:`InputError` where they are not of one."""
    paths = [s.path for s in strips]
    mass = common(AREA_MASS, [s.area_mass for s in strips], paths)
    angle = common(PLANE_ANGLE, [s.angle for s in strips], paths)
    refuse_apart([(s.name, s.path) for s in strips], np.array([s.overhang for s in strips]), "overhang", "mm")
    found = {
        "overhang_mm": np.array([s.overhang for s in strips]),
        "bending_stiffness_n_mm_per_width": np.array([s.stiffness for s in strips]),
    }
    for s in strips:
        try:
            check_bounds(s.stiffness, field_meta(MacroMaterial, "bending_stiffness"))
        except BoundsError as error:
            raise InputError(
                f"{s.path}: specimen {s.name}: bending stiffness {s.stiffness:g} N mm: {error.expected}"
            ) from None
    sizes: list[tuple[Condition, float]] = [(AREA_MASS, mass)]
    more = f"for {STANDARD_ANGLE:g} deg" + ("" if angle == STANDARD_ANGLE else f", measured at {angle:g} deg")
    if all(s.width is not None for s in strips):
        width = common(WIDTH, [s.width for s in strips], paths)
        sizes.append((WIDTH, width))
        found["bending_stiffness_mncm2"] = found["bending_stiffness_n_mm_per_width"] * width * 10.0
    readings = np.concatenate([s.readings for s in strips])
    digests = [digest(readings)] if len(readings) > 2 else []  # fewer may agree by chance
    return Results("cantilever", direction, found, UNITS, sizes, ("strip", more), files, digests)


def cantilever_lines(strips: Sequence[Bent]) -> list[str]:
    """Table of overhangs and stiffnesses with mean and sd, and what they hang on."""
    results = cantilever_results(strips, "", [])
    heads = [(f"{HEADS[name]} [{UNITS[name]}]", ".5g") for name in results.found]
    table = np.array(list(results.found.values())).T
    lines = table_lines(heads, [(s.name, values) for s, values in zip(strips, table, strict=True)])
    angle = strips[0].angle
    turned = "" if angle == STANDARD_ANGLE else f"; overhangs are for {STANDARD_ANGLE:g} deg, by the heavy elastica"
    lines.append(f"plane at {angle:g} deg{turned}; B = area mass x g x (overhang / 2)^3")
    lines.append("overhangs are taken as corrected, for a strip that curls as well")
    return lines + [f"{what.name}: {value:g} {what.unit}" for what, value in results.conditions]


def write_cantilever(
    strips: Sequence[Bent], out: Path, direction: str, files: Sequence[str], trusted: bool = False
) -> str:
    """Write ``cantilever-<direction>.csv`` and its statistics into the experiment ``out``; returns its variant."""
    if not trusted:
        refuse_other([s.said for s in strips], direction)
    results = cantilever_results(strips, direction, files)
    _refuse_other_mass(out, direction, results)
    write_results(out, results)
    finish(out)
    return out.resolve().name


def _refuse_other_mass(out: Path, direction: str, results: Results) -> None:
    """Raise :class:`InputError` where the strips across were imported with another area mass: a fabric has one."""
    (own,) = (value for what, value in results.conditions if what is AREA_MASS)
    for other in DIRECTIONS:
        name = folder_name("cantilever", other)
        test = read_statistics(out).get(name) if other != direction else None
        if test is not None:
            common(AREA_MASS, [test["conditions"][AREA_MASS.key], own], [out / name, ", ".join(results.files)])
