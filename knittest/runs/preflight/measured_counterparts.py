"""Counterparts of the values of a fabric in its own tests and curves."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.kinds import kinds
from knittest.base.layout import shorten_path, table, wrap_line
from knittest.base.units import to_kernel
from knittest.config.base import Quantity
from knittest.config.fabric import Direction, Fabric
from knittest.config.loading import other_direction_fields, rig_default_paths, rig_default_value
from knittest.config.yaml_loader import dotted_path
from knittest.experiment.origin import owner_of
from knittest.experiment.tables import PublishedValue, published_rows, scale_to_width
from knittest.laboratory.base import MARGIN, curve_coverages, tension_curve
from knittest.materials.heavy_elastica import bending_stiffness


@dataclass(frozen=True)
class Counterpart:
    """Quantity ``name`` [``unit``]: ``stated`` in ``field`` of the file with its ``source``, ``found`` by ``origin``.

    ``found`` is None without a counterpart; ``origin`` is then the reason. Both agree within ``tolerance`` [``unit``],
    that of the method or the scatter of the specimens. ``inputs`` are the fields that ``found`` was computed from.
    ``owner`` is another fabric from which ``field`` and some of ``inputs`` were taken.
    """

    name: str
    field: str
    unit: str
    stated: float
    source: str
    found: float | None
    origin: str
    tolerance: float = 0.0
    inputs: tuple[str, ...] = ()
    owner: str = ""

    @property
    def verdict(self) -> str:
        """``agrees``, ``differs``, ``no counterpart``, or ``taken over`` (both values are another fabric's)."""
        if self.found is None:
            return "no counterpart"
        if abs(self.stated - self.found) > self.tolerance * (1.0 + 1e-9):
            return "differs"
        return "taken over" if self.owner else "agrees"

    @property
    def difference(self) -> float | None:
        """Relative difference to the counterpart [-]."""
        return self.stated / self.found - 1.0 if self.found else None

    def as_json(self) -> dict[str, object]:
        """All fields, for a program."""
        found = {
            "quantity": self.name, "field": self.field, "unit": self.unit, "in_file": self.stated,
            "source": self.source, "counterpart": self.found, "from": self.origin, "tolerance": self.tolerance,
        }  # fmt: skip
        share = self.difference
        return found | {"difference_pct": None if share is None else 100.0 * share, "verdict": self.verdict}


def make_counterpart(
    name: str, field: str, unit: str, quantity: Quantity, found: float | None, origin: str, share: float = 0.0,
    inputs: tuple[str, ...] = (), least: float = 0.0,
) -> Counterpart:  # fmt: skip
    """Counterpart of a ``quantity``; both agree within ``share`` [-] of ``found``, or within ``least`` in its unit."""
    tolerance = max(share * abs(found or 0.0), least)
    return Counterpart(name, field, unit, quantity.value, quantity.source, found, origin, tolerance, inputs)


def add_owner(row: Counterpart, fabric: Fabric) -> Counterpart:
    """``row`` with the other fabric from which both of its values were taken, if they were."""
    owner = owner_of(fabric, row.field)
    return replace(row, owner=owner) if owner and any(owner_of(fabric, name) for name in row.inputs) else row


def table_cells(rows: list[Counterpart]) -> list[tuple[str, ...]]:
    """Cells of the table of counterparts, with a head."""
    cells: list[tuple[str, ...]] = [
        ("quantity", "in the file", "", "counterpart", "difference", "verdict", "counterpart from")
    ]
    for row in rows:
        other = "-" if row.found is None else f"{row.found:.4g} {row.unit}".rstrip()
        share = row.difference
        difference = "-" if share is None else f"{100.0 * share:+.1f} %"
        stated = f"{row.stated:.4g} {row.unit}".rstrip()
        cells.append((row.name, stated, row.source, other, difference, row.verdict, row.origin))
    return cells


def table_lines(rows: list[Counterpart], width: int | None) -> list[str]:
    """Lines of the table of counterparts; where it is wider than ``width``, two lines for each counterpart."""
    lines = [line for row in table(table_cells(rows), indent="  ") for line in row]
    if width is None or max(map(len, lines)) <= width:
        return lines
    pairs = []
    for name, stated, source, other, difference, verdict, origin in table_cells(rows)[1:]:
        off = "" if difference == "-" else f", {difference}"
        found = origin if other == "-" else f"{other}: {origin}"
        pairs += wrap_line(f"  {name}: {verdict}{off}", width)
        pairs += wrap_line(f"      {stated} in the file ({source}); {found}", width)
    return pairs


def summary_line(rows: list[Counterpart]) -> str:
    """Counts of the verdicts, with the names of the values that differ."""
    counts = {v: [r.name for r in rows if r.verdict == v] for v in ("agrees", "differs", "no counterpart")}
    differ = counts["differs"]
    names = f": {', '.join(differ)}" if differ else ""
    owners = dict.fromkeys(row.owner for row in rows if row.verdict == "taken over")
    over = sum(row.verdict == "taken over" for row in rows)
    taken = f"; {over} not checked: value and counterpart both come from {', '.join(owners)}" if over else ""
    missing = len(counts["no counterpart"])
    return f"  {len(counts['agrees'])} agree, {len(differ)} differ{names}; {missing} without counterpart{taken}"


DIRECTIONS: tuple[Direction, Direction] = ("warp", "weft")
GRAVITY = 9.81  # [m/s2]
#: tolerance of an input against the test that it was read from: rounding and means of curves [-]
SAME = 0.05
#: field of the fabric: quantity of tables, and its unit
TABLE_QUANTITIES = {
    "warp_density": (("yarn_density",), "yarn/100 mm"),
    "weft_density": (("yarn_density",), "yarn/100 mm"),
    "loop_length": (("loop_length", "loop_length_mm"), "mm"),
    "area_mass": (("area_mass", "area_mass_g_m2"), "g/m2"),
    "thickness": (("thickness", "thickness_mm"), "mm"),
}


def test_counterparts(fabric: Fabric) -> Iterator[Counterpart]:
    """Compare densities, loops, mass, thickness, fracture strains, curves and bending with the fabric's experiment."""
    for field, (names, unit) in TABLE_QUANTITIES.items():
        quantity = getattr(fabric, field)
        # an area mass may stand with the overhangs of either direction
        directions = DIRECTIONS if field == "area_mass" else (field.partition("_")[0],)
        found = {
            row.file: row for d in directions if quantity is not None and (row := _published_row(fabric, d, *names))
        }
        for row in found.values():
            yield make_counterpart(field.replace("_", " "), field, unit, quantity, row.mean, _citation(row), SAME)
    for direction in DIRECTIONS:
        if fabric.macro.tension is not None:
            row = _published_row(fabric, direction, "fracture_strain_pct")
            yield make_counterpart(
                f"{direction} fracture strain", f"macro.fracture_strain.{direction}", "%",
                fabric.macro.fracture_strain.of(direction), row.mean if row else None,
                _citation(row) if row else _no_row_reason(fabric), SAME,
            )  # fmt: skip
            yield _fracture_counterpart(fabric, direction)
            yield _peak_counterpart(fabric, direction)
        if "bending_stiffness" not in fabric.macro.missing_card_parts:
            yield _bending_counterpart(fabric, direction)
        for kind, record in kinds().items():
            yield from _rig_counterparts(fabric, kind, record.measured, direction)


def _fracture_counterpart(fabric: Fabric, direction: Direction) -> Counterpart:
    """Compare the fracture strain with the strain at the largest force of the curve."""
    quantity = fabric.macro.fracture_strain.of(direction)
    name, field = f"{direction} fracture strain", f"macro.fracture_strain.{direction}"
    try:
        (reach,) = curve_coverages(fabric, {direction: tension_curve(fabric, direction)})
    except InputError as error:
        return make_counterpart(name, field, "%", quantity, None, str(error))
    whose = "another fabric's curve" if reach.is_borrowed else "the curve"
    file = fabric.macro.curve_files.get(f"tension.{direction}")
    origin = f"largest force of {whose} {shorten_path(file) if file else 'in the file'}"
    return make_counterpart(name, field, "%", quantity, reach.end, origin, MARGIN, (f"macro.tension.{direction}",))


def _peak_counterpart(fabric: Fabric, direction: Direction) -> Counterpart:
    name, field = f"{direction} curve, largest force", f"macro.tension.{direction}"
    stated, source = largest_force(fabric, direction)
    row = _published_row(fabric, direction, "peak_force_n")
    if row is None or stated is None:
        reason = _no_row_reason(fabric) if row is None else "the curve has no width"
        return Counterpart(name, field, "N/mm", stated or 0.0, source, None, reason)
    try:
        found = scale_to_width(row, 1.0).mean
    except InputError as error:
        return Counterpart(name, field, "N/mm", stated, source, None, str(error))
    return Counterpart(name, field, "N/mm", stated, source, found, _citation(row), SAME * found)


def largest_force(fabric: Fabric, direction: Direction) -> tuple[float | None, str]:
    """Largest force per width [N/mm] of a curve, and the kind of the curve."""
    try:
        curve = tension_curve(fabric, direction)
    except InputError:
        return None, ""
    return float(np.max(curve.mean)), curve.kind


def _bending_counterpart(fabric: Fabric, direction: Direction) -> Counterpart:
    """Compare the bending stiffness per width with that of the overhang, B = w (L / 2)^3 (DIN 53362)."""
    quantity = fabric.macro.bending_stiffness.of(direction)
    row = _published_row(fabric, direction, "overhang_mm")
    weight = fabric.area_mass_g_per_mm2 * to_kernel(GRAVITY, "m/s2")
    found = None if row is None else bending_stiffness(row.mean, weight)
    origin = _no_row_reason(fabric) if row is None else f"overhang {row.mean:g} mm and area_mass; {_citation(row)}"
    return make_counterpart(
        f"{direction} bending stiffness", f"macro.bending_stiffness.{direction}", "N mm", quantity, found, origin, SAME
    )


def _rig_counterparts(
    fabric: Fabric, kind: str, measured: Mapping[str, str], direction: Direction
) -> Iterator[Counterpart]:
    """Compare the rig settings of ``kind`` that the file states with the quantities ``measured``."""
    other = other_direction_fields(fabric, kind, direction)
    for field, at in rig_default_paths(fabric.rigs.get(kind, {}), kind, direction).items():
        if field not in measured:
            continue
        stated, row = rig_default_value(fabric, kind, at), _published_row(fabric, direction, measured[field])
        name, source = f"{direction} {field.replace('_', ' ')}", "assumed" if field in other else "stated"
        path = dotted_path(("rigs", kind, *at))
        origin = _no_row_reason(fabric) if row is None else _citation(row)
        found = None if row is None else row.mean
        yield Counterpart(name, path, "", stated, source, found, origin, SAME * (found or 0.0))


def _published_row(fabric: Fabric, direction: str, *names: str) -> PublishedValue | None:
    if fabric.experiment is None or fabric.experiment_variant is None:
        return None
    rows = published_rows(data_dir() / fabric.experiment, fabric.experiment_variant, direction, names)
    return rows[0] if rows else None


def _citation(row: PublishedValue) -> str:
    scatter = f" ± {row.sd:.4g}" if row.sd == row.sd else ""
    unit = "" if row.unit == "1" else f" {row.unit}"
    return f"{row.table}: {row.mean:.5g}{scatter}{unit}"


def _no_row_reason(fabric: Fabric) -> str:
    return "not in the fabric's experiment" if fabric.experiment else "the fabric names no experiment"
