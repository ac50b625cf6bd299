"""The tests of the laboratory: one model a rig, with the dimensions of the paper as defaults."""

from itertools import pairwise
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, Strict, number
from knittest.config.fabric import Direction
from knittest.config.kernel_units import Kernel
from knittest.config.tools import Die, Holder, Stamp, check_blank, check_fit


class StripRig(Strict):
    """A test on a strip cut along one yarn system."""

    direction: Direction = Field("warp", description="yarn system along the strip")
    width: float = number(50.0, "mm", "width of the strip", gt=0, band=(5, 1000))
    width_mm: ClassVar[Kernel[float]] = Kernel("width")
    yarn_rounding: Literal["down", "up"] = Field(
        "down", description="whole yarns when width times density is fractional; ensembles alternate"
    )


class TensileRig(StripRig):
    """Strip tensile test after DIN EN ISO 13934-1: one clamp fixed, one pulled to failure."""

    kind: Literal["tensile"] = "tensile"
    gauge_length: float = number(200.0, "mm", "distance of the clamps", gt=0, band=(5, 2000))
    gauge_length_mm: ClassVar[Kernel[float]] = Kernel("gauge_length")
    jaw_length: float = number(10.0, "mm", "length modelled inside each clamp (meso: always one pitch)", gt=0, le=200)
    jaw_length_mm: ClassVar[Kernel[float]] = Kernel("jaw_length")
    max_strain: float = number(4.0, "%", "stop at this engineering strain", gt=0, le=100)
    max_strain_fraction: ClassVar[Kernel[float]] = Kernel("max_strain")
    stop_force_ratio: float = number(0.2, "1", "stop when the force has fallen to this share of its peak", ge=0, le=1)


class PictureFrameRig(Strict):
    """Picture frame: a square of fabric on needles along four hinged sides, sheared by the crosshead."""

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
    mounting_slack: float = number(
        0.05, "%", "slack with which the yarns hang on the needles (assumed); taut yarns cannot wrinkle", ge=0, le=5
    )
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
        ways = [b - a for a, b in pairwise([0.0, *self.turns, self.max_angle])]
        if any(way == 0.0 or (way > 0.0) != (k % 2 == 0) for k, way in enumerate(ways)):
            raise BoundsError("must go up and down in turn, and up to max_angle at the end", "turns")
        if not all(0.0 <= angle <= self.max_angle for angle in self.turns):
            raise BoundsError(f"must lie between 0 and max_angle, {self.max_angle:g} deg", "turns")
        return self


class CantileverRig(StripRig):
    """Cantilever after DIN 53362: a strip bends over an edge under its own weight."""

    kind: Literal["cantilever"] = "cantilever"
    mode: Literal["angle", "overhang"] = Field(
        "angle",
        description="angle: the overhang is given, the chord angle comes out (the paper's simulation); "
        "overhang: the strip is advanced until its chord has the angle of the plane (the laboratory)",
    )
    overhang: float | None = number(
        None, "mm", "overhang; none: the mean measured one of the fabric's experiment", gt=0, band=(5, 1000)
    )
    overhang_mm: ClassVar[Kernel[float | None]] = Kernel("overhang")
    plane_angle: float = number(41.5, "deg", "angle of the plane", gt=0, le=80)
    length: float = number(300.0, "mm", "length of the strip", gt=0, band=(10, 2000))
    length_mm: ClassVar[Kernel[float]] = Kernel("length")
    gravity: float = number(9.81, "m/s2", "gravity", gt=0, band=(0.1, 100))
    gravity_mm_per_ms2: ClassVar[Kernel[float]] = Kernel("gravity")
    membrane_share: float = number(
        0.01, "1", "share of the membrane stiffness that is kept: bending decides, and the step grows", gt=0, le=1
    )
    tolerance: float = number(
        1e-4, "1", "residual force over weight, and drift over deflection, of shells at rest", gt=0, le=0.1
    )

    @model_validator(mode="after")
    def _strip_reaches_out(self) -> Self:
        if self.overhang is not None and self.overhang >= self.length:
            raise BoundsError(f"longer than the strip, expected less than rig.length = {self.length:g} mm", "overhang")
        return self


