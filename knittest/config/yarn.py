"""The two yarns of a fabric; each number alone is bounded beside its field, numbers that exclude each other below.

Every condition raises :class:`BoundsError` naming the field.
"""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from knittest.config.base import BoundsError, Directed, Kernel, PerDirection, Quantity, Strict, measure, number
from knittest.config.laws import InlaySection, YarnLaw
from knittest.config.yarn_card import SETTINGS, Blend, blend_of, converted_card

#: steepest tangent of a yarn's law over its modulus: beyond, stresses are in another unit
LAW_STEEPNESS = (0.1, 10.0)
#: crimp [%] below which a wave is no wave but a fraction in place of per cent: 0.006 mm high at a pitch of 3.6 mm
LEAST_CRIMP = 0.02
#: strength for the mass [N/tex] that no yarn reaches: the strongest fibres have 4
TENACITY = 6.0
#: least mass over length and load area [g/cm3]: no area is larger than that of a loose yarn, its air included
LOOSEST = 0.3
#: largest mass over length and area [g/cm3]: steel has 7.9, copper 8.9
DENSEST = 9.0
#: stiffness for the mass [N/tex] that no yarn reaches: the stiffest carbon fibres have 420
STIFFEST = 450.0
#: fibre area over the area of the circle of beam_diameter: loose yarns, and hexagonal packing of filaments
PACKINGS = (0.15, 0.907)
#: densities of textile fibres [g/cm3], polypropylene to basalt: a load area with another one is that of some fibres
TEXTILE = (0.9, 2.8)
#: stiffness and strength of a yarn over those of its filaments
STIFFNESS, STRENGTH = (0.1, 1.25), (0.02, 1.25)
#: area that carries load over that of the fibres, at most: both are rounded in a card
LOADED = 1.02


class Yarn(Strict):
    """Fields that both yarn systems share."""

    #: numbers that no data sheet states, by field: value and reason
    usual: ClassVar[Mapping[str, tuple[float, str]]] = {}

    description: str = Field("", description="make of the yarn")
    fibre: str | dict[str, float] | None = Field(
        None, description="fibre of the shipped table, or fibres with their shares of mass ({E-glass: 0.6, "
        "polypropylene: 0.4}); all numbers of the yarn but linear_density are then derived where they are not stated",
    )  # fmt: skip
    linear_density: Quantity = measure("tex", "mass per length; plies as 4 x 300 tex", gt=0, band=(1, 20000))
    linear_density_g_per_mm: ClassVar[Kernel[float]] = Kernel("linear_density")
    twist: Quantity | None = number(
        None, "1/m", "with fibre: turns of the whole yarn per metre; the modulus falls with cos^2 of the helix on its "
        "surface", ge=0, le=5000,
    )  # fmt: skip
    packing: Quantity | None = number(
        None, "1", "with fibre: fibre area over the area of the circle, of which beam_diameter follows; none: 0.6",
        ge=PACKINGS[0], le=PACKINGS[1],
    )  # fmt: skip
    efficiency: Quantity | None = number(
        None, "1", "with fibre: failure strain of the yarn over that of its filaments; none: that of the table",
        ge=0.05, le=1.2,
    )  # fmt: skip
    bending_share: Quantity | None = number(
        None, "1", "with fibre: share of the way from the EI of free filaments to that of filaments that cannot slide; "
        "none: 0.002", ge=0, le=1,
    )  # fmt: skip
    beam_diameter: Quantity = measure("mm", "diameter of the circular beam in contact", gt=0, band=(0.05, 10))
    beam_diameter_mm: ClassVar[Kernel[float]] = Kernel("beam_diameter")
    youngs_modulus: Quantity = measure("GPa", "axial modulus on the load area", gt=0, band=(0.1, 1000))
    youngs_modulus_mpa: ClassVar[Kernel[float]] = Kernel("youngs_modulus")
    load_area: Quantity = measure("mm2", "area that carries the modulus", gt=0, band=(1e-3, 50))
    load_area_mm2: ClassVar[Kernel[float]] = Kernel("load_area")
    fracture_strain: Quantity = measure(
        "%", "axial strain at failure; sd is the yarn-to-yarn scatter", gt=0, band=(0.1, 50)
    )
    fracture_strain_fraction: ClassVar[Kernel[float]] = Kernel("fracture_strain")
    torsion_ratio: Quantity | None = number(
        None, "1", "GJ over EI; none: 0.77, that of solid, isotropic yarns (1 / (1 + nu), nu = 0.3); of free filaments "
        "it is theirs, 2 G / E: some 0.8 of glass, 0.15 of carbon", ge=0.02, le=2,
    )  # fmt: skip
    law: YarnLaw = Field(default_factory=YarnLaw, description="shape of the axial law")

    @model_validator(mode="before")
    @classmethod
    def _from_data_sheet(cls, card: object) -> Any:
        return converted_card(card, cls, cls.usual)

    @model_validator(mode="after")
    def _law_fits(self) -> Self:
        for name in SETTINGS:
            if self.fibre is None and getattr(self, name) is not None:
                raise BoundsError("counts only where the card names its fibre: state fibre, or remove it", name)
        _check_yarn(self)
        _check_fibre(self)
        _check_packing(self)
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """All numbers are required, or a fibre and its linear density, which may be text."""
        found = handler(core)
        model = handler.resolve_ref_schema(found)
        model["anyOf"] = [{"required": model.pop("required")}, {"required": ["fibre", "linear_density"]}]
        density = model["properties"]["linear_density"]
        density["anyOf"] = [{"$ref": density.pop("$ref")}, {"type": "string"}]
        return found

    @property
    def blend(self) -> Blend | None:
        """Fibres that the card names, none without."""
        return None if self.fibre is None else blend_of(self.fibre)


