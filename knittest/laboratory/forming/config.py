"""Config of the forming test."""

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import number
from knittest.config.derived_bending import with_in_plane_bending, without_in_plane_bending
from knittest.config.kernel_units import Kernel
from knittest.config.rigs import Rig, check_friction_order
from knittest.config.run import Run
from knittest.config.tools import Die, Holder, Stamp, check_blank, check_fit


class FormingRig(Rig):
    """Forming: a stamp draws a blank into a die, warp along y, with or without a blank holder."""

    spans = ("blank_length", "blank_width")

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
    in_plane_bending: bool = Field(
        True, description="macro scale: inlays bend in the plane of the shells, as fabric.macro.in_plane_bending "
        "states, or else as EI of an inlay x inlays per width; false: they do not, and forces fall with the mesh",
    )  # fmt: skip
    risk_share: float = number(
        0.5, "1", "share of its strength at which a yarn counts as at risk of damage", gt=0, le=1
    )

    @model_validator(mode="after")
    def _sticks_more_than_it_slips(self) -> Self:
        check_friction_order(self.static_coefficient, self.kinetic_coefficient)
        return self

    @model_validator(mode="after")
    def _tools_fit(self) -> Self:
        check_blank(self.stamp, self.blank_width, self.blank_length)
        check_fit(self.stamp, self.die, self.holder if self.blank_holder_force > 0.0 else None, self.depth_mm)
        return self


class FormingRun(Run):
    """A forming test."""

    rig: FormingRig = Field(default_factory=FormingRig)

    def with_derived_numbers(self) -> Self:
        """The run with the bending of its inlays in the plane of the shells, or without if ``rig`` turns it off."""
        if self.model.scale != "macro":
            return self
        settle = with_in_plane_bending if self.rig.in_plane_bending else without_in_plane_bending
        return self.model_copy(update={"fabric": settle(self.fabric)})
