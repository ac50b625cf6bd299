"""Config of the picture frame test."""

from itertools import pairwise
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, number
from knittest.config.kernel_units import Kernel
from knittest.config.rigs import Rig
from knittest.config.run import Run


class PictureFrameRig(Rig):
    """Picture frame: a square of fabric on needles along four hinged sides, sheared by the crosshead."""

    spans = ("side",)

    kind: Literal["picture-frame"] = "picture-frame"
    side: float = number(200.0, "mm", "side of the sheared square", gt=0, band=(10, 1000))
    side_mm: ClassVar[Kernel[float]] = Kernel("side")
    frame_side: float | None = number(
        None, "mm", "side of the frame, hinge to hinge, which holds the square by arms; none: that of the square",
        gt=0, band=(10, 2000),
    )  # fmt: skip
    frame_side_mm: ClassVar[Kernel[float | None]] = Kernel("frame_side")
    max_angle: float = number(45.0, "deg", "end of the test: shear angle of the frame", gt=0, le=80)
    turns: list[float] = Field(
        default_factory=list,
        description="shear angles [deg] at which the frame turns on its way: [30, 5] shears to 30, back to 5, and on",
    )
    cycles: int = Field(
        0, ge=0, le=20, description="times that the frame shears to max_angle and back to 0, where it ends; 0: ends at "
        "max_angle",
    )  # fmt: skip
    mounting_slack: float = number(
        0.05, "%", "slack with which the yarns hang on the needles (assumed); taut yarns cannot wrinkle", ge=0, le=5,
        least=0.01,
    )  # fmt: skip
    mounting_slack_fraction: ClassVar[Kernel[float]] = Kernel("mounting_slack")
    membrane_share: float = number(
        0.05,
        "1",
        "meso: share of the yarns' axial stiffness that is kept: none is pulled, and the step grows",
        gt=0,
        le=1,
    )
    imperfection: float = number(0.05, "mm", "amplitude of the seeded unevenness from which wrinkles start", ge=0, le=5)
    imperfection_mm: ClassVar[Kernel[float]] = Kernel("imperfection")

    @model_validator(mode="after")
    def _frame_holds_the_square(self) -> Self:
        if self.frame_side is not None and self.frame_side < self.side:
            raise BoundsError(f"must be at least that of the square, {self.side:g} mm", "frame_side")
        return self

    @model_validator(mode="after")
    def _turns_are_turns(self) -> Self:
        if self.turns and self.cycles:
            raise BoundsError("are those of a frame that ends at max_angle: leave out turns, or cycles", "turns")
        ways = [b - a for a, b in pairwise([0.0, *self.turns, self.max_angle])]
        if any(way == 0.0 or (way > 0.0) != (k % 2 == 0) for k, way in enumerate(ways)):
            raise BoundsError("must go up and down in turn, and up to max_angle at the end", "turns")
        if not all(0.0 <= angle <= self.max_angle for angle in self.turns):
            raise BoundsError(f"must lie between 0 and max_angle, {self.max_angle:g} deg", "turns")
        return self

    @property
    def stops(self) -> list[float]:
        """Shear angles [deg] at which the frame turns, or ends."""
        return [self.max_angle, 0.0] * self.cycles if self.cycles else [*self.turns, self.max_angle]


class PictureFrameRun(Run):
    """A picture frame test."""

    rig: PictureFrameRig = Field(default_factory=PictureFrameRig)
