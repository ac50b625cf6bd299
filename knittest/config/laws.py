"""Laws in a fabric file: axial law of yarns, sections of inlays, shear of shells, contact between yarns."""

from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from knittest.config.base import (
    BoundsError,
    Kernel,
    PerDirection,
    Quantity,
    Source,
    Strict,
    check_bounds,
    measure,
    number,
)

# The axial law of a yarn: linear, with a toe, or a table.
#
# Every condition raises :class:`BoundsError` naming the field.

#: strain [%] and stress [MPa] that a point of a yarn's law may have
LAW_STRAIN, LAW_STRESS = {"unit": "%", "ge": 0, "le": 50}, {"unit": "MPa", "ge": 0, "le": 1e5}
#: toe [%] below which it is a fraction in place of per cent
LEAST_TOE = 0.02


class YarnLaw(Strict):
    """Axial law of a yarn: linear, linear after a parabolic toe, or a table."""

    kind: Literal["linear", "toe", "table"] = Field("linear", description="shape of the axial stress-strain law")
    toe_strain: float = number(0.0, "%", "strain at which the toe ends (kind toe)", ge=0, le=2, least=LEAST_TOE)
    points: list[Annotated[tuple[float, float], Field(strict=False)]] = Field(
        default_factory=list, description="strain [%] and stress [MPa] pairs, rising, first (0, 0) (kind table)"
    )

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _check_law(self)
        return self


def _check_law(law: YarnLaw) -> None:
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


class Flattening(Strict):
    """Lateral compaction of a section of conserved area: pressure = modulus x (share of height)^exponent.

    The pressure acts over the width; from the sides over the height, with the share of the width that is lost.
    """

    exponent: Literal[1, 3] = Field(1, description="power of the share by which the section is compacted")
    modulus: Quantity = measure("MPa", "modulus of the inlays across", gt=0, band=(0.1, 1e4))
    modulus_mpa: ClassVar[Kernel[float]] = Kernel("modulus")


class InlaySection(Strict):
    """Elliptic sections of the inlays in contact: pi / 4 x width x height = fibre area / packing.

    The fibre area is ``linear_density`` over ``fibre_density``. They start with their width in the plane of the fabric.
    """

    shape: Literal["ellipse"] = Field(description="shape of the section")
    fibre_density: Quantity = measure(
        "g/cm3", "mass of the yarn over the volume of its fibres, matrix fibres too", gt=0, band=(0.8, 9)
    )
    fibre_density_g_per_mm3: ClassVar[Kernel[float]] = Kernel("fibre_density")
    packing: PerDirection = measure("1", "fibre area over the area of the section", ge=0.3, le=0.907)
    width_to_height: PerDirection = measure("1", "width of the section over its height", ge=1, le=4)
    flattening: Flattening | None = Field(None, description="how sections flatten under lateral force; none: rigid")


#: shear angle and force that a point of the law may have
ANGLE, FORCE = {"unit": "deg", "ge": 0, "le": 89}, {"unit": "N/mm", "ge": 0, "le": 1e3}
ELASTIC = Quantity(value=0.0, source="assumed", ref="elastic: no unloading was measured")


class ShearLaw(Strict):
    """In-plane shear force S [N/mm] over the shear angle, odd; S dgamma is the work per reference area.

    Under growing shear the force is S. The share ``friction_share`` of it is friction: when the shear turns back, this
    part falls with ``unloading_stiffness`` to the friction of the opposite sign, and slides there.
    """

    kind: Literal["linear", "table"] = Field(
        "linear", description="shape of the law; says which of the next fields count"
    )
    stiffness: Quantity | None = number(
        None, "N/mm", "force per length and radian (kind linear)", gt=0, band=(1e-4, 1e3)
    )
    stiffness_n_per_mm: ClassVar[Kernel[float | None]] = Kernel("stiffness")
    curve: str | None = Field(
        None,
        description="CSV in ./data or the shipped data (kind table): shear_angle_deg and shear_force_n_per_mm "
        "(conjugate), normalised_shear_force_n_per_mm or cauchy_shear_n_per_mm",
    )
    points: list[Annotated[tuple[float, float], Field(strict=False)]] = Field(
        default_factory=list, description="instead of a CSV: shear angle [deg] and force [N/mm] pairs, first (0, 0)"
    )
    definition: Literal["conjugate", "normalised", "cauchy"] = Field(
        "conjugate",
        description="what the force of the points is: conjugate to the angle per reference area; normalised frame "
        "force F_s L_frame / L_fabric^2; Cauchy stress times thickness along a fibre. A CSV says it by its column",
    )
    source: Source | None = Field(
        None, description="where a table comes from: measured, derived, tuned, predicted (by the yarns), assumed, user"
    )
    ref: str = Field("", description="table, figure or reasoning behind a table")
    friction_share: Quantity = number(ELASTIC, "1", "share of the force that is friction", ge=0, le=1)
    unloading_stiffness: Quantity | None = number(
        None,
        "N/mm",
        "stiffness of the friction before it slides; none: the steepest tangent of the law",
        gt=0,
        band=(1e-4, 1e6),
    )
    unloading_stiffness_n_per_mm: ClassVar[Kernel[float | None]] = Kernel("unloading_stiffness")

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.kind == "linear":
            if self.stiffness is None:
                raise BoundsError("missing: kind linear needs it", "stiffness")
            return self
        if (self.curve is None) == (not self.points):
            raise ValueError("kind table needs a curve (CSV) or points, one of them and the other null")
        if self.source is None:
            raise BoundsError("missing: where does the table come from?", "source")
        if self.points:
            _check_shear_points(self.points)
        return self


