"""Counterparts of the values of a fabric in its yarns and in its relaxed cell."""

from collections.abc import Iterator

import numpy as np

from knittest.base.errors import KnittestError
from knittest.config.base import PerDirection, Quantity
from knittest.config.fabric import Direction, Fabric
from knittest.config.quality_checks import CELL
from knittest.config.run import Variability
from knittest.config.structure import KNIT
from knittest.config.yarn import packing_of, strength_of
from knittest.config.yarn_card import MARK, is_filled
from knittest.fabric.cell import STITCHES, Cell
from knittest.fabric.relaxation import relaxed_cell
from knittest.fabric.topology import bundle_peak, draw
from knittest.materials.yarn_section import sections, systems_of
from knittest.runs.preflight.measured_counterparts import DIRECTIONS, Counterpart, largest_force, make_counterpart
from knittest.solve.relaxed_cell import relaxed_fabric

#: yarns of the bundle whose strength is compared
BUNDLE = 200
#: tolerance of a bundle of yarns, which has no loops: force and strain [-]
STRENGTH, STRAIN = 0.25, 0.15
#: tolerance of the bending of separate yarns [-]
BENDING = 0.3
#: tolerance of the packing, usually 0.3 to 0.9, and of the stiffness per mass against straight fibres [-]
PACKING, STIFFNESS = 0.5, 0.25
#: tolerance of the loop length against a relaxed plain knit, from which knits with inlays differ [-]
DENSITY = 0.35
#: tolerances of the relaxed cell: thickness and mass (at least the scatter), crimp and loop length [-]
THICKNESS, MASS, CRIMP, LOOP = 0.05, 0.10, 0.10, 0.005


def derived_numbers(fabric: Fabric) -> dict[str, Quantity]:
    """Values derived from the fibre of a yarn, by field; those of the contact come from the yarn of the loops."""
    found: dict[str, Quantity] = {}
    for system, yarn in fabric.yarn_cards.items():
        for name in () if yarn.fibre is None else type(yarn).model_fields:
            entry = getattr(yarn, name)
            parts = {f".{d}": entry.of(d) for d in DIRECTIONS} if isinstance(entry, PerDirection) else {"": entry}
            found |= {f"{system}.{name}{part}": number for part, number in parts.items() if is_filled(number)}
    if fabric.contact is not None:
        parts = {name: getattr(fabric.contact, name) for name in type(fabric.contact).model_fields}
        found |= {f"contact.{name}": number for name, number in parts.items() if is_filled(number)}
    return found


def derived_lines(fabric: Fabric) -> list[str]:
    """A line for the formula of each derived value, and one line for the assumed values; both directions in one."""
    found = {field.removesuffix(".weft"): q for field, q in derived_numbers(fabric).items() if field[-5:] != ".warp"}
    lines = [f"  {field}: {q.ref.removeprefix(MARK)}" for field, q in found.items() if q.source == "derived"]
    assumed = ", ".join(f"{field} {q.value:g}" for field, q in found.items() if q.source == "assumed")
    lines += [f"  assumed: {assumed}"] if assumed else []
    return ["derived from the yarns:", *lines] if lines else []


def yarn_counterparts(fabric: Fabric) -> Iterator[Counterpart]:
    """Compare strength, fracture strain and bending with the yarns, shape and mass with the relaxed cell."""
    if not fabric.has_yarns:
        none = "the yarns are not described"
        yield make_counterpart("thickness", "thickness", "mm", fabric.thickness, None, none)
        yield make_counterpart("area mass", "area_mass", "g/m2", fabric.area_mass, None, none)
        return
    yield from _fibre_counterparts(fabric)
    # l = sqrt(k / stitches per area)
    plain = float(np.sqrt(STITCHES * fabric.wale_spacing * fabric.course_spacing))
    yield make_counterpart(
        "loop length", "loop_length", "mm", fabric.loop_length, plain,
        f"plain knit of these densities: stitches per area x loop length squared = {STITCHES:g} (Munden, 1959)",
        DENSITY, ("warp_density", "weft_density"),
    )  # fmt: skip
    for direction in DIRECTIONS:
        if fabric.macro.tension is not None and len(fabric.inlays_along(direction)) == 1:
            yield from _bundle_counterparts(fabric, direction)
        yield from _bending_counterparts(fabric, direction)
    try:
        relaxed = relaxed_fabric(fabric)
        yield from _spacing_counterparts(fabric, relaxed)
        yield from cell_counterparts(fabric, relaxed_cell(relaxed))
    except KnittestError as error:
        yield make_counterpart("thickness", "thickness", "mm", fabric.thickness, None, f"no relaxed cell: {error}")


def _spacing_counterparts(fabric: Fabric, relaxed: Fabric) -> Iterator[Counterpart]:
    """Compare the spacings of soft yarns with those of the ``relaxed`` fabric, which follow from the yarn."""
    for name in ("warp_density", "weft_density") if fabric.has_soft_yarns else ():
        yield make_counterpart(
            name.replace("_", " "), name, "/100 mm", getattr(fabric, name), getattr(relaxed, name).value,
            "relaxed fabric", MASS,
        )  # fmt: skip