class ReinforcingYarn(Yarn):
    """The straight (slightly wavy) warp and weft inlays."""

    usual: ClassVar[Mapping[str, tuple[float, str]]] = {
        "crimp": (0.6, "near that of two relaxed fabrics; knittest check states that of the relaxed cell"),
        "crimp_scatter": (0.0, "not stated"),
        "slack": (0.0, "not stated"),
    }
    bending_stiffness: PerDirection = measure(
        "N mm2", "EI of one yarn, by the section integration rule", gt=0, band=(1e-4, 1e4)
    )
    bending_stiffness_n_mm2: ClassVar[Kernel[Directed]] = Kernel("bending_stiffness")
    crimp: PerDirection = measure("%", "extra length of the harmonic wave", ge=0, le=5, least=LEAST_CRIMP)
    crimp_fraction: ClassVar[Kernel[Directed]] = Kernel("crimp")
    crimp_scatter: PerDirection = measure("1", "sd of the wave amplitude, relative, yarn to yarn", ge=0, le=0.5)
    slack: PerDirection = measure("%", "scale of the half-normal slack of a yarn before it carries load", ge=0, le=2)
    slack_fraction: ClassVar[Kernel[Directed]] = Kernel("slack")
    section: InlaySection | None = Field(
        None,
        description="elliptic sections in contact, in cells and in runs of yarns; none: circles of beam_diameter, "
        "whatever fibres they hold",
    )

    def ellipse_mm(self, section: InlaySection, direction: str) -> tuple[float, float]:
        """Width and height [mm] of the yarns of ``direction`` with elliptic ``section``."""
        ratio = section.width_to_height.of(direction).value
        area = fibre_area(self, section) / section.packing.of(direction).value
        height = math.sqrt(4.0 * area / (math.pi * ratio))
        return ratio * height, height

    def section_mm(self, direction: str) -> tuple[float, float]:
        """Width and height [mm] of the section of ``direction`` in contact."""
        if self.section is None:
            return self.beam_diameter_mm, self.beam_diameter_mm
        return self.ellipse_mm(self.section, direction)

    @model_validator(mode="after")
    def _load_is_carried_by_fibres(self) -> Self:
        if self.section is not None:
            _check_fibres(self, self.section)
        return self

    @model_validator(mode="after")
    def _bends_like_its_section(self) -> Self:
        for direction in ("warp", "weft"):
            _check_bending(self, self.bending_stiffness.of(direction), f"bending_stiffness.{direction}")
        return self


