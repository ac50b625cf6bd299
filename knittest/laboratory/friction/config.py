"""Config of the friction test: fields, presets, and the origin of its results."""

from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.files import data_dir
from knittest.base.kinds import Stated
from knittest.config.base import Kernel, number
from knittest.config.loading import rig_default_paths
from knittest.config.rigs import StripRig, check_friction_order
from knittest.config.run import Run
from knittest.experiment.origin import Origin, assumed_friction


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


#: width of a strip of yarns [mm], and normal force over its width [N/mm]: that of the paper, 2000 N on 50 mm
WIDTH, PRESSED = {"quick": 15.0, "standard": 25.0, "paper": 50.0}, 40.0
BEAMS = {"meso": {"elements_per_loop": 22, "elements_per_wave": 6}}


def settings(preset: str, scale: str, stated: Stated) -> dict[str, Any]:
    """Settings of ``preset`` at ``scale``.

    Damping must not hold back what slides, and plates need stiff penalties, so small steps. The beams of yarns, 22 and
    6, are those of the paper's strip; with 30 and 8 the pull force changes by 0.6 %, the compression by 4 %. Speed,
    ramp and ``rig.membrane_share`` against half the speed, a third of the ramp and the full stiffness at 2000 N (quick,
    both variants and directions): kinetic force within 0.15 %, static -0.6 to +1.3 %, compression +0.6 to +4 %, a third
    of the time.
    """
    if scale == "macro":
        return {"model": BEAMS, "solver": {"speed": 1.0, "ramp": 0.5, "damping": 1.0, "safety": 0.55}}
    width = WIDTH[preset]
    given = stated("width")
    force = PRESSED * (given if isinstance(given, int | float) and given > 0.0 else width)
    return {
        "model": BEAMS, "rig": {"width": width, "normal_force": force},
        "solver": {"speed": 4.0, "ramp": 1.5, "damping": 2.0},
    }  # fmt: skip


class FrictionOrigin(Origin[FrictionRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def assumed_inputs(self, run: FrictionRun) -> tuple[str, ...]:
        """Coefficients of the other direction, or of the paper's fabrics."""
        return assumed_friction(run)

    def given_curve_part(self, run: FrictionRun, path: Path) -> str:
        """Coefficients of the fabric's own friction tests, which its file gives to the rig."""
        own, kind = run.fabric.experiment, run.rig.kind
        fields = rig_default_paths(run.fabric.rigs.get(kind, {}), kind, run.rig.direction)
        if own is None or "kinetic_coefficient" not in fields:
            return ""
        of_its_own = path.resolve().is_relative_to((data_dir() / own).resolve())
        return "the run uses its coefficients" if of_its_own else ""
