"""Yarns of a fabric: each number has its own bounds; numbers that contradict each other raise :class:`BoundsError`."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from knittest.config.base import BoundsError, DirectionalNumber, Kernel, PerDirection, Quantity, Strict, measure, number
from knittest.config.laws import InlaySection, SoftShell, YarnLaw
from knittest.config.yarn_card import SETTINGS, Blend, blend_of, fill_yarn_card

#: steepest tangent of a table over the modulus; beyond, stresses are in another unit
LAW_STEEPNESS = (0.1, 10.0)
#: smallest crimp [%]; below, it is a fraction instead of per cent (0.006 mm high at a pitch of 3.6 mm)
LEAST_CRIMP = 0.02
#: largest strength per mass [N/tex]; the strongest fibres have 4
TENACITY = 6.0
#: linear density over load area [g/cm3], from a loose yarn with its air to steel (7.9) and copper (8.9)
LOOSEST, DENSEST = 0.3, 9.0
#: largest stiffness per mass [N/tex]; the stiffest carbon fibres have 420
STIFFEST = 450.0
#: fibre area over the area of the circle of beam_diameter: loose yarns to hexagonal packing of filaments
PACKINGS = (0.15, 0.907)
#: densities of textile fibres [g/cm3], polypropylene to basalt
TEXTILE = (0.9, 2.8)
#: stiffness and strength of a yarn over those of its filaments
STIFFNESS, STRENGTH = (0.1, 1.25), (0.02, 1.25)
#: largest load area over the fibre area; both are rounded in a card
LOADED = 1.02


class Yarn(Strict):
    """Fields that inlays and knitting yarn share."""

    #: default of numbers that no data sheet states, by field: value and reason
    usual: ClassVar[Mapping[str, tuple[float, str]]] = {}

    description: str = Field("", description="make of the yarn")
    fibre: str | dict[str, float] | None = Field(
        None, description="fibre of the shipped table, or fibres with their mass fractions ({E-glass: 0.6, "
        "polypropylene: 0.4}); numbers of the yarn that are not given are then derived from fibre and linear_density",
    )  # fmt: skip
    linear_density: Quantity = measure(
        "tex", "mass per length; of a plied yarn also as 4 x 300 tex", gt=0, band=(1, 20000)
    )
    linear_density_g_per_mm: ClassVar[Kernel[float]] = Kernel("linear_density")
    twist: Quantity | None = number(
        None, "1/m", "with fibre: twist; lowers the modulus by cos^2 of the helix angle at the surface", ge=0, le=5000
    )
    packing: Quantity | None = number(
        None, "1", "with fibre: fibre area over the area of the circle, for beam_diameter; none: 0.6",
        ge=PACKINGS[0], le=PACKINGS[1],
    )  # fmt: skip
    efficiency: Quantity | None = number(
        None,
        "1",
        "with fibre: failure strain of the yarn over that of its filaments; none: shipped table",
        ge=0.05,
        le=1.2,
    )
    bending_share: Quantity | None = number(
        None,
        "1",
        "with fibre: EI of the yarn between free filaments (0) and bonded filaments (1); none: 0.002",
        ge=0,
        le=1,
    )
    beam_diameter: Quantity = measure("mm", "diameter of the circular beam, for contact", gt=0, band=(0.05, 10))
    beam_diameter_mm: ClassVar[Kernel[float]] = Kernel("beam_diameter")
    youngs_modulus: Quantity = measure("GPa", "axial modulus, referred to load_area", gt=0, band=(0.1, 1000))
    youngs_modulus_mpa: ClassVar[Kernel[float]] = Kernel("youngs_modulus")
    load_area: Quantity = measure("mm2", "area to which youngs_modulus refers", gt=0, band=(1e-3, 50))
    load_area_mm2: ClassVar[Kernel[float]] = Kernel("load_area")
    fracture_strain: Quantity = measure(
        "%", "axial failure strain; sd: scatter from yarn to yarn", gt=0, band=(0.1, 50)
    )
    fracture_strain_fraction: ClassVar[Kernel[float]] = Kernel("fracture_strain")
    torsion_ratio: Quantity | None = number(
        None, "1", "GJ / EI; none: 0.77 of a solid isotropic yarn (1 / (1 + nu), nu = 0.3); free filaments have 2 G / "
        "E, about 0.8 for glass and 0.15 for carbon", ge=0.02, le=2,
    )  # fmt: skip
    law: YarnLaw = Field(default_factory=YarnLaw, description="axial stress-strain law")

    @model_validator(mode="before")
    @classmethod
    def _from_data_sheet(cls, card: object) -> Any:
        return fill_yarn_card(card, cls, cls.usual)

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        for name in SETTINGS:
            if self.fibre is None and getattr(self, name) is not None:
                raise BoundsError("is used only together with fibre: give fibre, or remove it", name)
        _check_law(self)
        _check_per_mass(self)
        _check_packing(self)
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Require all numbers, or a fibre and its linear density, which may be text."""
        found = handler(core)
        model = handler.resolve_ref_schema(found)
        model["anyOf"] = [{"required": model.pop("required")}, {"required": ["fibre", "linear_density"]}]
        density = model["properties"]["linear_density"]
        density["anyOf"] = [{"$ref": density.pop("$ref")}, {"type": "string"}]
        return found

    @property
    def blend(self) -> Blend | None:
        """Fibres that the card names; none without."""
        return None if self.fibre is None else blend_of(self.fibre)


