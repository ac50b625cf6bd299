"""Config of the friction test: fields, presets, and the origin of its results."""

from math import sqrt
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.files import data_dir
from knittest.base.kinds import Stated
from knittest.config.base import Kernel, number
from knittest.config.fabric import Fabric
from knittest.config.loading import rig_default_paths
from knittest.config.rigs import StripRig, check_friction_order
from knittest.config.run import Run
from knittest.experiment.origin import DEFAULT_FRICTION_OF, Origin, assumed_friction


class FrictionRig(StripRig):
    """Friction: a strip is pulled out between two plates pressed together."""

    spans = ("width", "length")

    kind: Literal["friction"] = "friction"
    length: float = number(200.0, "mm", "length of the strip; without inlays along it: 60", gt=0, band=(10, 2000))
    length_mm: ClassVar[Kernel[float]] = Kernel("length")
    plate_length: float = number(
        150.0, "mm", "length of the plates; without inlays along the pull: 40", gt=0, band=(5, 1000)
    )
    plate_length_mm: ClassVar[Kernel[float]] = Kernel("plate_length")
    plate_width: float = number(50.0, "mm", "width of the plates, at least that of the strip", gt=0, band=(5, 1000))
    plate_width_mm: ClassVar[Kernel[float]] = Kernel("plate_width")
    normal_force: float = number(
        2000.0, "N", "force that presses the plates together; meso, and without inlays along the pull: derived, "
        "what the loops bear, at most 40 N per mm of width", gt=0, band=(0.1, 1e5),
    )  # fmt: skip
    normal_force_n: ClassVar[Kernel[float]] = Kernel("normal_force")
    travel: float = number(10.0, "mm", "pull of the clamp; without inlays along it: 20", gt=0, band=(0.5, 100))
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

    @property
    def pulls_loops(self) -> bool:
        """See :class:`Run`."""
        return self.fabric.is_carried_by_loops(self.rig.direction, self.model.scale)

    def structure_defaults(self) -> dict[tuple[str, str], float]:
        """Normal force that the loops bear; a short strip and a long slow pull where loops carry it."""
        found = dict(KNIT) if self.pulls_loops else super().structure_defaults()
        if self.model.scale == "macro" and not self.pulls_loops:
            return found
        rig, stated = self.rig, self.rig.model_fields_set
        plate = rig.plate_length if "plate_length" in stated else found.get(("rig", "plate_length"), rig.plate_length)
        force = rig.normal_force if "normal_force" in stated else self.borne_force_per_width(plate) * rig.width
        found["rig", "normal_force"] = force
        if not self.pulls_loops:  # loops that snap lose energy to damping at any speed, so that it falls further
            slower, solver = self.slowness(self.fabric.thickness_mm, force), self.solver
            found["solver", "speed"] = solver.speed / slower
            found["solver", "ramp"] = solver.ramp * slower
            found["solver", "damping"] = solver.damping / slower**2
        return found

    def slowness(self, thickness: float, normal_force: float) -> float:
        """Factor, at least 1, on the times of the test: a plate falls for long through a thick fabric of little force.

        ``thickness`` [mm], ``normal_force`` [N].
        """
        mass = self.fabric.area_mass_g_per_mm2 * self.rig.length_mm * self.rig.width_mm
        return max(sqrt(2.0 * mass * thickness / normal_force) / FALL, 1.0)

    def borne_force_per_width(self, plate_length: float) -> float:
        """Default normal force over width [N/mm] on plates of ``plate_length`` [mm]: the paper's pressure, or less.

        It is less where the pressure would flatten the loops, or where the friction of both faces would stretch loops
        that carry the pull.
        """
        covered, bent = plate_length / PLATES, loop_bending_force(self.fabric)
        if bent is None or is_tested_in_the_paper(self.fabric):
            return FORCE_PER_WIDTH * covered
        borne = (
            min(FORCE_PER_WIDTH, BORNE * bent / (self.fabric.wale_spacing * self.fabric.course_spacing) * PLATES)
            * covered
        )
        if not self.pulls_loops or self.rig.kinetic_coefficient == 0.0:
            return borne
        tension = PULLED * bent * self.fabric.density_per_mm.of(self.rig.direction)
        return min(borne, tension / (2.0 * self.rig.kinetic_coefficient))


#: width of a strip of yarns [mm]
WIDTH = {"quick": 15.0, "standard": 25.0, "paper": 50.0}
#: normal force over the width of the strip [N/mm] and length of the plates [mm] in the paper, 2000 N on 50 mm
FORCE_PER_WIDTH, PLATES = 40.0, 150.0
#: largest default pressure in forces that bend a loop, on the area of a stitch: at 8 loops snap and the plate bounces.
#: Largest friction of both faces that loops carry, in such forces a wale or course: narrow strips unravel at 1.7
BORNE, PULLED = 4.0, 0.5
#: time [ms] in which the plate falls through a fabric for which the times of the test are made
FALL = 0.2
#: sizes of a strip whose loops carry the pull, its speed [m/s] and damping [1/ms]
KNIT = {
    ("rig", "length"): 60.0, ("rig", "plate_length"): 40.0, ("rig", "travel"): 20.0, ("solver", "speed"): 0.08,
    ("solver", "damping"): 0.02,
}  # fmt: skip
BEAMS = {"meso": {"elements_per_loop": 22, "elements_per_wave": 6}}


def is_tested_in_the_paper(fabric: Fabric) -> bool:
    """Tell whether the default coefficients and the force of the paper were measured on ``fabric``."""
    return (fabric.experiment or "").rpartition("/")[2] == DEFAULT_FRICTION_OF


def loop_bending_force(fabric: Fabric) -> float | None:
    """Force [N] that bends a loop: 12 EI / s^2, with s a quarter of its length; None for a fabric without loops.

    It shifts the ends of a beam of the length s, which do not turn, by s if the beam were linear.
    """
    if fabric.knitting is None or fabric.loop_length is None:
        return None
    return 12.0 * fabric.knitting.bending_stiffness_n_mm2 / (0.25 * fabric.loop_length_mm) ** 2


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
    return {
        "model": BEAMS, "rig": {"width": WIDTH[preset]}, "solver": {"speed": 4.0, "ramp": 1.5, "damping": 2.0},
    }  # fmt: skip


def size_texts(run: FrictionRun) -> tuple[str, ...]:
    """Sizes of strip and plates and the normal force, in words: derived where it is less than that of the paper."""
    rig, force = run.rig, run.borne_force_per_width(run.rig.plate_length) * run.rig.width
    paper = FORCE_PER_WIDTH * rig.plate_length / PLATES * rig.width
    derived = " (derived: what the loops bear)" if rig.normal_force == force < paper else ""
    return (
        f"strip {rig.length:g} x {rig.width:g} mm", f"plates {rig.plate_length:g} x {rig.plate_width:g} mm",
        f"pressed by {rig.normal_force:.4g} N{derived}" if derived else f"pressed by {rig.normal_force:g} N",
    )  # fmt: skip


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
