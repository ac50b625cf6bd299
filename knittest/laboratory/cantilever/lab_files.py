"""Tables of overhang lengths (cantilever, DIN 53362), one row a reading, and what they say of the stiffness."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.config.fabric import MacroMaterial
from knittest.experiment import lab_results as results
from knittest.experiment.lab_conditions import AREA_MASS, PLANE_ANGLE, WIDTH, check_within_bounds, common_value
from knittest.experiment.lab_recording import Origin, Recording, recordings
from knittest.experiment.lab_results import Results, Tests, count_text, quantity_entry, statistics_by_direction
from knittest.experiment.lab_shear import digest, refuse_outliers
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.lab_tests import LabTest
from knittest.laboratory.cantilever.config import CantileverRig
from knittest.materials.heavy_elastica import STANDARD_ANGLE, bending_stiffness, overhang_ratio

NAME = "cantilever"
GRAVITY = 9.81
HEADS = {
    "overhang_mm": ("overhang", "mm"), "bending_stiffness_n_mm_per_width": ("B per width", "N mm"),
    "bending_stiffness_mncm2": ("B of the strip", "mN cm2"),
}  # fmt: skip


@dataclass(frozen=True)
class OverhangReadings(Origin):
    """Mean overhang [mm] of ``readings`` of a strip, at 41.5 deg; their ``angle`` [deg], mass [g/m2] and width [mm]."""

    overhang: float
    readings: Sequence[float]
    angle: float
    area_mass: float
    width: float | None

    @property
    def stiffness(self) -> float:
        """Bending stiffness per width [N mm] (Eq. 2)."""
        return bending_stiffness(self.overhang, to_kernel(self.area_mass, "g/m2") * to_kernel(GRAVITY, "m/s2"))


def _read_strips(path: Path, given: ReadOptions) -> list[OverhangReadings]:
    """Read the strips of a file: columns of overhangs and rows of the same specimen are readings of one strip."""
    found = []
    for r in recordings(path, given, [("overhang", "bending_length")], "an overhang length", own=("flexure",)):
        which = r.table.columns_of_roles("overhang")
        if not which:
            raise InputError(
                f"{r.table.header_place}: a bending length is half the overhang at 41.5 deg: give overhang lengths"
            )
        (mass,), angle, width = r.require(AREA_MASS), r.find(PLANE_ANGLE), r.find(WIDTH)
        angle = STANDARD_ANGLE if angle is None else angle
        factor, readings = standard_overhang_ratio(angle), _readings(r, which)
        labels = dict.fromkeys(r.table.columns_of_roles("specimen")[:1], "names of specimens")
        origin = r.origin(dict.fromkeys(which, "overhang") | labels)
        for label, values in readings.items():
            origin["name"], overhang = label, factor * float(np.mean(values))
            found.append(
                OverhangReadings(**origin, overhang=overhang, readings=values, angle=angle, area_mass=mass, width=width)
            )
    return found


def standard_overhang_ratio(angle: float) -> float:
    """Overhang at 41.5 deg over that at ``angle`` [deg], by the heavy elastica."""
    if not 5.0 <= angle <= 80.0:
        raise InputError(f"{PLANE_ANGLE.option} {angle:g}: expected 5 to 80 deg")
    return overhang_ratio(STANDARD_ANGLE, angle)


def _readings(r: Recording, which: Sequence[int]) -> dict[str, list[float]]:
    table, who = r.table, next(iter(r.table.columns_of_roles("specimen")), None)
    values = np.array([r.unit_of(k)[1] for k in which]) * table.numbers(which)
    found: dict[str, list[float]] = {}
    for (line, cells), row in zip(table.body, values, strict=True):
        filled = row[~np.isnan(row)].tolist()
        if not filled:
            r.notes.append(f"line {line} left out: no overhang in column {table.names[which[0]]!r}")
            continue
        if len(filled) < len(which):
            raise InputError(
                f"{table.place}:{line}: {len(filled)} of {len(which)} readings: ends and faces differ, so all are "
                "needed for the mean: add the others, or remove the row"
            )
        for value in filled:
            check_within_bounds(value, CantileverRig, "overhang", f"{table.place}:{line}: overhang {value:g} mm")
        label = cells[who] if who is not None and who < len(cells) else ""
        found.setdefault(f"{r.path.stem}-{label or len(found) + 1}", []).extend(filled)
    if not found:
        raise InputError(f"{table.place}: no overhang lengths below line {table.line}")
    for name, some in found.items():
        refuse_outliers([Origin(name, path=r.path)] * len(some), np.array(some), "overhang", "mm")
    return found


def _results(strips: Sequence[OverhangReadings]) -> Results:
    sizes = [(AREA_MASS, common_value(AREA_MASS, [s.area_mass for s in strips], strips))]
    angle = common_value(PLANE_ANGLE, [s.angle for s in strips], strips)
    overhang, stiffness = np.array([[s.overhang, s.stiffness] for s in strips]).T
    refuse_outliers(strips, overhang, "overhang", "mm")
    for s in strips:
        check_within_bounds(
            s.stiffness, MacroMaterial, "bending_stiffness", f"{s.place}: bending stiffness {s.stiffness:g} N mm"
        )
    found = dict(zip(HEADS, (overhang, stiffness), strict=False))
    if all(s.width is not None for s in strips):
        sizes.append((WIDTH, common_value(WIDTH, [s.width for s in strips], strips)))
        found["bending_stiffness_mncm2"] = stiffness * sizes[1][1] * 10.0
    readings = np.concatenate([s.readings for s in strips])
    other = "" if angle == STANDARD_ANGLE else f", measured at {angle:g} deg"
    turned = other and f"; overhangs are for {STANDARD_ANGLE:g} deg, by the heavy elastica"
    return Results(
        found, {name: unit for name, (_, unit) in HEADS.items()}, sizes,
        ("strip", f"for {STANDARD_ANGLE:g} deg{other}"),
        [digest(readings)] if len(readings) > 2 else [],  # fewer may agree by chance
        [("{} [{}]".format(*HEADS[name]), ".5g", values) for name, values in found.items()],
        [
            f"plane at {strips[0].angle:g} deg{turned}; B = area mass x g x (overhang / 2)^3",
            "overhangs must be corrected for curl",
        ],
    )  # fmt: skip


def _check_same_area_mass(out: Path, own: Results) -> None:
    """Raise :class:`InputError` where the strips across were imported with another area mass."""
    for direction, test in statistics_by_direction(results.read_statistics(out), NAME).items():
        if direction != own.direction:
            masses = [test["conditions"][AREA_MASS.key], dict(own.conditions)[AREA_MASS]]
            common_value(AREA_MASS, masses, [out / results.folder_name(NAME, direction), ", ".join(own.files)])


def _fabric(tests: Tests, place: Path) -> dict[str, Any]:
    """Bending stiffness of the macro model by direction, and the area mass that came with the overhangs."""
    own = statistics_by_direction(tests, NAME)
    if not own:
        return {}
    masses = {direction: test["conditions"][AREA_MASS.key] for direction, test in own.items()}
    mean = {"mean": sum(masses.values()) / len(masses), "sd": None}
    bending = {}
    for direction, test in own.items():  # from each strip's overhang
        found, overhang = test["bending_stiffness_n_mm_per_width"], test["overhang_mm"]["mean"]
        of = f"{count_text(found['n'], 'strip')}, overhang {overhang:.4g} mm, {masses[direction]:g} g/m2"
        bending[direction] = quantity_entry(found, "derived", f"area mass x g x (overhang / 2)^3; {of}")
    for other in results.DIRECTIONS:
        if other not in bending:
            (tested,) = own
            assumed = {"mean": bending[tested]["value"], "sd": None}
            bending[other] = quantity_entry(assumed, "assumed", f"as {tested}: none of the {other}")
    ref = f"stated with {place.as_posix()}: {', '.join(results.folder_name(NAME, direction) for direction in own)}"
    return {
        "area_mass": quantity_entry(mean, "measured", ref),
        "macro": {"bending_stiffness": {direction: bending[direction] for direction in results.DIRECTIONS}},
    }


LAB = LabTest(
    NAME, _read_strips, _results, (AREA_MASS, PLANE_ANGLE, WIDTH), fabric=_fabric, check=_check_same_area_mass
)