class ReinforcingYarn(Yarn):
    """Straight (slightly wavy) warp and weft inlays."""

    usual: ClassVar[Mapping[str, tuple[float, str]]] = {
        "crimp": (0.6, "near the crimp of two relaxed fabrics; knittest check states that of the relaxed cell"),
        "crimp_scatter": (0.0, "not given"),
        "slack": (0.0, "not given"),
    }
    bending_stiffness: PerDirection = measure("N mm2", "EI of one yarn", gt=0, band=(1e-4, 1e4))
    bending_stiffness_n_mm2: ClassVar[Kernel[DirectionalNumber]] = Kernel("bending_stiffness")
    crimp: PerDirection = measure(
        "%", "yarn length over fabric length minus 1, of a harmonic wave", ge=0, le=5, least=LEAST_CRIMP
    )
    crimp_fraction: ClassVar[Kernel[DirectionalNumber]] = Kernel("crimp")
    crimp_scatter: PerDirection = measure("1", "relative sd of the wave amplitude, from yarn to yarn", ge=0, le=0.5)
    slack: PerDirection = measure(
        "%", "slack of a yarn before it carries load: scale of a half-normal distribution", ge=0, le=2
    )
    slack_fraction: ClassVar[Kernel[DirectionalNumber]] = Kernel("slack")
    section: InlaySection | None = Field(
        None, description="elliptic sections for contact at the meso scale; none: circles of beam_diameter"
    )

    def ellipse_mm(self, section: InlaySection, direction: str) -> tuple[float, float]:
        """Width and height [mm] of the elliptic ``section`` of yarns of ``direction``."""
        ratio = section.width_to_height.of(direction).value
        area = fibre_area(self, section) / section.packing.of(direction).value
        height = math.sqrt(4.0 * area / (math.pi * ratio))
        return ratio * height, height

    def section_mm(self, direction: str) -> tuple[float, float]:
        """Width and height [mm] of the contact section of yarns of ``direction``."""
        if self.section is None:
            return self.beam_diameter_mm, self.beam_diameter_mm
        return self.ellipse_mm(self.section, direction)

    @model_validator(mode="after")
    def _has_possible_sections(self) -> Self:
        if self.section is not None:
            _check_fibres(self, self.section)
        for direction in ("warp", "weft"):
            _check_bending(self, self.bending_stiffness.of(direction), f"bending_stiffness.{direction}")
        return self


