"""Fabric: densities, loop length, mass, thickness, its two yarns, yarn contact and macro material card."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import Discriminator, Field, Tag, ValidationError, WrapValidator, model_validator

from knittest.config.base import (
    CSV_FORM,
    POINTS_FORM,
    BoundsError,
    DirectionalNumber,
    Kernel,
    PerDirection,
    Quantity,
    Source,
    Strict,
    TestName,
    measure,
    number,
)
from knittest.config.laws import (
    FRICTION,
    LEAST_STICKING,
    LEAST_STIFFNESS,
    TANGENTIAL,
    InlaySection,
    Points,
    ShearLaw,
    YarnContact,
    check_points,
)
from knittest.config.structure import DIRECTIONS, Direction, InlayLayer, Inlays, grid_of, inlays_of, repeat_of
from knittest.config.yarn import KnittingYarn, ReinforcingYarn, Yarn, strength_of
from knittest.config.yarn_card import derived_entry, is_filled, number_of

#: measured area mass over that of the yarns; beyond, densities, loop length or tex are of another fabric
AREA_MASS = (0.5, 2.0)
#: largest loop length over the way round its cell and once round half the layers of inlays and a knitting yarn
LOOP_LENGTH = 3.0
#: smallest thickness over the layers of inlays, and largest over these and two knitting yarns
THICKNESS = (0.5, 3.0)


def _optional_quantity(description: str) -> Any:
    return Field(None, description=description)


#: field that may be None although its type excludes it: a run at the scale that reads it rejects a fabric without it
Absent = WrapValidator(lambda value, handler: None if value is None else handler(value))


class TensionPoints(Strict):
    """Tension curve of the macro model as points in the fabric file."""

    points: Points = Field(description="strain [%] and force per width [N/mm] pairs, first (0, 0)")
    source: Source = Field(description="origin of the curve: measured, derived, tuned, predicted, assumed, user")
    ref: str = Field("", description="table, figure or reasoning behind the curve")

    @model_validator(mode="after")
    def _rises(self) -> Self:
        check_points(self.points, "strains")
        return self


def _tension_form(value: object) -> str | None:
    if isinstance(value, str):
        return CSV_FORM
    return POINTS_FORM if isinstance(value, Mapping | TensionPoints) else None


#: curve of one direction: a CSV, or points
TensionCurve = Annotated[
    Annotated[str, Tag(CSV_FORM)] | Annotated[TensionPoints, Tag(POINTS_FORM)],
    Discriminator(
        _tension_form, "tension_form",
        "expected a CSV, or a mapping such as {points: [[0, 0], [1, 50]], source: assumed}",
    ),
]  # fmt: skip


class BiaxialCurves(Strict):
    """Tension of both directions of the macro model over both strains, for fabrics whose directions pull each other."""

    curve: str | None = Field(
        None,
        description="CSV in ./data or the shipped data: strain_warp_pct, strain_weft_pct, force_warp_n_per_mm, "
        "force_weft_n_per_mm in loading, a row for each pair of strains, down to the free contraction of strips",
    )
    points: list[Annotated[tuple[float, float, float, float], Field(strict=False)]] = Field(
        default_factory=list, description="instead of a CSV: its rows, strains [%] and forces per width [N/mm] of warp "
        "and weft",
    )  # fmt: skip
    source: Source = Field(description="origin of the forces: measured, derived, tuned, predicted, assumed, user")
    ref: str = Field("", description="table, figure or reasoning behind the forces")

    @model_validator(mode="after")
    def _has_rows(self) -> Self:
        if (self.curve is None) == (not self.points):
            raise ValueError("biaxial needs either curve (a CSV) or points")
        return self


class MacroMaterial(Strict):
    """Macro material card (shell elements); missing parts are derived from the yarns when a run needs them."""

    tension: Annotated[dict[Direction, TensionCurve], Absent] = _optional_quantity(
        "tension curve per direction: points, or a CSV in ./data or the shipped data (strain_pct, force_n_per_mm; or "
        "force_n and a line # strip_width_mm: ...); none: derived from the yarns"
    )
    biaxial: BiaxialCurves | None = _optional_quantity(
        "in place of tension: forces of both directions over both strains; excludes poisson"
    )
    fracture_strain: Annotated[PerDirection, Absent] = number(
        None, "%", "element deletion strain; required with tension, none with biaxial: nothing fails", gt=0,
        band=(0.1, 50),
    )  # fmt: skip
    fracture_strain_fraction: ClassVar[Kernel[DirectionalNumber]] = Kernel("fracture_strain")
    bending_stiffness: Annotated[PerDirection, Absent] = number(
        None, "N mm", "bending stiffness per width; none: derived from the yarns", gt=0, band=(1e-3, 1e4)
    )
    bending_stiffness_n_mm: ClassVar[Kernel[DirectionalNumber]] = Kernel("bending_stiffness")
    in_plane_bending: PerDirection | None = number(
        None, "N mm", "in-plane bending stiffness of the inlays, per width; none: forming uses EI of an inlay x inlays "
        "per width (rig.in_plane_bending), other tests neglect it", gt=0, band=(1e-6, 1e4),
    )  # fmt: skip
    in_plane_bending_n_mm: ClassVar[Kernel[DirectionalNumber | None]] = Kernel("in_plane_bending")
    shear: Annotated[ShearLaw, Absent] = _optional_quantity(
        "in-plane shear force over the shear angle; none: derived from the yarns"
    )
    compression_ratio: Quantity = number(
        Quantity(value=0.01, source="assumed", ref="yarns buckle"),
        "1", "compressive stiffness over the largest tensile tangent", gt=0, le=1,
    )  # fmt: skip
    poisson: Quantity = number(
        Quantity(value=0.0, source="assumed", ref="inlays of both directions slide on each other"),
        "1", "Poisson's ratio: weft contraction over warp strain under warp tension. Below -0.4 a clamped strip no "
        "longer follows its tension curve (6 % off at -0.9)", ge=-0.4, le=2,
    )  # fmt: skip
    self_friction: Quantity = number(
        Quantity(value=0.3, source="assumed", ref="as yarn on yarn; fabric on fabric is not published"),
        "1", "Coulomb coefficient of the fabric on itself (model.macro.self_contact)", ge=0, le=2,
    )  # fmt: skip

    @model_validator(mode="after")
    def _has_complete_tension(self) -> Self:
        if self.tension is not None and set(self.tension) != {"warp", "weft"}:
            raise ValueError("tension needs a curve for warp and for weft")
        if self.biaxial is not None:
            if self.tension is not None:
                raise ValueError("biaxial takes the place of tension: give one of both")
            if self.poisson.value != 0.0:
                raise BoundsError("must be 0 with biaxial, which holds the coupling of both directions", "poisson")
        elif (self.tension is None) != (self.fracture_strain is None):
            raise ValueError("tension and fracture_strain need each other: give both, or none to derive both")
        return self

    def deletion_strain(self, direction: str) -> float:
        """Strain [%] at which elements are deleted; infinite where they never are."""
        return math.inf if self.fracture_strain is None else self.fracture_strain.of(direction).value

    @property
    def missing_card_parts(self) -> tuple[str, ...]:
        """Parts of the card that are not given."""
        given = {"tension"} if self.biaxial is not None else set()
        return tuple(name for name in CARD if getattr(self, name) is None and name not in given)

    @property
    def curve_files(self) -> dict[str, str]:
        """CSV files of the curves by field, such as ``tension.warp``."""
        found = {f"tension.{d}": one for d, one in (self.tension or {}).items() if isinstance(one, str)}
        laws = {"biaxial": self.biaxial, "shear": self.shear}
        return found | {name: law.curve for name, law in laws.items() if law is not None and law.curve is not None}


#: parts of the macro material card that can be derived from yarns
CARD = ("tension", "bending_stiffness", "shear")

#: fields that a fabric for the macro scale may leave out
YARN_LEVEL = ("loop_length", "layers", "reinforcing", "knitting", "contact")


#: GJ / EI of a solid isotropic yarn, 1 / (1 + nu) with nu = 0.3
SOLID_TORSION = 0.77


class Fabric(Strict):
    """Weft-knitted fabric with layers of inlays or none; any reinforcement without loops and yarns (macro scale)."""

    name: str = Field(description="short name, for file names", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,39}$")
    title: str = Field("", description="one line for reports")
    warp_density: Quantity = measure("yarn/100 mm", "wales per width", gt=0, band=(5, 200))
    warp_density_per_mm: ClassVar[Kernel[float]] = Kernel("warp_density")
    weft_density: Quantity = measure("yarn/100 mm", "courses per length", gt=0, band=(5, 200))
    weft_density_per_mm: ClassVar[Kernel[float]] = Kernel("weft_density")
    loop_length: Annotated[Quantity, Absent] = number(
        None, "mm", "length of the knitting yarn in one loop", gt=0, band=(1, 100)
    )
    loop_length_mm: ClassVar[Kernel[float]] = Kernel("loop_length")
    stitches: list[str] = Field(
        ["k"], description="stitches of a repeat: a row of k (knit) and p (purl) for each course, first course first; "
        "[k] is plain jersey, [kp] rib 1x1",
    )  # fmt: skip
    layers: list[InlayLayer] | None = Field(
        None, description="layers of inlays from back to face; []: no inlays; none: a warp in every wale behind a weft "
        "in every course, both of reinforcing",
    )  # fmt: skip
    area_mass: Quantity = measure("g/m2", "mass per area", gt=0, band=(20, 20000))
    area_mass_g_per_mm2: ClassVar[Kernel[float]] = Kernel("area_mass")
    thickness: Quantity = measure("mm", "thickness of the fabric", gt=0, band=(0.1, 30))
    thickness_mm: ClassVar[Kernel[float]] = Kernel("thickness")
    reinforcing: Annotated[ReinforcingYarn, Absent] = _optional_quantity("yarn of the inlays")
    knitting: Annotated[KnittingYarn, Absent] = _optional_quantity("knitting yarn, which forms the loops")
    contact: Annotated[YarnContact, Absent] = _optional_quantity(
        "yarn-yarn contact; none: derived from the knitting yarn"
    )
    macro: MacroMaterial = Field(
        default_factory=MacroMaterial,
        description="macro material card (shell elements); missing parts are derived from the yarns",
    )
    experiment: str | None = Field(None, description="folder of the measured results, in ./data or the shipped data")
    experiment_variant: str | None = Field(None, description="variant key in the experiment's tables")
    rigs: dict[TestName, dict[str, float | dict[str, float]]] = Field(
        default_factory=dict,
        description="defaults of the rig by test, such as the measured friction; those of one direction under warp or "
        "weft. Config file, options and --set override them; sizes of a meso preset stay",
    )

    @model_validator(mode="before")
    @classmethod
    def _follows_its_yarns(cls, data: object) -> Any:
        """Derive area mass and thickness from yarns with a data sheet, or soft ones, where they are not given."""
        if not isinstance(data, Mapping):
            return data
        needed = [name for name in ("area_mass", "thickness") if name not in data or is_filled(data[name])]
        if needed and "knitting" not in data and "fibre" in (data.get("reinforcing") or ()):
            raise BoundsError(f"missing: yarn of the loops; {' and '.join(needed)} follow from the yarns", "knitting")
        try:
            inlay = data.get("reinforcing")
            layers = data.get("layers")
            made: dict[str, Any] = {
                "reinforcing": None if inlay is None else ReinforcingYarn.model_validate(inlay),
                "knitting": KnittingYarn.model_validate(data["knitting"]),
                "layers": None if layers is None else [InlayLayer.model_validate(layer) for layer in layers],
                "stitches": data.get("stitches", ["k"]),
            }
            made |= {n: Quantity.model_validate(data[n]) for n in ("warp_density", "weft_density", "loop_length")}
        except (KeyError, TypeError, ValidationError):  # the fields themselves say what is wrong
            return data
        fabric = cls.model_construct(**made)
        yarns = [*(layer.yarn for layer in fabric.inlays), fabric.knitting]
        if not fabric.has_soft_yarns and any(yarn.fibre is None for yarn in yarns):
            return data
        if needed and fabric.layers is None and fabric.reinforcing is None:
            raise BoundsError("missing: yarn of the inlays; a fabric without inlays states layers: []", "reinforcing")
        if min(fabric.warp_density.value, fabric.weft_density.value, fabric.loop_length.value) <= 0.0:
            return data
        return {**data, **{name: entry for name, entry in mass_and_thickness(fabric).items() if name in needed}}

    @model_validator(mode="before")
    @classmethod
    def _contact_follows_its_yarns(cls, data: object) -> Any:
        """Derive the yarn contact from the knitting yarn where it is not given."""
        if not isinstance(data, Mapping) or data.get("knitting") is None:
            return data
        contact = data.get("contact")
        contact = {} if contact is None else contact.model_dump() if isinstance(contact, YarnContact) else contact
        if not isinstance(contact, Mapping):
            return data
        try:
            loop = KnittingYarn.model_validate(data["knitting"])
        except ValidationError:  # the field itself says what is wrong
            return data
        stated = {name: entry for name, entry in contact.items() if not is_filled(entry)}
        layers = data.get("layers")
        given = layers if isinstance(layers, list) else []
        along = {one.get("direction") if isinstance(one, Mapping) else getattr(one, "direction", "") for one in given}
        has_inlays = layers is None or {"warp", "weft"} <= along
        return {**data, "contact": {**contact_of(loop, stated, has_inlays), **stated}}

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        repeat_of(grid_of(self.stitches), self.inlays)
        for check in (_check_shell, _check_loop, _check_area_mass, _check_thickness, _check_patch, _check_sections):
            check(self)
        if self.experiment is not None and self.experiment_variant is None:
            raise BoundsError("missing: name of this fabric in the tables of the experiment", "experiment_variant")
        return self

    @property
    def grid(self) -> tuple[tuple[int, ...], ...]:
        """Sides of the stitches by course and wale: 1 face (knit), -1 back (purl)."""
        return grid_of(self.stitches)

    @property
    def inlays(self) -> list[Inlays]:
        """Systems of inlays from back to face; raises :class:`BoundsError` for a layer without a yarn."""
        return inlays_of(self.layers, self.reinforcing)

    def inlays_along(self, direction: str) -> list[Inlays]:
        """Systems of inlays of ``direction``."""
        return [one for one in self.inlays if one.direction == direction]

    @property
    def has_inlays_both_ways(self) -> bool:
        """Tell whether inlays run along warp and weft; loops carry the force of a direction without."""
        return all(self.inlays_along(direction) for direction in DIRECTIONS)

    @property
    def is_plain(self) -> bool:
        """Tell whether all stitches are knit."""
        return all(side > 0 for row in self.grid for side in row)

    @property
    def yarn_cards(self) -> dict[str, Yarn]:
        """Yarns of inlays and loops by their config field."""
        found: dict[str, Yarn] = {one.field: one.yarn for one in self.inlays}
        return found if self.knitting is None else found | {"knitting": self.knitting}

    def inlays_of_system(self, name: str) -> Inlays:
        """System of inlays called ``name``."""
        return next(one for one in self.inlays if one.name == name)

    def inlay_density_per_mm(self, direction: str) -> float:
        """Inlays of ``direction`` per length across them [1/mm], those of all layers."""
        return sum(one.share for one in self.inlays_along(direction)) * self.density_per_mm.of(direction)

    def straight_failure_strain(self, direction: str) -> float:
        """Strain [-] of the fabric at which the first inlays along ``direction`` are straight and fail; inf without."""
        return min(
            ((1.0 + i.crimp) * (1.0 + i.yarn.fracture_strain_fraction) - 1.0 for i in self.inlays_along(direction)),
            default=math.inf,
        )

    def is_carried_by_loops(self, direction: str, scale: str) -> bool:
        """Tell whether loops alone carry tension along ``direction``; at the macro scale by a law of two strains."""
        law = self.has_biaxial_law if scale == "macro" else self.has_yarns
        return law and not self.inlays_along(direction)

    @property
    def has_biaxial_law(self) -> bool:
        """Tell whether the macro model has, or derives, a law of two strains, as there are no inlays in a direction."""
        return self.macro.tension is None and self.has_yarns and not self.has_inlays_both_ways

    def yarn_bending_n_mm(self, direction: str) -> float:
        """Bending stiffness per width [N mm] of the inlays along ``direction``, side by side; without inlays there that
        of the loops.
        """
        inlays = sum(one.share * one.bending for one in self.inlays_along(direction))
        return (inlays or self._loop_bending(direction)) * self.density_per_mm.of(direction)

    def _loop_bending(self, direction: str) -> float:
        """Bending stiffness [N mm2] of a wale or course of loops: half of the yarn bends and half of it twists.

        Each course has the length of a loop, in a wale in two legs side by side, so a moment bends more yarn than the
        fabric is long.
        """
        if self.knitting is None or self.loop_length is None:
            return 0.0
        legs, pitch = (2.0, self.course_spacing) if direction == "warp" else (1.0, self.wale_spacing)
        ratio = self.knitting.torsion_ratio
        soft = 0.5 * (1.0 + 1.0 / (SOLID_TORSION if ratio is None else ratio.value))
        return legs * self.knitting.bending_stiffness_n_mm2 / soft * pitch / (self.loop_length_mm / legs)

    @property
    def has_soft_yarns(self) -> bool:
        """Tell whether the loops are of a yarn with a soft shell."""
        return self.knitting is not None and self.knitting.soft_shell is not None

    @property
    def has_yarns(self) -> bool:
        """Tell whether loops and yarns are described."""
        return not self.missing_yarns

    @property
    def missing_yarns(self) -> list[str]:
        """Fields of loops and yarns that the meso scale needs and that are not given."""
        absent = {"loop_length", "knitting"} | ({"reinforcing"} if self.layers is None else set())
        if self.knitting is not None:  # else it follows from the knitting yarn
            absent.add("contact")
        return [name for name in YARN_LEVEL if name in absent and getattr(self, name) is None]

    @property
    def wale_spacing(self) -> float:
        """Distance between wales [mm]."""
        return 1.0 / self.warp_density_per_mm

    @property
    def course_spacing(self) -> float:
        """Distance between courses [mm]."""
        return 1.0 / self.weft_density_per_mm

    @property
    def density_per_mm(self) -> DirectionalNumber:
        """Wales (warp) and courses (weft) per length [1/mm]."""
        return DirectionalNumber(self.warp_density_per_mm, self.weft_density_per_mm)


def _check_shell(fabric: Fabric) -> None:
    """Check that yarns with a soft shell form the loops of a fabric without inlays, without what their law has not."""
    if not fabric.has_soft_yarns or fabric.knitting is None:
        return
    if fabric.inlays:
        raise BoundsError("is for fabrics without inlays: remove it, or the layers of inlays", "knitting.soft_shell")
    if fabric.knitting.degree_of_set.value > 0.0:
        raise BoundsError(
            "must be 0 with soft_shell: the relaxed fabric follows from loops that are bent elastically",
            "knitting.degree_of_set",
        )
    if fabric.knitting.starts_relaxed:
        raise BoundsError(
            "excludes loop_shortening, tension and loop_scatter: the relaxed fabric follows from loop_length",
            "knitting.soft_shell",
        )
    for name in ("static_friction_coefficient", "compaction", "patch"):
        if fabric.contact is not None and getattr(fabric.contact, name) is not None:
            raise BoundsError("has no effect with knitting.soft_shell: remove it", f"contact.{name}")


def _check_loop(fabric: Fabric) -> None:
    """Check that the loop spans its cell, half a wale and two courses, and is not many times as long."""
    if fabric.loop_length is None:
        return
    shortest = math.hypot(fabric.wale_spacing, 2.0 * fabric.course_spacing)
    if fabric.loop_length.value < shortest:
        raise BoundsError(f"must be more than {shortest:.3g} mm to span its cell at these densities", "loop_length")
    if not fabric.has_yarns or fabric.knitting is None:
        return
    half = 0.5 * sum(one.yarn.beam_diameter.value for one in fabric.inlays)
    around = math.pi * (half + fabric.knitting.beam_diameter.value)
    if fabric.loop_length.value > LOOP_LENGTH * (shortest + around):
        raise BoundsError(
            f"implausible at these densities and diameters, expected at most {LOOP_LENGTH * (shortest + around):.3g} "
            "mm: correct loop_length, warp_density or weft_density",
            "loop_length",
        )


def _check_area_mass(fabric: Fabric) -> None:
    """Check that the area mass is, within a factor, that of the yarns."""
    if (yarns := yarn_area_mass(fabric)) is not None and not makes_mass(fabric, fabric.area_mass.value):
        low, high = (share * yarns for share in AREA_MASS)
        raise BoundsError(
            f"implausible, expected {low:.4g} to {high:.4g} g/m2: the yarns make {yarns:.4g} g/m2. Correct area_mass, "
            "densities, linear densities or loop_length (not needed at the macro scale: loop_length, yarns, contact)",
            "area_mass",
        )


def makes_mass(fabric: Fabric, area_mass: float) -> bool:
    """Tell whether the yarns of ``fabric``, if it has any, can make an area mass [g/m2]."""
    yarns = yarn_area_mass(fabric)
    return yarns is None or AREA_MASS[0] * yarns <= area_mass <= AREA_MASS[1] * yarns


def yarn_area_mass(fabric: Fabric) -> float | None:
    """Area mass [g/m2] of the yarns: densities x linear densities with crimp, and one loop per cell; None without."""
    if fabric.loop_length is None or fabric.knitting is None or (fabric.layers is None and fabric.reinforcing is None):
        return None
    inlays = sum(
        fabric.density_per_mm.of(one.direction) * one.share * (1.0 + one.crimp) * one.yarn.linear_density_g_per_mm
        for one in fabric.inlays
    )
    loops = fabric.loop_length_mm / (fabric.wale_spacing * fabric.course_spacing)
    return 1e6 * (inlays + loops * fabric.knitting.linear_density_g_per_mm)


def mass_and_thickness(fabric: Fabric) -> dict[str, dict[str, Any]]:
    """Entries of area mass and thickness, from the yarns of ``fabric``."""
    inlays = sum(one.yarn.beam_diameter.value for one in fabric.inlays)
    return {
        "area_mass": derived_entry(
            yarn_area_mass(fabric) or 0.0, "g/m2", "densities x linear densities, and one loop per cell"
        ),
        "thickness": derived_entry(
            inlays + 2.0 * fabric.knitting.loose_diameter_mm,
            "mm",
            "layers of inlays and two knitting yarns, as circles",
        ),
    }


def contact_of(loop: KnittingYarn, stated: Mapping[str, Any], has_inlays: bool = True) -> dict[str, dict[str, Any]]:
    """Entries of a yarn contact that ``stated`` ones leave out.

    The breaking force of the knitting yarn presses a contact in by the radius of the yarn. So depths are similar shares
    of the radius for thin and thick yarns, and contacts of weak yarns do not shorten the time step. Where loops carry
    the fabric alone, a thousandth of this force bends them: contacts have the least stiffness, or they would chatter.
    """
    force, radius = strength_of(loop), 0.5 * loop.beam_diameter.value
    least = LEAST_STICKING / max(number_of(stated.get("tangential_ratio")) or TANGENTIAL, 1e-9)
    least = max(LEAST_STIFFNESS, least)
    if not has_inlays:
        return _contact_entries(least, "least stiffness, for loops that carry a direction without inlays")
    formula = (
        f"breaking force {force:.4g} N of the knitting yarn / its radius {radius:.4g} mm, at least {least:.4g} N/mm"
    )
    return _contact_entries(max(force / radius, least), formula)


def _contact_entries(stiffness: float, formula: str) -> dict[str, dict[str, Any]]:
    return {
        "friction_coefficient": derived_entry(FRICTION, "", "usual yarn on yarn", "assumed"),
        "normal_stiffness": derived_entry(stiffness, "N/mm", formula),
        "tangential_ratio": derived_entry(TANGENTIAL, "", "sticking stiffness over normal stiffness", "assumed"),
    }


def _check_thickness(fabric: Fabric) -> None:
    """Check that the thickness is that of the layers of inlays between loops."""
    if not fabric.has_yarns or fabric.knitting is None:
        return
    inlays, loop = sum(one.section_mm[1] for one in fabric.inlays), fabric.knitting.loose_diameter_mm
    low, high = THICKNESS[0] * max(inlays, loop), THICKNESS[1] * (inlays + 2.0 * loop)
    if not low <= fabric.thickness.value <= high:
        raise BoundsError(
            f"implausible, expected {low:.3g} to {high:.3g} mm for the diameters or section heights of the yarns",
            "thickness",
        )


def _check_patch(fabric: Fabric) -> None:
    """Check that contact patches of neighbouring crossings do not overlap."""
    if fabric.contact is None or fabric.contact.patch is None or fabric.contact.patch.radius is None:
        return
    most = 0.5 * min(fabric.wale_spacing, fabric.course_spacing)
    if fabric.contact.patch.radius.largest > most:
        raise BoundsError(
            f"must be at most {most:.3g} mm, or patches overlap at these densities", "contact.patch.radius"
        )


def _check_sections(fabric: Fabric) -> None:
    """Check that elliptic inlays leave the loop its own diameter between them."""
    if not fabric.has_yarns or fabric.knitting is None:
        return
    pitches = {"warp": fabric.wale_spacing, "weft": fabric.course_spacing}
    for one in fabric.inlays:
        if (section := one.yarn.section) is None:
            continue
        _check_compaction(fabric, section, one.field)
        pitch, direction = pitches[one.direction], one.direction
        width, height = one.section_mm
        widest = pitch - fabric.knitting.beam_diameter.value
        if width > widest:
            ratio = widest**2 / (width * height)
            packing = section.packing.of(direction).value / ratio
            less = f"at most {ratio:.3g}" if ratio >= 1.0 else f"1 and a packing of at least {packing:.3g}"
            raise BoundsError(
                f"sections of {width:.3g} x {height:.3g} mm at a spacing of {pitch:.3g} mm leave no room for the loop, "
                f"expected {less}",
                f"{one.field}.section.width_to_height.{direction}",
            )


def _check_compaction(fabric: Fabric, section: InlaySection, field: str) -> None:
    """Check that sections flatten by the same law by which contact patches grow."""
    law, patch = section.flattening, None if fabric.contact is None else fabric.contact.patch
    if law is None or patch is None or (grown := patch.compaction) is None:
        return
    if (law.modulus.value, law.exponent) != (grown.reinforcing.value, grown.exponent):
        raise BoundsError(
            f"modulus {law.modulus.value:g} MPa and exponent {law.exponent} differ from contact.patch.compaction "
            f"({grown.reinforcing.value:g} MPa, {grown.exponent}): expected the same law",
            f"{field}.section.flattening",
        )
