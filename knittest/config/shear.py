"""Shear law of the shells: a line or a table, and how much of it is friction."""

from itertools import pairwise
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, Quantity, Source, Strict, check_bounds, number
from knittest.config.kernel_units import Kernel

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
            _check_points(self.points)
        return self


def _check_points(points: list[tuple[float, float]]) -> None:
    if len(points) < 2 or points[0] != (0.0, 0.0):
        raise BoundsError("expected at least two, the first [0, 0]", "points")
    if any(b[0] <= a[0] for a, b in pairwise(points)):
        raise BoundsError("shear angles must rise strictly", "points")
    for angle, force in points:
        check_bounds(angle, ANGLE, "points")
        check_bounds(force, FORCE, "points")
