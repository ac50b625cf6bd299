"""Config of the pull-out test."""

from typing import ClassVar, Literal

from pydantic import Field

from knittest.config.base import number
from knittest.config.kernel_units import Kernel
from knittest.config.rigs import StripRig
from knittest.config.run import Run


class PullOutRig(StripRig):
    """Pull-out: the middle inlay of a direction is pulled out of a piece of fabric whose other yarns are clamped."""

    spans = ("width", "length")

    kind: Literal["pull-out"] = "pull-out"
    width: float = number(25.0, "mm", "width of the piece, across the pulled inlay", gt=0, band=(10, 200))
    width_mm: ClassVar[Kernel[float]] = Kernel("width")
    length: float = number(30.0, "mm", "embedded length: that of the piece along the inlay", gt=0, band=(10, 500))
    length_mm: ClassVar[Kernel[float]] = Kernel("length")
    travel: float = number(10.0, "mm", "way of the inlay's clamp", gt=0, band=(0.5, 400))
    travel_mm: ClassVar[Kernel[float]] = Kernel("travel")
    clamped: Literal["sides", "far"] = Field(
        "sides",
        description="edges of the piece that are clamped, a pitch wide: both sides along the inlay, or the far end, "
        "where the inlay is cut loose",
    )
    membrane_share: float = number(
        0.05, "1", "share of the yarns' axial stiffness that is kept: forces are small, and the step grows", gt=0, le=1
    )


class PullOutRun(Run):
    """A pull-out test."""

    rig: PullOutRig = Field(default_factory=PullOutRig)
