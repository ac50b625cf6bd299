"""Config of the friction test."""

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import number
from knittest.config.kernel_units import Kernel
from knittest.config.rigs import StripRig, check_friction_order
from knittest.config.run import Run


class FrictionRig(StripRig):
    """Friction: a strip is pulled out between two plates pressed together."""

    spans = ("width", "length")

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
    membrane_share: float = number(
        0.25, "1", "meso: share of the yarns' axial stiffness that is kept: they are far from their strength, and the "
        "step grows", gt=0, le=1,
    )  # fmt: skip

    @model_validator(mode="after")
    def _sticks_more_than_it_slips(self) -> Self:
        check_friction_order(self.static_coefficient, self.kinetic_coefficient)
        return self


class FrictionRun(Run):
    """A friction test."""

    rig: FrictionRig = Field(default_factory=FrictionRig)
