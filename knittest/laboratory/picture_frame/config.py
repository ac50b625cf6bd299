"""Config of the picture frame test: fields, presets, and the origin of its results."""

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.kinds import Stated
from knittest.config.base import BoundsError, Kernel, number
from knittest.config.rigs import Rig
from knittest.config.run import Run
from knittest.experiment.origin import Origin, RowKind


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
    reversal_angles: list[float] = Field(
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
        0.05, "1", "meso: share of the yarns' axial stiffness that is kept: none is pulled, and the step grows", gt=0,
        le=1,
    )  # fmt: skip
    imperfection: float = number(0.05, "mm", "amplitude of the seeded unevenness from which wrinkles start", ge=0, le=5)
    imperfection_mm: ClassVar[Kernel[float]] = Kernel("imperfection")

    @model_validator(mode="after")
    def _frame_can_move(self) -> Self:
        if self.frame_side is not None and self.frame_side < self.side:
            raise BoundsError(f"must be at least the side of the square, {self.side:g} mm", "frame_side")
        if self.reversal_angles and self.cycles:
            raise BoundsError("cannot be combined with cycles: leave out one of both", "reversal_angles")
        ways = [b - a for a, b in pairwise([0.0, *self.reversal_angles, self.max_angle])]
        if any(way == 0.0 or (way > 0.0) != (k % 2 == 0) for k, way in enumerate(ways)):
            raise BoundsError(
                "must alternate between loading and unloading, and end by loading to max_angle", "reversal_angles"
            )
        if not all(0.0 <= angle <= self.max_angle for angle in self.reversal_angles):
            raise BoundsError(f"must lie between 0 and max_angle, {self.max_angle:g} deg", "reversal_angles")
        return self

    @property
    def outer_side(self) -> float:
        """Side of the frame [mm], which is that of the square where none is given."""
        return self.frame_side or self.side

    @property
    def stops(self) -> list[float]:
        """Shear angles [deg] at which the frame turns, or ends."""
        return [self.max_angle, 0.0] * self.cycles if self.cycles else [*self.reversal_angles, self.max_angle]


class PictureFrameRun(Run):
    """A picture frame test."""

    rig: PictureFrameRig = Field(default_factory=PictureFrameRig)
    soft_sheet: ClassVar[Mapping[tuple[str, str], float]] = {("solver", "speed"): 0.1}


#: side of a square of yarns [mm]
SIDE = {"quick": 50.0, "standard": 100.0, "paper": 200.0}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``; cycles are slower, as little work is done up to the first angle."""
    slower = {"macro": 5.0, "meso": 6.0}[scale] if stated("cycles") else 1.0
    model = {"meso": {"elements_per_loop": 30, "elements_per_wave": 4}}
    if scale == "macro":
        return {"model": model, "solver": {"speed": 0.5 / slower, "ramp": 5.0 * slower, "damping": 0.002}}
    side = SIDE[preset]
    solver = {"speed": 3.0 / slower, "damping": 0.05, "safety": 0.7, "ramp": max(2.0, side / 50.0) * slower}
    return {"model": model, "rig": {"side": side}, "solver": solver}


class PictureFrameOrigin(Origin[PictureFrameRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def input_row_kind(self, run: PictureFrameRun) -> RowKind:
        """Kind of the shear law that the shells return."""
        source = run.fabric.macro.shear.source
        return "predicted" if source == "predicted" else "tuned" if source == "tuned" else "input"
