"""Config of the bias extension test."""

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, number
from knittest.config.kernel_units import Kernel
from knittest.config.rigs import Rig
from knittest.config.run import Run


class BiasExtensionRig(Rig):
    """Bias extension: a strip cut at 45 deg to its yarns, one clamp fixed, one pulled."""

    spans = ("gauge_length", "width")

    kind: Literal["bias-extension"] = "bias-extension"
    gauge_length: float = number(200.0, "mm", "distance of the clamps, at least twice the width", gt=0, band=(20, 2000))
    gauge_length_mm: ClassVar[Kernel[float]] = Kernel("gauge_length")
    width: float = number(100.0, "mm", "width of the strip", gt=0, band=(10, 1000))
    width_mm: ClassVar[Kernel[float]] = Kernel("width")
    max_angle: float = number(
        45.0, "deg", "end of the test: shear angle of the middle, of yarns that keep their length", gt=0, le=80
    )
    membrane_share: float = number(
        0.05, "1", "meso: share of the yarns' axial stiffness that is kept: they are far from their strength, and the "
        "step grows", gt=0, le=1,
    )  # fmt: skip

    @model_validator(mode="after")
    def _has_a_middle(self) -> Self:
        if self.gauge_length < 2.0 * self.width:
            raise BoundsError(
                f"must be at least twice the width, {2.0 * self.width:g} mm: in shorter strips yarns run from clamp to "
                "clamp",
                "gauge_length",
            )
        return self


class BiasExtensionRun(Run):
    """A bias extension test."""

    rig: BiasExtensionRig = Field(default_factory=BiasExtensionRig)
