"""Reads friction exports of testing machines: pull force of a strip between two plates over its travel."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.experiment import lab_units
from knittest.experiment.lab_checks import common, digest, refuse_apart, refuse_copies
from knittest.experiment.lab_conditions import NORMAL_FORCE, PLATE_LENGTH, PLATE_WIDTH, needed
from knittest.experiment.lab_csv import FORCE
from knittest.experiment.lab_direction import Said, refuse_other, said_by
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import curve_text
from knittest.experiment.lab_given import Given, first_loading, tared
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_numbers import NUMBER
from knittest.experiment.lab_picture import plot
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.lab_sign import drawn, pulled
from knittest.experiment.lab_table import LabTable, columns, read_table, refuse_shared, with_nearest
from knittest.experiment.lab_units import likely_force
from knittest.experiment.statistics import band as corridor_band

Array = NDArray[np.float64]

TRAVEL = re.compile(r"displacement|travel|weg|extension|traverse|crosshead", re.I)
NORMAL = re.compile(r"normal|andruck|anpress|clamp", re.I)
#: last share of the travel, whose mean force is the kinetic one; the largest before it is the static one: as in a run
KINETIC_SHARE = 0.5
#: travel of a test [mm], and Coulomb coefficient of one face
TRAVELS, COEFFICIENTS = (1.0, 1000.0), (0.005, 2.0)
SIZES = (NORMAL_FORCE, PLATE_LENGTH, PLATE_WIDTH)
#: coefficients of a face
STATIC, KINETIC = "mu_static_per_face", "mu_per_face"
UNITS = {"pull_force_static_n": "N", "pull_force_kinetic_n": "N", "mu_paper": "1", KINETIC: "1", STATIC: "1"}
HEADS = ("static [N]", "kinetic [N]", "F_R/F_N of two faces", "of a face")


@dataclass(frozen=True)
class Rubbed:
    """Travel [mm] from the start and pull force [N] of one strip, (n,) each; ``faces`` of it rub.

    ``sizes`` are normal force [N], length and width [mm] of the plates; ``unit`` is that of the file's pull forces.
    """

    name: str
    travel: Array
    force: Array
    sizes: tuple[float, float, float]
    faces: int
    path: Path
    said: Said | None
    unit: str = "N"

    @property
    def kinetic(self) -> float:
        """Mean force [N] over the last half of the travel, over travel and not over samples."""
        late = np.linspace((1.0 - KINETIC_SHARE) * self.travel[-1], self.travel[-1], 1001)
        return float(np.interp(late, self.travel, self.force).mean())

    @property
    def static(self) -> float:
        """Largest force [N] before half the travel."""
        return float(self.force[self.travel <= (1.0 - KINETIC_SHARE) * self.travel[-1]].max())

    @property
    def coefficient(self) -> float:
        """Coulomb coefficient of one face [-]: F_R / (faces F_N)."""
        return self.kinetic / (self.faces * self.sizes[0])

    @property
    def static_coefficient(self) -> float:
        """The same of the largest force before half the travel."""
        return self.static / (self.faces * self.sizes[0])


def read_friction(path: Path, given: Given) -> list[Rubbed]:
    """Strips in one export, told apart by repeated pairs of columns of travel and pull force.

    Raises :class:`InputError` where normal force or plates are not known, for units, text and gaps as
    :func:`knittest.experiment.lab_csv.read_lab`, for a travel that is none, and a start that is not free of force.
    """
    table = read_table(
        path, lambda cells: bool(_pairs(cells)), "a pull force and a travel", given.decimal, given.delimiter
    )
    normal, long, wide = (needed(what, path, table.head, table.mark, given.sizes) for what in SIZES)
    pairs, said = _pairs(table.names), said_by(path, table.head)
    refuse_shared(table, pairs)
    found = []
    for number, pair in enumerate(pairs, 1):
        name = path.stem if len(pairs) == 1 else f"{path.stem}-{number}"
        travel, force = _curve(table, name, pair, given)
        unit = lab_units.force_unit(table.names[pair[1]], table.units[pair[1]], table.where)
        found.append(Rubbed(name, travel, force, (normal, long, wide), given.faces, path, said, unit))
    return found


def _pairs(cells: list[str]) -> list[tuple[int, int]]:
    """Columns of (travel, pull force), each force with the nearest travel before it, else after it."""
    words = [(k, cell) for k, cell in enumerate(cells) if not NUMBER.match(cell)]
    forces = [k for k, cell in words if FORCE.search(cell) and not NORMAL.search(cell)]
    travels = [k for k, cell in words if TRAVEL.search(cell) and k not in forces]
    return with_nearest(travels, forces)


def _curve(table: LabTable, name: str, pair: tuple[int, int], given: Given) -> tuple[Array, Array]:
    """Travel [mm] and pull force [N] of the first way out in the columns ``pair``."""
    where = f"{table.path}: specimen {name}"
    _, values = columns(table, pair, name)
    way, pull = pair
    unit = lab_units.stated(table.names[way], table.units[way], lab_units.LENGTH, table.where) or "mm"
    force_factor = lab_units.FORCE[lab_units.force_unit(table.names[pull], table.units[pull], table.where)]
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        travel, force = drawn(values[:, 0], given.sign) * lab_units.LENGTH[unit], values[:, 1] * force_factor
    if not np.isfinite(force).all():
        raise InputError(f"{where}: no finite force")
    rows, _ = first_loading(travel)
    travel, force = travel[rows] - travel[0], pulled(force[rows], given.sign, where)
    if len(travel) < 3 or not TRAVELS[0] <= travel[-1] <= TRAVELS[1]:
        raise InputError(
            f"{where}: {len(travel)} rows over a travel of {travel[-1]:.4g} mm: expected at least 3, over "
            f"{TRAVELS[0]:g} to {TRAVELS[1]:g} mm: check the unit of the travel"
        )
    return travel, tared(force, given.preload, where)


def friction_results(strips: Sequence[Rubbed], direction: str, files: Sequence[str]) -> Results:
    """Pull forces and coefficients of one series; raises :class:`InputError` where they are not of one.

    ``mu_paper`` is F_R / F_N of a strip between two plates (Eq. 3 of Pham et al., 2019), ``mu_per_face`` half of it. Of
    a strip that rubs on one face alone the pull forces are no rows: they are those of another test.
    """
    paths = [s.path for s in strips]
    sizes = [(what, common(what, [s.sizes[k] for s in strips], paths)) for k, what in enumerate(SIZES)]
    for s in strips:
        if not COEFFICIENTS[0] <= s.coefficient <= COEFFICIENTS[1]:
            band = (COEFFICIENTS[0] * s.faces * s.sizes[0], COEFFICIENTS[1] * s.faces * s.sizes[0])
            raise InputError(
                f"{s.path}: specimen {s.name}: {s.kinetic:.4g} N of pull under {s.sizes[0]:g} N is a coefficient of "
                f"{s.coefficient:.4g} a face: implausible, expected {COEFFICIENTS[0]:g} to {COEFFICIENTS[1]:g}"
                f"{likely_force(s.kinetic, s.unit, band)}: check the units of both forces"
            )
    per_face = np.array([s.coefficient for s in strips])
    refuse_apart([(s.name, s.path) for s in strips], per_face, "coefficient of a face", "")
    digests = [digest(s.travel, s.force) for s in strips]
    refuse_copies([(s.name, d) for s, d in zip(strips, digests, strict=True)])
    found = {
        "mu_paper": 2.0 * per_face, KINETIC: per_face, STATIC: np.array([s.static_coefficient for s in strips]),
    }  # fmt: skip
    if strips[0].faces == 2:
        scale = sizes[0][1] / np.array([s.sizes[0] for s in strips])
        forces = np.array([(s.static, s.kinetic) for s in strips]).T * scale
        found = dict(zip(("pull_force_static_n", "pull_force_kinetic_n"), forces, strict=True)) | found
    more = f"under {sizes[0][1]:g} N, {strips[0].faces} face{'s' * (strips[0].faces > 1)} rubbing"
    return Results("friction", direction, found, UNITS, sizes, ("strip", more), files, digests)


def friction_lines(strips: Sequence[Rubbed]) -> list[str]:
    """Table of forces and coefficients with mean and sd, how they are defined, and what they hang on."""
    results = friction_results(strips, "", [])
    rows = [(s.name, (s.static, s.kinetic, 2.0 * s.coefficient, s.coefficient)) for s in strips]
    lines = table_lines([(head, ".4g") for head in HEADS], rows)
    lines.append(
        f"kinetic: mean over the last half of the travel; static: largest before it; {strips[0].faces} "
        f"face{'s' * (strips[0].faces > 1)} rubbing (--faces)"
    )
    lines.append(
        "pull forces are taken as those of the strip alone: what the empty rig takes must have been subtracted"
    )
    return lines + [f"{what.name}: {value:g} {what.unit}" for what, value in results.conditions]


def write_friction(
    strips: Sequence[Rubbed], out: Path, direction: str, files: Sequence[str], trusted: bool = False
) -> str:
    """Write table and folder ``friction-<direction>`` into the experiment ``out``; returns the variant."""
    if not trusted:
        refuse_other([s.said for s in strips], direction)
    results = friction_results(strips, direction, files)
    end = min(float(s.travel[-1]) for s in strips)
    corridor = corridor_band([(s.travel, s.force) for s in strips], end, "travel")
    inner = write_results(out, results)
    notes = results.notes(out)
    for number, s in enumerate(strips, 1):
        text = curve_text([f"# specimen: {s.name}", *notes[1:]], {"displacement_mm": s.travel, "pull_force_n": s.force})
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    mean = {"displacement_mm": corridor.strain, "pull_force_n": corridor.mean, "pull_force_sd_n": corridor.sd}
    write_atomic(inner / "corridor.csv", curve_text(notes, mean))
    plot([(s.travel, s.force) for s in strips], corridor, ("travel [mm]", "pull force [N]"), inner / "curves.png")
    finish(out)
    return out.resolve().name
