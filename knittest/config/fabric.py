"""A fabric: densities, loop length, mass and thickness, its two yarns, its contact and its macro material."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, ValidationError, ValidatorFunctionWrapHandler, WrapValidator, model_validator

from knittest.config.base import (
    BoundsError,
    Directed,
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
    ShearLaw,
    YarnContact,
)
from knittest.config.yarn import KnittingYarn, ReinforcingYarn, strength_of
from knittest.config.yarn_card import filled, is_filled, number_of

Direction = Literal["warp", "weft"]
#: measured area mass over that of the yarns: beyond, densities, loop length or tex are another fabric's
AREA_MASS = (0.5, 2.0)
#: loop length over the way round its cell and once round an inlay and a loop yarn, at most
LOOP_LENGTH = 3.0
#: thickness over two inlays, at least, and over two inlays and two loop yarns, at most
THICKNESS = (0.5, 3.0)


def _or_absent(value: object, handler: ValidatorFunctionWrapHandler) -> Any:
    return None if value is None else handler(value)


def _optional(description: str) -> Any:
    return Field(None, description=description)


#: only one of the scales reads it: a run there rejects a fabric without it, so that whoever reads it finds it
Absent = WrapValidator(_or_absent)


class TensionPoints(Strict):
    """A tension curve of the shells that stands in the fabric file itself."""

    points: list[Annotated[tuple[float, float], Field(strict=False)]] = Field(
        description="strain [%] and force per width [N/mm] pairs, first (0, 0)"
    )
    source: Source = Field(description="where the curve comes from: measured, derived, tuned, predicted, assumed, user")
    ref: str = Field("", description="table, figure or reasoning behind the curve")

    @model_validator(mode="after")
    def _rises(self) -> Self:
        if len(self.points) < 2 or self.points[0] != (0.0, 0.0):
            raise BoundsError("expected at least two, the first [0, 0]", "points")
        if any(b[0] <= a[0] for a, b in pairwise(self.points)):
            raise BoundsError("strains must rise strictly", "points")
        return self


class MacroMaterial(Strict):
    """Material card of the shells. What a fabric with yarns leaves out is derived from them when a run needs it."""

    tension: Annotated[dict[Direction, str | TensionPoints], Absent] = _optional(
        "tension curve per direction: a CSV (strain_pct, force_n_per_mm; or force_n and a line "
        "# strip_width_mm: ...) in ./data or the shipped data, or points; none: derived from the yarns"
    )
    fracture_strain: Annotated[PerDirection, Absent] = number(
        None, "%", "element deletion strain; goes with tension", gt=0, band=(0.1, 50)
    )
    fracture_strain_fraction: ClassVar[Kernel[Directed]] = Kernel("fracture_strain")
    bending_stiffness: Annotated[PerDirection, Absent] = number(
        None, "N mm", "bending stiffness per width; none: derived from the yarns", gt=0, band=(1e-3, 1e4)
    )
    bending_stiffness_n_mm: ClassVar[Kernel[Directed]] = Kernel("bending_stiffness")
    in_plane_bending: PerDirection | None = number(
        None, "N mm", "bending stiffness of the inlays in the plane, per width; none: forming derives it as EI of an "
        "inlay x inlays per width (rig.in_plane_bending), other tests leave it out", gt=0, band=(1e-6, 1e4),
    )  # fmt: skip
    in_plane_bending_n_mm: ClassVar[Kernel[Directed | None]] = Kernel("in_plane_bending")
    shear: Annotated[ShearLaw, Absent] = _optional(
        "in-plane shear force over the shear angle; none: derived from the yarns"
    )
    compression_ratio: Quantity = number(
        Quantity(value=0.01, source="assumed", ref="yarns buckle"),
        "1", "compressive over largest tensile tangent", gt=0, le=1,
    )  # fmt: skip
    poisson: Quantity = number(
        Quantity(value=0.0, source="assumed", ref="inlays of both directions slide on each other"),
        "1", "contraction of the weft over the strain of the warp when the warp is pulled alone; below -0.4 a "
        "clamped strip no longer repeats its tension curve (6 % off at -0.9)", ge=-0.4, le=2,
    )  # fmt: skip
    self_friction: Quantity = number(
        Quantity(value=0.3, source="assumed", ref="as yarn on yarn; fabric on fabric is not published"),
        "1", "Coulomb coefficient of the fabric on itself, one face (model.macro.self_contact)", ge=0, le=2,
    )  # fmt: skip

    @model_validator(mode="after")
    def _both(self) -> Self:
        if self.tension is not None and set(self.tension) != {"warp", "weft"}:
            raise ValueError("tension needs a curve for warp and for weft")
        if (self.tension is None) != (self.fracture_strain is None):
            raise ValueError("tension and fracture_strain go together: give both, or none to derive both")
        return self

    @property
    def missing(self) -> tuple[str, ...]:
        """Parts of the card that are not stated."""
        return tuple(name for name in CARD if getattr(self, name) is None)

    @property
    def curve_files(self) -> dict[str, str]:
        """CSV files of the curves by their field, ``tension.warp`` for example."""
        found = {f"tension.{d}": one for d, one in (self.tension or {}).items() if isinstance(one, str)}
        return found if self.shear is None or self.shear.curve is None else found | {"shear": self.shear.curve}


#: parts of the card of the shells that can be derived from yarns
CARD = ("tension", "bending_stiffness", "shear")

#: what a fabric of the macro scale alone may leave out
YARN_LEVEL = ("loop_length", "reinforcing", "knitting", "contact")


class Fabric(Strict):
    """A biaxial weft-knitted fabric; without loops and yarns any reinforcement, for the macro scale."""

    name: str = Field(description="short name, used in file names", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,39}$")
    title: str = Field("", description="one line for reports")
    warp_density: Quantity = measure("yarn/100 mm", "warp yarns (wales) per width", gt=0, band=(5, 200))
    warp_density_per_mm: ClassVar[Kernel[float]] = Kernel("warp_density")
    weft_density: Quantity = measure("yarn/100 mm", "weft yarns (courses) per length", gt=0, band=(5, 200))
    weft_density_per_mm: ClassVar[Kernel[float]] = Kernel("weft_density")
    loop_length: Annotated[Quantity, Absent] = number(None, "mm", "knitting yarn in one loop", gt=0, band=(1, 100))
    loop_length_mm: ClassVar[Kernel[float]] = Kernel("loop_length")
    area_mass: Quantity = measure("g/m2", "mass per area", gt=0, band=(20, 20000))
    area_mass_g_per_mm2: ClassVar[Kernel[float]] = Kernel("area_mass")
    thickness: Quantity = measure("mm", "thickness of the fabric", gt=0, band=(0.1, 30))
    thickness_mm: ClassVar[Kernel[float]] = Kernel("thickness")
    reinforcing: Annotated[ReinforcingYarn, Absent] = _optional("warp and weft inlay yarn")
    knitting: Annotated[KnittingYarn, Absent] = _optional("yarn of the loops")
    contact: Annotated[YarnContact, Absent] = _optional(
        "yarn-yarn contact; what it leaves out is derived from the yarn of the loops"
    )
    macro: MacroMaterial = Field(
        default_factory=MacroMaterial,
        description="material card of the shells, macro scale; what it leaves out is derived from the yarns",
    )
    experiment: str | None = Field(None, description="folder of the measured results, in ./data or the shipped data")
    experiment_variant: str | None = Field(None, description="variant key in the experiment's tables")
    rigs: dict[TestName, dict[str, float | dict[str, float]]] = Field(
        default_factory=dict,
        description="fields of the rig, by test, that runs of this fabric start from, such as its measured friction; "
        "those of one direction under warp or weft; config file, options and --set go over them, sizes that a preset "
        "gives to yarns stay",
    )

    @model_validator(mode="before")
    @classmethod
    def _follows_its_yarns(cls, data: object) -> Any:
        """Mass and thickness follow from yarns of data sheets where they are not stated."""
        if not isinstance(data, Mapping):
            return data
        needed = [name for name in ("area_mass", "thickness") if name not in data or is_filled(data[name])]
        try:
            inlay = ReinforcingYarn.model_validate(data["reinforcing"])
            loop = KnittingYarn.model_validate(data["knitting"])
            numbers: dict[str, Any] = {
                name: Quantity.model_validate(data[name]) for name in ("warp_density", "weft_density", "loop_length")
            }
        except (KeyError, ValidationError):  # the fields themselves say what is wrong
            return data
        if inlay.fibre is None or loop.fibre is None:
            return data
        made = mass_and_thickness(cls.model_construct(reinforcing=inlay, knitting=loop, **numbers))
        return {**data, **{name: entry for name, entry in made.items() if name in needed}}

    @model_validator(mode="before")
    @classmethod
    def _contact_follows_its_yarns(cls, data: object) -> Any:
        """Contact between yarns follows from the yarn of the loops where it is not stated."""
        if not isinstance(data, Mapping) or data.get("reinforcing") is None or data.get("knitting") is None:
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
        return {**data, "contact": {**contact_of(loop, stated), **stated}}

    @model_validator(mode="after")
    def _loop_spans_its_cell(self) -> Self:
        """Each half loop rises a course and crosses half a wale, whatever its shape; no loop is many times as long."""
        if self.loop_length is None:
            return self
        shortest = math.hypot(self.wale_spacing, 2.0 * self.course_spacing)
        if self.loop_length.value < shortest:
            raise BoundsError(
                f"at these densities a loop needs more than {shortest:.3g} mm to span its cell", "loop_length"
            )
        if self.reinforcing is None or self.knitting is None:
            return self
        around = math.pi * (self.reinforcing.beam_diameter.value + self.knitting.beam_diameter.value)
        if self.loop_length.value > LOOP_LENGTH * (shortest + around):
            raise BoundsError(
                f"implausible at these densities and diameters, expected at most "
                f"{LOOP_LENGTH * (shortest + around):.3g} mm: correct it, warp_density or weft_density",
                "loop_length",
            )
        return self

    @model_validator(mode="after")
    def _is_made_of_its_yarns(self) -> Self:
        _check_area_mass(self)
        _check_thickness(self)
        _check_patch(self)
        _check_sections(self)
        return self

    @model_validator(mode="after")
    def _experiment_says_which_rows(self) -> Self:
        if self.experiment is not None and self.experiment_variant is None:
            raise BoundsError("missing: which variant in the experiment's tables is this fabric?", "experiment_variant")
        return self

    @property
    def wale_spacing(self) -> float:
        """Distance of the wales, which is that of the warp yarns [mm]."""
        return 1.0 / self.warp_density_per_mm

    @property
    def course_spacing(self) -> float:
        """Distance of the courses, which is that of the weft yarns [mm]."""
        return 1.0 / self.weft_density_per_mm

    @property
    def density_per_mm(self) -> Directed:
        """Yarns of each direction over the length across them."""
        return Directed(self.warp_density_per_mm, self.weft_density_per_mm)


def _check_area_mass(fabric: Fabric) -> None:
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


def makes_mass(fabric: Fabric, area_mass: float) -> bool:
    """Tell whether the yarns of ``fabric``, if it has any, can make an area mass [g/m2]."""
    yarns = yarn_area_mass(fabric)
    return yarns is None or AREA_MASS[0] * yarns <= area_mass <= AREA_MASS[1] * yarns


def yarn_area_mass(fabric: Fabric) -> float | None:
    """Area mass [g/m2] of the yarns: densities times linear densities with crimp, and one loop a cell; None without."""
    if fabric.loop_length is None or fabric.reinforcing is None or fabric.knitting is None:
        return None
    inlay, loop = fabric.reinforcing.linear_density_g_per_mm, fabric.knitting.linear_density_g_per_mm
    straight = sum(
        fabric.density_per_mm.of(d) * (1.0 + fabric.reinforcing.crimp_fraction.of(d)) for d in ("warp", "weft")
    )
    loops = fabric.loop_length_mm / (fabric.wale_spacing * fabric.course_spacing)
    return 1e6 * (straight * inlay + loops * loop)


def mass_and_thickness(fabric: Fabric) -> dict[str, dict[str, Any]]:
    """Entries of the area mass and the thickness that the yarns of ``fabric`` make."""
    inlay, loop = fabric.reinforcing.beam_diameter.value, fabric.knitting.beam_diameter.value
    return {
        "area_mass": filled(yarn_area_mass(fabric) or 0.0, "g/m2", "densities x linear densities, and a loop a cell"),
        "thickness": filled(2.0 * (inlay + loop), "mm", "two inlays and two loop yarns, as circles"),
    }


def contact_of(loop: KnittingYarn, stated: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Entries of a contact between yarns that ``stated`` ones leave out.

    A force as large as the breaking force of the loop yarn presses a contact in by its radius. So depths are similar
    shares of the radius with thin and thick yarns, and contacts of weak loops do not shorten the time step.
    """
    force, radius = strength_of(loop), 0.5 * loop.beam_diameter.value
    least = LEAST_STICKING / max(number_of(stated.get("tangential_ratio")) or TANGENTIAL, 1e-9)
    stiffness = max(force / radius, LEAST_STIFFNESS, least)
    return {
        "friction_coefficient": filled(FRICTION, "", "usual between yarns", "assumed"),
        "normal_stiffness": filled(
            stiffness, "N/mm",
            f"breaking force {force:.4g} N of the loop yarn / its radius {radius:.4g} mm, at least "
            f"{max(LEAST_STIFFNESS, least):.4g} N/mm",
        ),
        "tangential_ratio": filled(TANGENTIAL, "", "sticking stiffness over normal stiffness", "assumed"),
    }  # fmt: skip