class FrictionRig(StripRig):
    """Friction: a strip is pulled out between two plates pressed together."""

    kind: Literal["friction"] = "friction"
    length: float = number(200.0, "mm", "length of the strip", gt=0, band=(10, 2000))
    length_mm: ClassVar[Kernel[float]] = Kernel("length")
    plate_length: float = number(150.0, "mm", "length of the plates", gt=0, band=(5, 1000))
    plate_length_mm: ClassVar[Kernel[float]] = Kernel("plate_length")
    plate_width: float = number(50.0, "mm", "width of the plates, at least that of the strip", gt=0, band=(5, 1000))
    plate_width_mm: ClassVar[Kernel[float]] = Kernel("plate_width")
    normal_force: float = number(2000.0, "N", "force that presses the plates together", gt=0, band=(0.1, 1e5))
    normal_force_n: ClassVar[Kernel[float]] = Kernel("normal_force")
    travel: float = number(10.0, "mm", "pull of the clamp", gt=0, band=(0.5, 100))
    travel_mm: ClassVar[Kernel[float]] = Kernel("travel")
    static_coefficient: float = number(
        0.075, "1", "Coulomb coefficient of each face before it slips; the paper's F_R/F_N = 0.15 is that of two faces",
        ge=0, le=2,
    )  # fmt: skip
    kinetic_coefficient: float = number(0.075, "1", "Coulomb coefficient of each face while it slips", ge=0, le=2)
    pressure_cell: float | None = number(
        None, "mm", "side of a cell of the pressure map; none: a shell, or a third of the wale spacing",
        gt=0, band=(0.1, 100),
    )  # fmt: skip
    pressure_cell_mm: ClassVar[Kernel[float | None]] = Kernel("pressure_cell")

    @model_validator(mode="after")
    def _sticks_more_than_it_slips(self) -> Self:
        _check_friction_order(self.static_coefficient, self.kinetic_coefficient)
        return self


class FormingRig(Strict):
    """Forming: a stamp draws a blank into a die, warp along y, with or without a blank holder."""

    kind: Literal["forming"] = "forming"
    blank_length: float = number(330.0, "mm", "blank along the warp, y", gt=0, band=(20, 2000))
    blank_length_mm: ClassVar[Kernel[float]] = Kernel("blank_length")
    blank_width: float = number(330.0, "mm", "blank along the weft, x", gt=0, band=(20, 2000))
    blank_width_mm: ClassVar[Kernel[float]] = Kernel("blank_width")
    depth: float = number(40.0, "mm", "travel of the stamp from the face of the blank", gt=0, band=(1, 500))
    depth_mm: ClassVar[Kernel[float]] = Kernel("depth")
    stamp: Stamp = Field(default_factory=Stamp, description="the stamp")
    die: Die = Field(default_factory=Die, description="the die")
    holder: Holder = Field(default_factory=Holder, description="the blank holder, if there is a force on it")
    blank_holder_force: float = number(0.0, "N", "force on the blank holder; 0: no holder", ge=0, le=1e5)
    blank_holder_force_n: ClassVar[Kernel[float]] = Kernel("blank_holder_force")
    static_coefficient: float = number(
        0.075, "1", "Coulomb coefficient between fabric and tools before it slips: one face of the friction test",
        ge=0, le=2,
    )  # fmt: skip
    kinetic_coefficient: float = number(0.075, "1", "Coulomb coefficient while it slips", ge=0, le=2)
    gravity: float = number(9.81, "m/s2", "gravity", ge=0, le=100)
    gravity_mm_per_ms2: ClassVar[Kernel[float]] = Kernel("gravity")
    imperfection: float = number(0.05, "mm", "amplitude of the seeded unevenness from which wrinkles start", ge=0, le=5)
    imperfection_mm: ClassVar[Kernel[float]] = Kernel("imperfection")
    membrane_share: float = number(
        0.05, "1", "share of the membrane or axial stiffness that is kept: yarns are far from their strength, and the "
        "step grows", gt=0, le=1,
    )  # fmt: skip
    risk_share: float = number(
        0.5, "1", "share of its strength at which a yarn counts as at risk of damage", gt=0, le=1
    )

    @model_validator(mode="after")
    def _sticks_more_than_it_slips(self) -> Self:
        _check_friction_order(self.static_coefficient, self.kinetic_coefficient)
        return self

    @model_validator(mode="after")
    def _tools_fit(self) -> Self:
        check_blank(self.stamp, self.blank_width, self.blank_length)
        check_fit(self.stamp, self.die, self.holder if self.blank_holder_force > 0.0 else None, self.depth_mm)
        return self


Rig = TensileRig | PictureFrameRig | CantileverRig | FrictionRig | FormingRig


def _check_friction_order(static: float, kinetic: float) -> None:
    """Raise :class:`BoundsError` where static friction is below kinetic friction."""
    if static < kinetic:
        raise BoundsError(
            f"{static:g} is less than kinetic_coefficient, {kinetic:g}: set both, here --set "
            f"rig.static_coefficient={kinetic:g} or more",
            "static_coefficient",
        )