def _fibre_counterparts(fabric: Fabric) -> Iterator[Counterpart]:
    """Compare the packing of stated diameters, and stiffness and strength per mass where the fibre is named."""
    for system, yarn in fabric.yarn_cards.items():
        rows = [("packing", "beam_diameter", "", packing_of(yarn), 0.6, PACKING, "fibres in the circle, 0.3 to 0.9")]
        if (blend := yarn.blend) is not None:
            tex, usual = yarn.linear_density.value, blend.failure(None)[1] * blend.modulus / 100.0
            stiffness = 1e3 * yarn.youngs_modulus.value * yarn.load_area.value / tex
            fibres = blend.modulus / blend.density
            rows += [
                ("stiffness", "youngs_modulus", "N/tex", stiffness, fibres, STIFFNESS, f"{blend.name} side by side"),
                ("strength", "fracture_strain", "N/tex", strength_of(yarn) / tex, usual / blend.density, STRENGTH,
                 f"{blend.name}, usual yarn"),
            ]  # fmt: skip
        for name, field, unit, stated, found, share, origin in rows:
            quantity = getattr(yarn, field)
            if not is_filled(quantity):
                yield Counterpart(
                    f"{system} {name}", f"{system}.{field}", unit, stated, quantity.source, found, origin,
                    share * found, (f"{system}.linear_density", f"{system}.load_area"),
                )  # fmt: skip


def _bundle_counterparts(fabric: Fabric, direction: Direction) -> Iterator[Counterpart]:
    """Compare curve and fracture strain of the strip with a bundle of yarns of scattered strength (Daniels, 1945)."""
    inlays = fabric.inlays_along(direction)[0]
    yarn, card = inlays.yarn, dict(zip(systems_of(fabric), sections(fabric), strict=True))[inlays.name]
    fracture = yarn.fracture_strain_fraction
    force = float((card.hinge_slope * np.maximum(fracture - card.hinge_strain, 0.0)).sum())
    peak, strain = bundle_peak(draw(fabric, Variability(), inlays.name, BUNDLE, 0), force / fracture)
    stated, kind = largest_force(fabric, direction)
    if stated is not None:
        found = fabric.inlay_density_per_mm(direction) * peak / BUNDLE
        yield Counterpart(
            f"{direction} curve, largest force", f"macro.tension.{direction}", "N/mm", stated, kind, found,
            "bundle of the yarns: density, modulus, area, fracture strain and its sd", STRENGTH * found,
            (f"{direction}_density",
             *(f"{inlays.field}.{n}" for n in ("youngs_modulus", "load_area", "fracture_strain"))),
        )  # fmt: skip
    quantity = fabric.macro.fracture_strain.of(direction)
    straight = 100.0 * ((1.0 + yarn.crimp_fraction.of(direction)) * (1.0 + strain) - 1.0)
    yield make_counterpart(
        f"{direction} fracture strain", f"macro.fracture_strain.{direction}", "%", quantity, straight,
        "bundle of the yarns, with crimp and slack", STRAIN,
        (f"{inlays.field}.fracture_strain", *(f"{inlays.field}.{name}.{direction}" for name in ("crimp", "slack"))),
    )  # fmt: skip


def _bending_counterparts(fabric: Fabric, direction: Direction) -> Iterator[Counterpart]:
    """Compare the bending out of the plane, and in the plane where the fabric states it."""
    yarns = fabric.yarn_bending_n_mm(direction)
    fields = [f"{one.field}.bending_stiffness.{direction}" for one in fabric.inlays_along(direction)]
    stated = {
        "bending stiffness": ("bending_stiffness", fabric.macro.bending_stiffness),
        "bending stiffness in the plane": ("in_plane_bending", fabric.macro.in_plane_bending),
    }
    for name, (field, quantity) in stated.items():
        if quantity is None:
            continue
        yield make_counterpart(
            f"{direction} {name}", f"macro.{field}.{direction}", "N mm", quantity.of(direction), yarns,
            "yarns side by side: density x reinforcing.bending_stiffness", BENDING,
            (f"{direction}_density", *(fields or ["knitting.bending_stiffness"])),
        )  # fmt: skip


def cell_counterparts(fabric: Fabric, cell: Cell) -> Iterator[Counterpart]:
    """Compare thickness, loop length, crimp and mass with the relaxed ``cell``."""
    where = "relaxed cell"
    shape = CELL["thickness_mm"]
    scatter, found = fabric.thickness.sd or 0.0, cell.thickness + fabric.knitting.loose_fibres_mm
    yield make_counterpart("thickness", "thickness", "mm", fabric.thickness, found, where, THICKNESS, shape, scatter)
    yield make_counterpart(
        "loop length", "loop_length", "mm", fabric.loop_length, cell.loop_length, where, LOOP, ("loop_length",)
    )
    for one in fabric.inlays:
        quantity = one.yarn.crimp.of(one.direction)
        found = 100.0 * cell.crimp(one.name)
        yield Counterpart(
            f"{one.name} crimp", f"{one.field}.crimp.{one.direction}", "%", quantity.value, quantity.source, found,
            where, max(CRIMP * found, 0.02), shape,
        )  # fmt: skip
    mass, area = cell_mass(fabric, cell), float(np.prod(cell.spec.size))
    yield make_counterpart(
        "area mass", "area_mass", "g/m2", fabric.area_mass, 1e6 * mass / area, "yarns of the relaxed cell", MASS,
        CELL["area_mass_g_m2"], fabric.area_mass.sd or 0.0,
    )  # fmt: skip


def cell_mass(fabric: Fabric, cell: Cell) -> float:
    """Mass [g] of one cell: lengths of its yarns times their linear densities."""
    tex = {one.name: one.yarn.linear_density_g_per_mm for one in fabric.inlays}
    tex |= {KNIT: fabric.knitting.linear_density_g_per_mm}
    return sum(cell.length(system) * density for system, density in tex.items())