class KnittingYarn(Yarn):
    """The yarn of the loops."""

    usual: ClassVar[Mapping[str, tuple[float, str]]] = {
        "degree_of_set": (0.9, "fabrics whose loops had no set would curl")
    }
    bending_stiffness: Quantity = measure("N mm2", "EI of the yarn", gt=0, band=(1e-4, 100))
    bending_stiffness_n_mm2: ClassVar[Kernel[float]] = Kernel("bending_stiffness")
    degree_of_set: Quantity = measure(
        "1", "share of its bend in the loop that the yarn keeps by itself; the rest presses the crossings", ge=0, le=1
    )
    draw_in: Quantity | None = number(
        None, "%", "by how much the loop's yarn at rest is shorter than the relaxed loop; the fabric is settled under "
        "it by the contact law of the run before every test of yarns. None: loops start without tension, and overlaps "
        "free of force", ge=0, le=10,
    )  # fmt: skip
    draw_in_fraction: ClassVar[Kernel[float | None]] = Kernel("draw_in")
    tension: Quantity | None = number(
        None, "N", "the same by the mean tension of the loops' yarn in the settled fabric, instead of draw_in",
        gt=0, band=(1e-3, 20),
    )  # fmt: skip
    tension_n: ClassVar[Kernel[float | None]] = Kernel("tension")
    loop_scatter: Literal["none", "courses"] = Field(
        "none", description="courses: the loop length of each course of a specimen is drawn with the sd of "
        "fabric.loop_length, as strengths of yarns are; cells have the mean. Settled as under draw_in",
    )  # fmt: skip

    @property
    def settled(self) -> bool:
        """Tell whether yarns come to rest by the contact law of the run before every test."""
        return self.draw_in is not None or self.tension is not None or self.loop_scatter != "none"

    @model_validator(mode="after")
    def _one_state_of_rest(self) -> Self:
        if self.draw_in is not None and self.tension is not None:
            raise BoundsError("excludes draw_in: keep the one that was measured", "tension")
        return self

    @model_validator(mode="after")
    def _bends_like_its_section(self) -> Self:
        _check_bending(self, self.bending_stiffness, "bending_stiffness")
        return self


def _check_yarn(yarn: Yarn) -> None:
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


def _check_fibre(yarn: Yarn) -> None:
    """No yarn is stiffer or stronger for its mass than the best fibres, lighter than a loose bundle or too dense."""
    tex, area, strength = yarn.linear_density.value, yarn.load_area.value, strength_of(yarn)
    stiffness = 1e3 * yarn.youngs_modulus.value * area
    if tex < 1e3 * LOOSEST * area:
        raise BoundsError(
            f"{tex:g} tex over {area:g} mm2 are {1e-3 * tex / area:.3g} g/cm3, expected at least {LOOSEST:g} g/cm3, or "
            f"at most {1e-3 * tex / LOOSEST:.3g} mm2: correct it or linear_density",
            "load_area",
        )
    if tex > 1e3 * DENSEST * area:
        raise BoundsError(
            f"{tex:g} tex over {area:g} mm2 are {1e-3 * tex / area:.3g} g/cm3, expected at most {DENSEST:g} g/cm3, or "
            f"at least {1e-3 * tex / DENSEST:.3g} mm2: correct it or linear_density",
            "load_area",
        )
    if stiffness > STIFFEST * tex:
        raise BoundsError(
            f"on load_area = {area:g} mm2 makes {stiffness / tex:.3g} N/tex at linear_density = {tex:g} tex, expected "
            f"at most {STIFFEST:g} N/tex, that of fibres: correct it, load_area or linear_density",
            "youngs_modulus",
        )
    if strength > TENACITY * tex:
        raise BoundsError(
            f"a strength of {strength:.4g} N is {strength / tex:.3g} N/tex at linear_density = {tex:g} tex: expected "
            f"at most {TENACITY:g} N/tex, that of fibres: correct youngs_modulus, load_area, linear_density or it",
            "fracture_strain",
        )
    if yarn.blend is not None:
        _check_blend(yarn, yarn.blend, stiffness, strength)


