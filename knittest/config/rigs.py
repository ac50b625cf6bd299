"""Rig fields that several tests share."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from knittest.config.base import BoundsError, Kernel, Strict, number
from knittest.config.fabric import Direction


class Rig(Strict):
    """Rig of a test, with the name of the test in ``kind``."""

    if TYPE_CHECKING:  # a field of each rig: declared here as well it would come first in every config that is written
        kind: str = ""

    #: lengths of the specimen; a shell element is no longer than the shortest
    spans: ClassVar[tuple[str, ...]] = ()
    #: smallest value of a field that is None
    usual: ClassVar[Mapping[str, float]] = {}


class StripRig(Rig):
    """Rig of a strip that is cut along one yarn system."""

    spans: ClassVar[tuple[str, ...]] = ("width",)

    direction: Direction = Field("warp", description="yarn system along the strip")
    width: float = number(50.0, "mm", "width of the strip", gt=0, band=(5, 1000))
    width_mm: ClassVar[Kernel[float]] = Kernel("width")
    yarn_rounding: Literal["down", "up"] = Field(
        "down", description="rounding of the number of yarns (width x density); ensembles alternate"
    )


def check_friction_order(static: float, kinetic: float) -> None:
    """Raise :class:`BoundsError` where static friction is below kinetic friction."""
    if static < kinetic:
        raise BoundsError(
            f"must be at least kinetic_coefficient, {kinetic:g}: --set rig.static_coefficient={kinetic:g}",
            "static_coefficient",
        )
