"""Conditions on several numbers of a fabric or a run; each function raises :class:`BoundsError` naming the field.

Bounds of single numbers stand beside the fields. Here two numbers exclude each other, each of them fine alone.
"""

from itertools import pairwise
from typing import TYPE_CHECKING

from knittest.config.base import BoundsError, Quantity, check_bounds

if TYPE_CHECKING:
    from knittest.config.fabric import Fabric, KnittingYarn, ReinforcingYarn, Yarn, YarnLaw
    from knittest.config.run import Run

#: strain [%] and stress [MPa] that a point of a yarn's law may have
LAW_STRAIN, LAW_STRESS = {"unit": "%", "ge": 0, "le": 50}, {"unit": "MPa", "ge": 0, "le": 1e5}
#: steepest tangent of a yarn's law over its modulus: beyond, stresses are in another unit
LAW_STEEPNESS = (0.1, 10.0)
#: measured area mass over that of the yarns: beyond, densities, loop length or tex are another fabric's
AREA_MASS = (0.5, 2.0)
#: thickness over two inlays, at least, and over two inlays and two loop yarns, at most
THICKNESS = (0.5, 3.0)


def check_law(law: "YarnLaw") -> None:
    """A law has the numbers of its kind, rises from the start, and its points are strains and stresses."""
    if law.kind == "toe" and law.toe_strain <= 0:
        raise BoundsError("kind toe needs toe_strain > 0 %", "toe_strain")
    if law.kind == "table":
        _check_points(law.points)


def _check_points(points: list[tuple[float, float]]) -> None:
    if len(points) < 2 or points[0] != (0.0, 0.0):
        raise BoundsError("kind table needs at least two points, the first [0, 0]", "points")
    for strain, stress in points:
        check_bounds(strain, LAW_STRAIN, "points")
        check_bounds(stress, LAW_STRESS, "points")
    if any(b[0] <= a[0] for a, b in pairwise(points)):
        raise BoundsError("table strains must rise strictly", "points")
    if any(b[1] < a[1] for a, b in pairwise(points)):
        raise BoundsError("table stresses must not fall (failure is set by fracture_strain)", "points")
    if points[1][1] <= 0.0:
        raise BoundsError(
            "the table has no slope at its start: a yarn would carry nothing; give slack by reinforcing.slack", "points"
        )


def check_yarn(yarn: "Yarn") -> None:
    """The law of ``yarn`` reaches its fracture strain, and its table is one of its modulus."""
    law, fracture = yarn.law, yarn.fracture_strain.value
    if law.kind == "toe" and law.toe_strain >= fracture:
        raise BoundsError(f"must be less than fracture_strain, {fracture:g} %", "law.toe_strain")
    if law.kind != "table":
        return
    if law.points[-1][0] < fracture:
        raise BoundsError(
            f"the table ends at {law.points[-1][0]:g} %, before fracture_strain = {fracture:g} %", "law.points"
        )
    steepest = max((b[1] - a[1]) / (b[0] - a[0]) for a, b in pairwise(law.points)) / 10.0  # MPa per % to GPa
    low, high = (share * yarn.youngs_modulus.value for share in LAW_STEEPNESS)
    if not low <= steepest <= high:
        raise BoundsError(
            f"the steepest part of the table has {steepest:.3g} GPa, implausible beside youngs_modulus = "
            f"{yarn.youngs_modulus.value:g} GPa (stresses are in MPa, strains in %)",
            "law.points",
        )


def check_bending(yarn: "ReinforcingYarn | KnittingYarn", stiffness: Quantity, field: str) -> None:
    """No section of modulus E, area A and diameter d is stiffer than the thin tube, E A d^2 / 8."""
    tube = 1e3 * yarn.youngs_modulus.value * yarn.load_area.value * yarn.beam_diameter.value**2 / 8.0
    if stiffness.value > tube:
        raise BoundsError(
            f"must be at most {tube:.4g} N mm2, that of a thin tube of youngs_modulus, load_area and beam_diameter",
            field,
        )


