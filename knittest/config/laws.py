"""Laws in a fabric file: axial law and sections of yarns, shear law of the macro model, yarn contact."""

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

#: pairs of numbers of a table
Points = list[Annotated[tuple[float, float], Field(strict=False)]]
#: bounds of the coordinates of points: strain and stress of a yarn, shear angle and force of the macro model
LAW_STRAIN, LAW_STRESS = {"unit": "%", "ge": 0, "le": 50}, {"unit": "MPa", "ge": 0, "le": 1e5}
ANGLE, FORCE = {"unit": "deg", "ge": 0, "le": 89}, {"unit": "N/mm", "ge": 0, "le": 1e3}
#: smallest toe [%]; below, it is a fraction instead of per cent
LEAST_TOE = 0.02


def check_points(points: Points, name: str, x: dict[str, Any] | None = None, y: dict[str, Any] | None = None) -> None:
    """Raise :class:`BoundsError` unless ``points`` start at (0, 0), rise in ``name`` and are within ``x`` and ``y``."""
    if len(points) < 2 or points[0] != (0.0, 0.0):
        raise BoundsError("expected at least two points, the first [0, 0]", "points")
    for point in points:
        for value, bounds in zip(point, (x, y), strict=True):
            check_bounds(value, bounds or {}, "points")
    if any(b[0] <= a[0] for a, b in pairwise(points)):
        raise BoundsError(f"{name} must rise strictly", "points")


class YarnLaw(Strict):
    """Axial law of a yarn: linear, linear after a parabolic toe, or a table."""

    kind: Literal["linear", "toe", "table"] = Field("linear", description="shape of the axial stress-strain law")
    toe_strain: float = number(0.0, "%", "strain at the end of the toe (kind toe)", ge=0, le=2, least=LEAST_TOE)
    points: Points = Field(
        default_factory=list, description="strain [%] and stress [MPa] pairs, rising, first (0, 0) (kind table)"
    )

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if self.kind == "toe" and self.toe_strain <= 0:
            raise BoundsError("must be greater than 0 % for kind toe", "toe_strain")
        if self.kind != "table":
            return self
        check_points(self.points, "strains", LAW_STRAIN, LAW_STRESS)
        if any(b[1] < a[1] for a, b in pairwise(self.points)):
            raise BoundsError("stresses must not fall (fracture_strain sets the failure)", "points")
        if self.points[1][1] <= 0.0:
            raise BoundsError("the first slope must be above 0: give slack by reinforcing.slack", "points")
        return self


class Flattening(Strict):
    """Lateral compaction of a section of constant area: pressure = modulus x (lost share of the height)^exponent.

    The pressure acts over the width; from the sides it acts over the height, with the lost share of the width.
    """

    exponent: Literal[1, 3] = Field(1, description="exponent of the law")
    modulus: Quantity = measure("MPa", "transverse modulus of the inlays", gt=0, band=(0.1, 1e4))
    modulus_mpa: ClassVar[Kernel[float]] = Kernel("modulus")


class InlaySection(Strict):
    """Elliptic contact sections of the inlays: pi / 4 x width x height = fibre area / packing.

    The fibre area is ``linear_density`` over ``fibre_density``. The width lies in the plane of the fabric.
    """

    shape: Literal["ellipse"] = Field(description="shape of the section")
    fibre_density: Quantity = measure(
        "g/cm3", "mass over volume of all fibres of the yarn, matrix fibres included", gt=0, band=(0.8, 9)
    )
    fibre_density_g_per_mm3: ClassVar[Kernel[float]] = Kernel("fibre_density")
    packing: PerDirection = measure("1", "fibre area over the area of the section", ge=0.3, le=0.907)
    width_to_height: PerDirection = measure("1", "width over height of the section", ge=1, le=4)
    flattening: Flattening | None = Field(None, description="flattening under lateral force; none: rigid sections")


