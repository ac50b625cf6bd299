"""Rigs of tests, as far as tests share them; that of one test stands in the test's folder."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from knittest.config.base import BoundsError, Kernel, Strict, number
from knittest.config.fabric import Direction


class Rig(Strict):
    """The rig of a test, which names the test in ``kind``."""

    if TYPE_CHECKING:  # a field of each rig: declared here as well it would come first in every config that is written
        kind: str = ""

    #: lengths of the specimen, of which the shortest is no shorter than a shell
    spans: ClassVar[tuple[str, ...]] = ()
    #: what a field stands for, at least, that is none
    usual: ClassVar[Mapping[str, float]] = {}


class StripRig(Rig):
    """A test on a strip cut along one yarn system."""

    spans: ClassVar[tuple[str, ...]] = ("width",)

    direction: Direction = Field("warp", description="yarn system along the strip")
    width: float = number(50.0, "mm", "width of the strip", gt=0, band=(5, 1000))
    width_mm: ClassVar[Kernel[float]] = Kernel("width")
    yarn_rounding: Literal["down", "up"] = Field(
        "down", description="whole yarns when width times density is fractional; ensembles alternate"
    )


def check_friction_order(static: float, kinetic: float) -> None:
    """Raise :class:`BoundsError` where static friction is below kinetic friction."""
    if static < kinetic:
        raise BoundsError(
            f"{static:g} is less than kinetic_coefficient, {kinetic:g}: set both, here --set "
            f"rig.static_coefficient={kinetic:g} or more",
            "static_coefficient",
        )