def check_area_mass(fabric: "Fabric") -> None:
    """The measured mass is, within a factor, that of the yarns."""
    if (yarns := yarn_area_mass(fabric)) is None:
        return
    low, high = (share * yarns for share in AREA_MASS)
    if not makes_mass(fabric, fabric.area_mass.value):
        raise BoundsError(
            f"implausible: densities, linear densities and loops make {yarns:.4g} g/m2, expected {low:.4g} to "
            f"{high:.4g} g/m2; correct it or them (shells alone need no loop_length, reinforcing, knitting, contact)",
            "area_mass",
        )


def makes_mass(fabric: "Fabric", area_mass: float) -> bool:
    """Tell whether the yarns of ``fabric``, if it has any, can make an area mass [g/m2]."""
    yarns = yarn_area_mass(fabric)
    return yarns is None or AREA_MASS[0] * yarns <= area_mass <= AREA_MASS[1] * yarns


def yarn_area_mass(fabric: "Fabric") -> float | None:
    """Area mass [g/m2] of the yarns: densities times linear densities with crimp, and one loop a cell; None without."""
    if fabric.loop_length is None or fabric.reinforcing is None or fabric.knitting is None:
        return None
    inlay, loop = fabric.reinforcing.kernel("linear_density"), fabric.knitting.kernel("linear_density")
    straight = sum(
        fabric.kernel(f"{d}_density") * (1.0 + fabric.reinforcing.kernel("crimp", d)) for d in ("warp", "weft")
    )
    loops = fabric.kernel("loop_length") / (fabric.wale_spacing * fabric.course_spacing)
    return 1e6 * (straight * inlay + loops * loop)


def check_thickness(fabric: "Fabric") -> None:
    """The thickness is one of an inlay each way between loops."""
    if fabric.reinforcing is None or fabric.knitting is None:
        return
    inlays = 2.0 * fabric.reinforcing.beam_diameter.value
    low, high = THICKNESS[0] * inlays, THICKNESS[1] * (inlays + 2.0 * fabric.knitting.beam_diameter.value)
    if not low <= fabric.thickness.value <= high:
        raise BoundsError(
            f"implausible beside the beam_diameter of the yarns, expected {low:.3g} to {high:.3g} mm", "thickness"
        )


def check_friction_order(static: float, kinetic: float) -> None:
    """Raise :class:`BoundsError` where static friction is below kinetic friction."""
    if static < kinetic:
        raise BoundsError(
            f"{static:g} is less than kinetic_coefficient, {kinetic:g}: set both, here --set "
            f"rig.static_coefficient={kinetic:g} or more",
            "static_coefficient",
        )


def check_run(run: "Run") -> None:
    """The specimen is larger than its elements, the fabric thicker than its unevenness, and a strip can fail."""
    rig, shells = run.rig, run.model.scale == "macro"
    if shells:
        _check_element(run)
    uneven = getattr(rig, "imperfection", 0.0)
    if uneven >= 0.5 * run.fabric.thickness.value:
        half = 0.5 * run.fabric.thickness.value
        raise BoundsError(f"must be less than half the fabric's thickness, {half:g} mm", "rig.imperfection")
    if rig.kind != "tensile":
        return
    if shells and rig.jaw_length > rig.gauge_length:
        raise BoundsError(f"must be at most rig.gauge_length, {rig.gauge_length:g} mm", "rig.jaw_length")
    _check_extension(run, rig.max_strain, rig.direction)


def _check_element(run: "Run") -> None:
    """A shell is no larger than its specimen."""
    lengths = {
        name: size
        for name in ("width", "gauge_length", "side", "length", "blank_length", "blank_width")
        if (size := getattr(run.rig, name, None)) is not None
    }
    name = min(lengths, key=lengths.__getitem__)
    if run.model.macro.element_size > lengths[name]:
        raise BoundsError(f"must be at most rig.{name}, {lengths[name]:g} mm", "model.macro.element_size")


def _check_extension(run: "Run", largest: float, direction: str) -> None:
    """A strip can reach the strain [%] at which its shells or its yarns fail."""
    if run.model.scale == "macro":
        quantity: Quantity = getattr(run.fabric.macro.fracture_strain, direction)
        name = f"fabric.macro.fracture_strain.{direction}"
    else:
        quantity, name = run.fabric.reinforcing.fracture_strain, "fabric.reinforcing.fracture_strain"
    if largest <= quantity.value:
        raise BoundsError(f"must exceed {name}, {quantity.value:g} %, or nothing fails", "rig.max_strain")