def _check_blend(yarn: Yarn, blend: Blend, stiffness: float, strength: float) -> None:
    """Stiffness and strength are those of the fibres that the card names, and so is the area that carries them."""
    tex, area = yarn.linear_density.value, yarn.load_area.value
    if area > LOADED * 1e-3 * tex / blend.density:
        raise BoundsError(
            f"more than all fibres of {tex:g} tex {blend.name} have at {blend.density:.3g} g/cm3, expected at most "
            f"{1e-3 * tex / blend.density:.3g} mm2: correct it, linear_density or fibre",
            "load_area",
        )
    for field, found, most, (least, largest) in (
        ("youngs_modulus", stiffness / tex, blend.modulus / blend.density, STIFFNESS),
        ("fracture_strain", strength / tex, blend.strength / blend.density, STRENGTH),
    ):
        if not least * most <= found <= largest * most:
            what = "a stiffness" if field == "youngs_modulus" else "a strength"
            raise BoundsError(
                f"{what} of {found:.3g} N/tex, but {blend.name} has {most:.3g} N/tex, expected {least * most:.3g} to "
                f"{largest * most:.3g} N/tex: correct it, load_area, linear_density or fibre",
                field,
            )


def packing_of(yarn: Yarn) -> float:
    """Fibre area over the area of the circle of ``yarn``.

    Where the card does not name its fibres, their density is that of the load area, if textile fibres have it, else
    that of the lightest.
    """
    tex, circle = yarn.linear_density.value, 0.25 * math.pi * yarn.beam_diameter.value**2
    density = 1e-3 * tex / yarn.load_area.value if yarn.blend is None else yarn.blend.density
    if yarn.blend is None and not TEXTILE[0] <= density <= TEXTILE[1]:
        density = TEXTILE[0]
    return 1e-3 * tex / density / circle


def _check_packing(yarn: Yarn) -> None:
    """The circle of a yarn is neither filled beyond what filaments can fill nor almost empty."""
    tex, diameter, packing = yarn.linear_density.value, yarn.beam_diameter.value, packing_of(yarn)
    low, high = PACKINGS
    if packing < low:
        raise BoundsError(
            f"{tex:g} tex fill {100 * packing:.2g} % of the circle, expected at least {100 * low:g} %, or at most "
            f"{diameter * math.sqrt(packing / low):.3g} mm: correct it, linear_density or load_area",
            "beam_diameter",
        )
    if yarn.blend is not None and packing > high * LOADED:
        raise BoundsError(
            f"{tex:g} tex {yarn.blend.name} fill {100 * packing:.3g} % of the circle, expected at most "
            f"{100 * high:.3g} %, or at least {diameter * math.sqrt(packing / high):.3g} mm: correct it or "
            "linear_density",
            "beam_diameter",
        )
    dense = 4e-3 * tex / (math.pi * diameter**2)
    if dense > DENSEST:
        raise BoundsError(
            f"{tex:g} tex in the circle are {dense:.3g} g/cm3, expected at most {DENSEST:g} g/cm3, or at least "
            f"{diameter * math.sqrt(dense / DENSEST):.3g} mm: correct it or linear_density",
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
    """No more area carries load than the yarn has fibres."""
    fibres, load = fibre_area(yarn, section), yarn.load_area.value
    if load > LOADED * fibres:
        raise BoundsError(
            f"linear_density = {yarn.linear_density.value:g} tex makes {fibres:.3g} mm2 of fibres, less than the "
            f"load_area of {load:g} mm2; expected at most {1e-3 * yarn.linear_density.value / load:.3g} g/cm3, or a "
            "smaller load_area",
            "section.fibre_density",
        )


def _check_bending(yarn: ReinforcingYarn | KnittingYarn, stiffness: Quantity, field: str) -> None:
    """No section of modulus E, area A and diameter d is stiffer than the thin tube, E A d^2 / 8."""
    tube = 1e3 * yarn.youngs_modulus.value * yarn.load_area.value * yarn.beam_diameter.value**2 / 8.0
    if stiffness.value > tube:
        raise BoundsError(
            f"must be at most {tube:.4g} N mm2, that of a thin tube of youngs_modulus, load_area and beam_diameter",
            field,
        )
