"""The axial law of a yarn: linear, with a toe, or a table.

Every condition raises :class:`BoundsError` naming the field.
"""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, Strict, check_bounds, number

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