class KnittingYarn(Yarn):
    """Knitting yarn, which forms the loops."""

    usual: ClassVar[Mapping[str, tuple[float, str]]] = {"degree_of_set": (0.9, "fabrics without set would curl")}
    bending_stiffness: Quantity = measure("N mm2", "EI of the yarn", gt=0, band=(1e-4, 100))
    bending_stiffness_n_mm2: ClassVar[Kernel[float]] = Kernel("bending_stiffness")
    degree_of_set: Quantity = measure(
        "1", "permanent share of the loop's curvature; the rest is elastic and presses the crossings", ge=0, le=1
    )
    loop_shortening: Quantity | None = number(
        None, "%", "loop shortening: stress-free loop length below the length in the relaxed geometry. Each meso test "
        "then starts from the initial equilibrium under its contact law. None: loops start without tension, and "
        "initial overlaps carry no force", ge=0, le=10,
    )  # fmt: skip
    loop_shortening_fraction: ClassVar[Kernel[float | None]] = Kernel("loop_shortening")
    tension: Quantity | None = number(
        None,
        "N",
        "instead of loop_shortening: mean tension of the knitting yarn in the initial equilibrium",
        gt=0,
        band=(1e-3, 20),
    )
    tension_n: ClassVar[Kernel[float | None]] = Kernel("tension")
    soft_shell: SoftShell | None = Field(
        None, description="contact of a soft yarn: a shell of loose fibres around the core, which has beam_diameter; "
        "for fabrics without inlays. None: yarns touch by contact.normal_stiffness",
    )  # fmt: skip
    loop_scatter: Literal["none", "courses"] = Field(
        "none", description="courses: random loop length of each course of a specimen, with the sd of "
        "fabric.loop_length; cells have the mean. Starts from the initial equilibrium, as with loop_shortening",
    )  # fmt: skip

    @property
    def loose_diameter_mm(self) -> float:
        """Diameter [mm] of the yarn with its loose fibres: that of its shell, if it has one."""
        return self.beam_diameter_mm if self.soft_shell is None else self.soft_shell.outer_diameter_mm

    @property
    def loose_fibres_mm(self) -> float:
        """Diameter [mm] of the shell less that of the core; 0 without a shell."""
        return self.loose_diameter_mm - self.beam_diameter_mm

    @property
    def starts_relaxed(self) -> bool:
        """Tell whether meso tests start from the initial equilibrium under the contact law of the run."""
        return self.loop_shortening is not None or self.tension is not None or self.loop_scatter != "none"

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.loop_shortening is not None and self.tension is not None:
            raise BoundsError("excludes loop_shortening: keep the one that was measured", "tension")
        _check_bending(self, self.bending_stiffness, "bending_stiffness")
        if self.soft_shell is not None and self.soft_shell.outer_diameter.value <= 1.02 * self.beam_diameter.value:
            raise BoundsError(
                f"must be more than the diameter of the core, beam_diameter = {self.beam_diameter.value:g} mm, by 2 %",
                "soft_shell.outer_diameter",
            )
        return self


def _check_law(yarn: Yarn) -> None:
    """Check that the law of ``yarn`` reaches its fracture strain, and that a table fits its modulus."""
    law, fracture = yarn.law, yarn.fracture_strain.value
    if law.kind == "toe" and law.toe_strain >= fracture:
        raise BoundsError(f"must be less than fracture_strain, {fracture:g} %", "law.toe_strain")
    if law.kind != "table":
        return
    if law.points[-1][0] < fracture:
        raise BoundsError(f"end at {law.points[-1][0]:g} %, before fracture_strain = {fracture:g} %", "law.points")
    steepest = max((b[1] - a[1]) / (b[0] - a[0]) for a, b in pairwise(law.points)) / 10.0  # MPa per % to GPa
    low, high = (share * yarn.youngs_modulus.value for share in LAW_STEEPNESS)
    if not low <= steepest <= high:
        raise BoundsError(
            f"the steepest slope is {steepest:.3g} GPa, expected {low:.3g} to {high:.3g} GPa by youngs_modulus "
            "(stresses are in MPa, strains in %)",
            "law.points",
        )


def _check_per_mass(yarn: Yarn) -> None:
    """Check density, stiffness and strength per mass of ``yarn`` against those of fibres."""
    tex, area, strength, blend = yarn.linear_density.value, yarn.load_area.value, strength_of(yarn), yarn.blend
    stiffness = 1e3 * yarn.youngs_modulus.value * area
    if tex < 1e3 * LOOSEST * area or tex > 1e3 * DENSEST * area:
        raise BoundsError(
            f"{tex:g} tex on {area:g} mm2 are {1e-3 * tex / area:.3g} g/cm3, expected {LOOSEST:g} to {DENSEST:g} g/cm3 "
            f"({1e-3 * tex / DENSEST:.3g} to {1e-3 * tex / LOOSEST:.3g} mm2): correct load_area or linear_density",
            "load_area",
        )
    if stiffness > STIFFEST * tex:
        raise BoundsError(
            f"the stiffness per mass is {stiffness / tex:.3g} N/tex, expected at most {STIFFEST:g} N/tex as of the "
            "stiffest fibres: correct youngs_modulus, load_area or linear_density",
            "youngs_modulus",
        )
    if strength > TENACITY * tex:
        raise BoundsError(
            f"the strength per mass is {strength / tex:.3g} N/tex ({strength:.4g} N), expected at most {TENACITY:g} "
            "N/tex as of the strongest fibres: correct fracture_strain, youngs_modulus, load_area or linear_density",
            "fracture_strain",
        )
    if blend is None:
        return
    if area > LOADED * 1e-3 * tex / blend.density:
        raise BoundsError(
            f"exceeds the fibre area of {tex:g} tex {blend.name}, {1e-3 * tex / blend.density:.3g} mm2: correct "
            "load_area, linear_density or fibre",
            "load_area",
        )
    for field, name, found, most, (least, largest) in (
        ("youngs_modulus", "stiffness", stiffness / tex, blend.modulus / blend.density, STIFFNESS),
        ("fracture_strain", "strength", strength / tex, blend.strength / blend.density, STRENGTH),
    ):
        if not least * most <= found <= largest * most:
            raise BoundsError(
                f"the {name} per mass is {found:.3g} N/tex, expected {least * most:.3g} to {largest * most:.3g} N/tex "
                f"for {blend.name} (fibre {most:.3g} N/tex): correct {field}, load_area, linear_density or fibre",
                field,
            )