class SoftShell(Strict):
    """Shell of loose fibres around the core of a soft yarn, which has ``beam_diameter``.

    Energy per length of both yarns at the distance d of their centre-lines (Singal et al., 2024): k D^2 / (p (p - 1))
    (z^(1-p) - 1 + (1-p)(1-z)) with D = outer - core diameter and z = (d - core) / D.
    """

    outer_diameter: Quantity = measure("mm", "diameter at which the fibres of two yarns touch", gt=0, band=(0.05, 10))
    outer_diameter_mm: ClassVar[Kernel[float]] = Kernel("outer_diameter")
    rigidity: Quantity = measure("N/mm3", "k: stiffness of the shell per length of both yarns", gt=0, band=(1e-6, 10))
    rigidity_n_per_mm3: ClassVar[Kernel[float]] = Kernel("rigidity")
    exponent: Quantity = measure("1", "p: power by which the pressure grows towards the core", ge=1.2, le=5)


ELASTIC = Quantity(value=0.0, source="assumed", ref="elastic: no unloading was measured")


class ShearLaw(Strict):
    """In-plane shear force S [N/mm] over the shear angle, odd; S dgamma is the work per reference area.

    Under growing shear the force is S. Its share ``friction_share`` is friction: when the shear reverses, this part
    falls with ``unloading_stiffness`` to the friction of opposite sign, and slides there.
    """

    kind: Literal["linear", "table"] = Field("linear", description="shape of the law")
    stiffness: Quantity | None = number(
        None, "N/mm", "force per length and radian (kind linear)", gt=0, band=(1e-4, 1e3)
    )
    stiffness_n_per_mm: ClassVar[Kernel[float | None]] = Kernel("stiffness")
    curve: str | None = Field(
        None, description="CSV in ./data or the shipped data (kind table): shear_angle_deg and shear_force_n_per_mm "
        "(conjugate), normalised_shear_force_n_per_mm or cauchy_shear_n_per_mm",
    )  # fmt: skip
    points: Points = Field(
        default_factory=list, description="instead of a CSV: shear angle [deg] and force [N/mm] pairs, first (0, 0)"
    )
    definition: Literal["conjugate", "normalised", "cauchy"] = Field(
        "conjugate", description="force of the points: conjugate to the angle per reference area; normalised frame "
        "force F_s L_frame / L_fabric^2; Cauchy stress x thickness along a fibre. A CSV states it by its column",
    )  # fmt: skip
    source: Source | None = Field(
        None, description="origin of a table: measured, derived, tuned, predicted (meso model), assumed, user"
    )
    ref: str = Field("", description="table, figure or reasoning behind a table")
    friction_share: Quantity = number(ELASTIC, "1", "share of the force that is friction", ge=0, le=1)
    unloading_stiffness: Quantity | None = number(
        None, "N/mm", "stiffness of the friction before it slides; none: the steepest tangent of the law",
        gt=0, band=(1e-4, 1e6),
    )  # fmt: skip
    unloading_stiffness_n_per_mm: ClassVar[Kernel[float | None]] = Kernel("unloading_stiffness")

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if self.kind == "linear":
            if self.stiffness is None:
                raise BoundsError("missing: kind linear needs it", "stiffness")
            return self
        if (self.curve is None) == (not self.points):
            raise ValueError("kind table needs either curve (a CSV) or points")
        if self.source is None:
            raise BoundsError("missing: origin of the table (measured, derived, tuned, predicted, assumed)", "source")
        if self.points:
            check_points(self.points, "shear angles", ANGLE, FORCE)
        return self


#: smallest sticking stiffness of a contact [N/mm]: friction work of a sheared cell is 6 % smaller at it than at
#: 100 N/mm, 21 % at 3 N/mm and 57 % at 1 N/mm (variant 1)
LEAST_STICKING = 10.0
#: smallest normal stiffness [N/mm]; defaults of the coefficient of friction and of sticking over normal stiffness
LEAST_STIFFNESS, FRICTION, TANGENTIAL = 100.0, 0.3, 0.1


class Compaction(Strict):
    """Progressive yarn contact: F = k d (1 + (d / depth)^exponent), d the penetration, k the normal stiffness."""

    exponent: Literal[1, 2, 3] = Field(2, description="exponent of the law")
    depth: Quantity = measure("mm", "penetration at which the force is twice the linear force", gt=0, band=(1e-3, 10))
    depth_mm: ClassVar[Kernel[float]] = Kernel("depth")