def _check_shear_points(points: list[tuple[float, float]]) -> None:
    if len(points) < 2 or points[0] != (0.0, 0.0):
        raise BoundsError("expected at least two, the first [0, 0]", "points")
    if any(b[0] <= a[0] for a, b in pairwise(points)):
        raise BoundsError("shear angles must rise strictly", "points")
    for angle, force in points:
        check_bounds(angle, ANGLE, "points")
        check_bounds(force, FORCE, "points")


#: least sticking stiffness of a contact [N/mm]: the share of friction in the work of a sheared cell is 6 % less at it
#: than at 100 N/mm, 21 % less at 3 N/mm and 57 % less at 1 N/mm (variant 1)
LEAST_STICKING = 10.0
#: least normal stiffness [N/mm], and what a contact has that states nothing: coefficient of friction and sticking
#: stiffness over the normal one
LEAST_STIFFNESS, FRICTION, TANGENTIAL = 100.0, 0.3, 0.1


class Compaction(Strict):
    """Progressive yarn contact: F = k d (1 + (d / depth)^exponent), d the penetration, k the normal stiffness."""

    exponent: Literal[1, 2, 3] = Field(2, description="power with which the stiffness grows")
    depth: Quantity = measure("mm", "penetration at which the force is twice the linear one", gt=0, band=(1e-3, 10))
    depth_mm: ClassVar[Kernel[float]] = Kernel("depth")


class PatchRadius(Strict):
    """Radius of the patch over which crossed yarns touch, a disc of even pressure; 0: free spin."""

    inlay_inlay: Quantity = measure("mm", "where a warp crosses a weft", ge=0, le=5)
    inlay_inlay_mm: ClassVar[Kernel[float]] = Kernel("inlay_inlay")
    inlay_loop: Quantity = measure("mm", "where a loop crosses an inlay", ge=0, le=5)
    inlay_loop_mm: ClassVar[Kernel[float]] = Kernel("inlay_loop")
    loop_loop: Quantity = measure("mm", "where loops cross each other", ge=0, le=5)
    loop_loop_mm: ClassVar[Kernel[float]] = Kernel("loop_loop")

    @property
    def largest(self) -> float:
        """Largest of the radii [mm]."""
        return max(self.inlay_inlay_mm, self.inlay_loop_mm, self.loop_loop_mm)


class LateralCompaction(Strict):
    """Lateral compaction of the yarns, pressure = modulus x (share of the height)^exponent, from which patches grow."""

    exponent: Literal[1, 3] = Field(1, description="power of the share of its height by which a yarn is compacted")
    reinforcing: Quantity = measure("MPa", "modulus of the inlays across", gt=0, band=(1e-4, 1e4))
    reinforcing_mpa: ClassVar[Kernel[float]] = Kernel("reinforcing")
    knitting: Quantity = measure("MPa", "modulus of the loop yarn across", gt=0, band=(1e-4, 1e4))
    knitting_mpa: ClassVar[Kernel[float]] = Kernel("knitting")


class Patch(Strict):
    """Patch over which crossed yarns touch and resist spin, up to 2/3 of friction, force and its radius.

    Its radius is given or follows from the force and the lateral compaction of the yarns.
    """

    radius: PatchRadius | None = Field(None, description="given radii")
    compaction: LateralCompaction | None = Field(None, description="or what the yarns give way by across")

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.radius is None) == (self.compaction is None):
            raise ValueError("give either radius or compaction")
        return self


class YarnContact(Strict):
    """Penalty contact between yarns with Coulomb friction.

    A fabric with yarns may leave out the coefficient, the stiffness and the ratio: see ``contact_of`` of
    :mod:`knittest.config.fabric`.
    """

    friction_coefficient: Quantity = measure("1", "yarn-yarn Coulomb coefficient; 0.3 where it is left out", ge=0, le=2)
    static_friction_coefficient: Quantity | None = Field(
        None,
        description="the same before a contact slips; none: equal",
        json_schema_extra={"unit": "1", "ge": 0, "le": 2},
    )
    normal_stiffness: Quantity = measure(
        "N/mm", "penalty stiffness of one crossing; left out: breaking force of the loop yarn over its radius",
        gt=0, band=(LEAST_STIFFNESS, 1e6),
    )  # fmt: skip
    normal_stiffness_n_per_mm: ClassVar[Kernel[float]] = Kernel("normal_stiffness")
    tangential_ratio: Quantity = measure(
        "1", "sticking stiffness over normal stiffness; 0.1 where it is left out", gt=0, le=1
    )
    compaction: Compaction | None = Field(None, description="progressive normal force; none: linear")
    patch: Patch | None = Field(None, description="where crossings resist spin; none: they spin freely")

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Schema without required fields: what a file leaves out is derived."""
        found = handler(core)
        handler.resolve_ref_schema(found).pop("required", None)
        return found

    @model_validator(mode="after")
    def _sticks(self) -> Self:
        """Soft sticking yarns creep against each other where they would rub: no energy is lost in friction."""
        sticking = self.normal_stiffness_n_per_mm * self.tangential_ratio.value
        if sticking < LEAST_STICKING:
            raise BoundsError(
                f"times normal_stiffness is {sticking:.3g} N/mm: contacts that stick would creep instead of rubbing, "
                f"expected at least {LEAST_STICKING:g} N/mm, a ratio of at least "
                f"{LEAST_STICKING / self.normal_stiffness_n_per_mm:.2g}",
                "tangential_ratio",
            )
        return self

    @model_validator(mode="after")
    def _static_not_below(self) -> Self:
        static = self.static_friction_coefficient
        if static is not None and static.value < self.friction_coefficient.value:
            raise BoundsError("must be at least friction_coefficient", "static_friction_coefficient")
        return self