def _check_thickness(fabric: Fabric) -> None:
    """The thickness is one of an inlay each way between loops."""
    if fabric.reinforcing is None or fabric.knitting is None:
        return
    inlays = sum(fabric.reinforcing.section_mm(direction)[1] for direction in ("warp", "weft"))
    low, high = THICKNESS[0] * inlays, THICKNESS[1] * (inlays + 2.0 * fabric.knitting.beam_diameter.value)
    if not low <= fabric.thickness.value <= high:
        raise BoundsError(
            f"implausible beside the yarns' beam_diameter or height of section, expected {low:.3g} to {high:.3g} mm",
            "thickness",
        )


def _check_patch(fabric: Fabric) -> None:
    """Patches of neighbouring crossings do not overlap."""
    if fabric.contact is None or fabric.contact.patch is None or fabric.contact.patch.radius is None:
        return
    most = 0.5 * min(fabric.wale_spacing, fabric.course_spacing)
    if fabric.contact.patch.radius.largest > most:
        raise BoundsError(f"at these densities patches overlap beyond {most:.3g} mm", "contact.patch.radius")


def _check_sections(fabric: Fabric) -> None:
    """Between two inlays side by side the loop still passes: an ellipse leaves it its own diameter."""
    if fabric.reinforcing is None or fabric.knitting is None or (section := fabric.reinforcing.section) is None:
        return
    _check_compaction(fabric, section)
    pitches: dict[Direction, float] = {"warp": fabric.wale_spacing, "weft": fabric.course_spacing}
    for direction, pitch in pitches.items():
        width, height = fabric.reinforcing.ellipse_mm(section, direction)
        widest = pitch - fabric.knitting.beam_diameter.value
        if width > widest:
            ratio = widest**2 / (width * height)
            packing = section.packing.of(direction).value / ratio
            less = f"at most {ratio:.3g}" if ratio >= 1.0 else f"1 and a packing of at least {packing:.3g}"
            raise BoundsError(
                f"a section of {width:.3g} x {height:.3g} mm leaves the loop less than its diameter between yarns "
                f"{pitch:.3g} mm apart, expected {less}",
                f"reinforcing.section.width_to_height.{direction}",
            )


def _check_compaction(fabric: Fabric, section: InlaySection) -> None:
    """Sections flatten by the law from which patches grow."""
    law, patch = section.flattening, None if fabric.contact is None else fabric.contact.patch
    if law is None or patch is None or (grown := patch.compaction) is None:
        return
    if (law.modulus.value, law.exponent) != (grown.reinforcing.value, grown.exponent):
        raise BoundsError(
            f"a modulus of {law.modulus.value:g} MPa with exponent {law.exponent}, but contact.patch.compaction has "
            f"{grown.reinforcing.value:g} MPa with {grown.exponent}: expected one law for both",
            "reinforcing.section.flattening",
        )