def packing_of(yarn: Yarn) -> float:
    """Fibre area over the area of the circle of ``yarn``; unnamed fibres have the density of the load area."""
    tex, circle = yarn.linear_density.value, 0.25 * math.pi * yarn.beam_diameter.value**2
    density = 1e-3 * tex / yarn.load_area.value if yarn.blend is None else yarn.blend.density
    if yarn.blend is None and not TEXTILE[0] <= density <= TEXTILE[1]:
        density = TEXTILE[0]
    return 1e-3 * tex / density / circle


def _check_packing(yarn: Yarn) -> None:
    """Check that the fibres fill a possible share of the circle of ``yarn``."""
    tex, diameter, packing = yarn.linear_density.value, yarn.beam_diameter.value, packing_of(yarn)
    low, high = PACKINGS
    if packing < low:
        raise BoundsError(
            f"the fibres of {tex:g} tex fill {100 * packing:.2g} % of the circle, expected at least {100 * low:g} % "
            f"(at most {diameter * math.sqrt(packing / low):.3g} mm): correct beam_diameter, linear_density or "
            "load_area",
            "beam_diameter",
        )
    if yarn.blend is not None and packing > high * LOADED:
        raise BoundsError(
            f"the fibres of {tex:g} tex {yarn.blend.name} fill {100 * packing:.3g} % of the circle, expected at most "
            f"{100 * high:.3g} % (at least {diameter * math.sqrt(packing / high):.3g} mm): correct beam_diameter or "
            "linear_density",
            "beam_diameter",
        )
    dense = 4e-3 * tex / (math.pi * diameter**2)
    if dense > DENSEST:
        raise BoundsError(
            f"{tex:g} tex in the circle are {dense:.3g} g/cm3, expected at most {DENSEST:g} g/cm3 (at least "
            f"{diameter * math.sqrt(dense / DENSEST):.3g} mm): correct beam_diameter or linear_density",
            "beam_diameter",
        )


def strength_of(yarn: Yarn) -> float:
    """Force [N] at the fracture strain by the law of ``yarn``."""
    law, strain = yarn.law, yarn.fracture_strain.value
    if law.kind == "table":
        a, b = next((a, b) for a, b in pairwise(law.points) if b[0] >= strain)
        return (a[1] + (b[1] - a[1]) * (strain - a[0]) / (b[0] - a[0])) * yarn.load_area_mm2
    toe = law.toe_strain if law.kind == "toe" else 0.0
    return 10.0 * yarn.youngs_modulus.value * (strain - 0.5 * toe) * yarn.load_area_mm2  # GPa times % is 10 MPa


def fibre_area(yarn: Yarn, section: InlaySection) -> float:
    """Cross-section [mm2] of the fibres of ``yarn``."""
    return yarn.linear_density_g_per_mm / section.fibre_density_g_per_mm3


def _check_fibres(yarn: Yarn, section: InlaySection) -> None:
    """Check that the load area is no larger than the fibre area."""
    fibres, load, tex = fibre_area(yarn, section), yarn.load_area.value, yarn.linear_density.value
    if load > LOADED * fibres:
        raise BoundsError(
            f"the fibre area of {tex:g} tex is {fibres:.3g} mm2, less than load_area = {load:g} mm2; expected at most "
            f"{1e-3 * tex / load:.3g} g/cm3, or a smaller load_area",
            "section.fibre_density",
        )


def _check_bending(yarn: ReinforcingYarn | KnittingYarn, stiffness: Quantity, field: str) -> None:
    """Check that a yarn is not stiffer than a thin tube of its modulus E, area A and diameter d: E A d^2 / 8."""
    tube = 1e3 * yarn.youngs_modulus.value * yarn.load_area.value * yarn.beam_diameter.value**2 / 8.0
    if stiffness.value > tube:
        raise BoundsError(
            f"must be at most {tube:.4g} N mm2, that of a thin tube of youngs_modulus, load_area and beam_diameter",
            field,
        )