class PatchRadius(Strict):
    """Radius of the contact patch of crossing yarns, a disc of even pressure; 0: no resistance to spin."""

    inlay_inlay: Quantity = measure("mm", "crossings of warp and weft", ge=0, le=5)
    inlay_inlay_mm: ClassVar[Kernel[float]] = Kernel("inlay_inlay")
    inlay_loop: Quantity = measure("mm", "crossings of loop and inlay", ge=0, le=5)
    inlay_loop_mm: ClassVar[Kernel[float]] = Kernel("inlay_loop")
    loop_loop: Quantity = measure("mm", "crossings of loops", ge=0, le=5)
    loop_loop_mm: ClassVar[Kernel[float]] = Kernel("loop_loop")

    @property
    def largest(self) -> float:
        """Largest radius [mm]."""
        return max(self.inlay_inlay_mm, self.inlay_loop_mm, self.loop_loop_mm)


class LateralCompaction(Strict):
    """Lateral compaction that sizes the patch: pressure = modulus x (lost share of the height)^exponent."""

    exponent: Literal[1, 3] = Field(1, description="exponent of the law")
    reinforcing: Quantity = measure("MPa", "transverse modulus of the inlays", gt=0, band=(1e-4, 1e4))
    reinforcing_mpa: ClassVar[Kernel[float]] = Kernel("reinforcing")
    knitting: Quantity = measure("MPa", "transverse modulus of the knitting yarn", gt=0, band=(1e-4, 1e4))
    knitting_mpa: ClassVar[Kernel[float]] = Kernel("knitting")


class Patch(Strict):
    """Contact patch of crossing yarns with resistance to spin, up to 2/3 x friction x force x radius."""

    radius: PatchRadius | None = Field(None, description="constant radii")
    compaction: LateralCompaction | None = Field(
        None, description="or lateral compaction, which makes the radii grow with force"
    )

    @model_validator(mode="after")
    def _has_radius_or_compaction(self) -> Self:
        if (self.radius is None) == (self.compaction is None):
            raise ValueError("expected either radius or compaction")
        return self


class YarnContact(Strict):
    """Penalty contact between yarns with Coulomb friction; ``contact_of`` of a fabric derives missing fields."""

    friction_coefficient: Quantity = measure("1", "Coulomb coefficient yarn on yarn; default 0.3", ge=0, le=2)
    static_friction_coefficient: Quantity | None = number(
        None, "1", "static coefficient, until a contact slips; none: friction_coefficient", ge=0, le=2
    )
    normal_stiffness: Quantity = measure(
        "N/mm", "penalty stiffness of one crossing; default: breaking force of the knitting yarn over its radius",
        gt=0, band=(LEAST_STIFFNESS, 1e6),
    )  # fmt: skip
    normal_stiffness_n_per_mm: ClassVar[Kernel[float]] = Kernel("normal_stiffness")
    tangential_ratio: Quantity = measure("1", "sticking stiffness over normal stiffness; default 0.1", gt=0, le=1)
    compaction: Compaction | None = Field(None, description="progressive normal force; none: linear")
    patch: Patch | None = Field(None, description="resistance of crossings to spin; none: free spin")

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Schema without required fields: missing ones are derived."""
        found = handler(core)
        handler.resolve_ref_schema(found).pop("required", None)
        return found

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        sticking = self.normal_stiffness_n_per_mm * self.tangential_ratio.value
        if sticking < LEAST_STICKING:  # sticking yarns would creep: no energy is lost in friction
            raise BoundsError(
                f"the sticking stiffness is {sticking:.3g} N/mm, expected at least {LEAST_STICKING:g} N/mm (a ratio of "
                f"at least {LEAST_STICKING / self.normal_stiffness_n_per_mm:.2g}): softer contacts creep instead of "
                "rubbing",
                "tangential_ratio",
            )
        static = self.static_friction_coefficient
        if static is not None and static.value < self.friction_coefficient.value:
            raise BoundsError("must be at least friction_coefficient", "static_friction_coefficient")
        return self
