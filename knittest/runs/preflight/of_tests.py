"""Counterparts of a fabric's numbers in its own tests and in its curves."""

from collections.abc import Iterator, Mapping

import numpy as np

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.base.layout import nearest
from knittest.base.resources import data_dir
from knittest.base.units import to_kernel
from knittest.config.fabric import Direction, Fabric
from knittest.config.own_rig import own_fields, own_value, taken_over
from knittest.config.yaml_loader import dotted
from knittest.experiment.tables import PublishedValue, for_width, published
from knittest.laboratory.base import tension_curve
from knittest.laboratory.curve_reach import MARGIN, reaches
from knittest.materials.heavy_elastica import bending_stiffness
from knittest.runs.preflight.counterpart import Counterpart, of_quantity

DIRECTIONS: tuple[Direction, Direction] = ("warp", "weft")
GRAVITY = 9.81  # [m/s2]
#: an input and the test that it was read from differ by rounding and by the mean of curves, not more [-]
SAME = 0.05
#: field of the fabric: quantity of tables, and its unit
PLAIN = {
    "warp_density": (("yarn_density",), "yarn/100 mm"),
    "weft_density": (("yarn_density",), "yarn/100 mm"),
    "loop_length": (("loop_length", "loop_length_mm"), "mm"),
    "area_mass": (("area_mass", "area_mass_g_m2"), "g/m2"),
    "thickness": (("thickness", "thickness_mm"), "mm"),
}


def test_counterparts(fabric: Fabric) -> Iterator[Counterpart]:
    """Densities, loops, mass, thickness, fracture strains, curves and bending beside the fabric's own experiment."""
    for field, (names, unit) in PLAIN.items():
        quantity = getattr(fabric, field)
        # an area mass may stand with the overhangs of either direction
        directions = DIRECTIONS if field == "area_mass" else (field.partition("_")[0],)
        found = {row.file: row for d in directions if quantity is not None and (row := _row(fabric, d, *names))}
        for row in found.values():
            yield of_quantity(field.replace("_", " "), field, unit, quantity, row.mean, _cited(row), SAME)
    for direction in DIRECTIONS:
        if "tension" not in fabric.macro.missing:
            yield _fracture_strain(fabric, direction)
            yield _end_of_curve(fabric, direction)
            yield _peak(fabric, direction)
        if "bending_stiffness" not in fabric.macro.missing:
            yield _bending(fabric, direction)
        for kind, record in kinds().items():
            yield from _of_rig(fabric, kind, record.measured, direction)


def _fracture_strain(fabric: Fabric, direction: Direction) -> Counterpart:
    row = _row(fabric, direction, "fracture_strain_pct")
    quantity = fabric.macro.fracture_strain.of(direction)
    return of_quantity(
        f"{direction} fracture strain", f"macro.fracture_strain.{direction}", "%", quantity,
        row.mean if row else None, _cited(row) if row else _no_row(fabric), SAME,
    )  # fmt: skip


def _end_of_curve(fabric: Fabric, direction: Direction) -> Counterpart:
    """The fracture strain beside the strain at the largest force of the curve that it ends."""
    quantity = fabric.macro.fracture_strain.of(direction)
    name, field = f"{direction} fracture strain", f"macro.fracture_strain.{direction}"
    try:
        (reach,) = reaches(fabric, {direction: tension_curve(fabric, direction)})
    except InputError as error:
        return of_quantity(name, field, "%", quantity, None, str(error))
    whose = "another fabric's curve" if reach.borrowed else "the curve"
    file = fabric.macro.curve_files.get(f"tension.{direction}")
    origin = f"largest force of {whose} {nearest(file) if file else 'in the file'}"
    return of_quantity(name, field, "%", quantity, reach.end, origin, MARGIN, (f"macro.tension.{direction}",))


def _peak(fabric: Fabric, direction: Direction) -> Counterpart:
    """Largest force per width of the curve beside that of the strips."""
    name, field = f"{direction} curve, largest force", f"macro.tension.{direction}"
    stated, source = largest_force(fabric, direction)
    row = _row(fabric, direction, "peak_force_n")
    if row is None or stated is None:
        reason = _no_row(fabric) if row is None else "the curve has no width"
        return Counterpart(name, field, "N/mm", stated or 0.0, source, None, reason)
    try:
        found = for_width(row, 1.0).mean
    except InputError as error:
        return Counterpart(name, field, "N/mm", stated, source, None, str(error))
    return Counterpart(name, field, "N/mm", stated, source, found, _cited(row), SAME * found)


def largest_force(fabric: Fabric, direction: Direction) -> tuple[float | None, str]:
    """Largest force per width [N/mm] of a curve, and what kind of curve it is."""
    try:
        curve = tension_curve(fabric, direction)
    except InputError:
        return None, ""
    return float(np.max(curve.mean)), curve.kind


def _bending(fabric: Fabric, direction: Direction) -> Counterpart:
    """Bending stiffness per width beside that of the overhang, B = w (L / 2)^3 (DIN 53362)."""
    quantity = fabric.macro.bending_stiffness.of(direction)
    row = _row(fabric, direction, "overhang_mm")
    weight = fabric.area_mass_g_per_mm2 * to_kernel(GRAVITY, "m/s2")
    found = None if row is None else bending_stiffness(row.mean, weight)
    origin = _no_row(fabric) if row is None else f"overhang {row.mean:g} mm and area_mass; {_cited(row)}"
    return of_quantity(
        f"{direction} bending stiffness", f"macro.bending_stiffness.{direction}", "N mm", quantity, found, origin, SAME
    )


def _of_rig(fabric: Fabric, kind: str, measured: Mapping[str, str], direction: Direction) -> Iterator[Counterpart]:
    """Numbers that runs of ``kind`` start from, where the file states any, beside the quantities ``measured``."""
    other = taken_over(fabric, kind, direction)
    for field, at in own_fields(fabric.rigs.get(kind, {}), kind, direction).items():
        if field not in measured:
            continue
        stated, row = own_value(fabric, kind, at), _row(fabric, direction, measured[field])
        name, source = f"{direction} {field.replace('_', ' ')}", "assumed" if field in other else "stated"
        path = dotted(("rigs", kind, *at))
        origin = _no_row(fabric) if row is None else _cited(row)
        found = None if row is None else row.mean
        yield Counterpart(name, path, "", stated, source, found, origin, SAME * (found or 0.0))


def _row(fabric: Fabric, direction: str, *names: str) -> PublishedValue | None:
    if fabric.experiment is None or fabric.experiment_variant is None:
        return None
    rows = published(data_dir() / fabric.experiment, fabric.experiment_variant, direction, names)
    return rows[0] if rows else None


def _cited(row: PublishedValue) -> str:
    scatter = f" ± {row.sd:.4g}" if row.sd == row.sd else ""
    unit = "" if row.unit == "1" else f" {row.unit}"
    return f"{row.table}: {row.mean:.5g}{scatter}{unit}"


def _no_row(fabric: Fabric) -> str:
    return "not in the fabric's experiment" if fabric.experiment else "the fabric names no experiment"
