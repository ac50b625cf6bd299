"""Config of a run: rig, fabric, model, solver, variability and output."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.kinds import Parts, kinds
from knittest.config.base import BoundsError, Kernel, Strict, number
from knittest.config.fabric import Fabric
from knittest.config.rigs import Rig

Scale = Literal["macro", "meso"]
Preset = Literal["quick", "standard", "paper"]

#: longest beam in the wave of an inlay over the height of the inlay, and the most beams per wave
LONGEST_BEAM, MOST_IN_WAVE = 1.3, 16
#: largest length of beams of soft yarns over the diameter of the core, and most beams in a loop. Straight yarns that
#: cross press each other by the closed form within 10 % at 0.55
SOFT_BEAM, MOST_IN_LOOP = 0.7, 256


class MesoModel(Strict):
    """Discretisation of the meso model (beam elements)."""

    elements_per_loop: int = Field(
        30, ge=16, le=MOST_IN_LOOP, multiple_of=2, description="beam elements in one knitting loop"
    )
    elements_per_wave: int = Field(
        8, ge=4, le=64, multiple_of=2, description="beam elements in the longer wave of the inlays; the shorter wave "
        "gets elements of equal length. Default: that of the preset, or more for yarns that are thin for their spacing",
    )  # fmt: skip
    contact: bool = Field(True, description="yarn-yarn contact")
    knitting: bool = Field(True, description="model the knitting yarn (the loops)")


class MacroModel(Strict):
    """Discretisation of the macro model (shell elements)."""

    element_size: float = number(5.0, "mm", "side of a square shell element", gt=0, band=(0.2, 100))
    element_size_mm: ClassVar[Kernel[float]] = Kernel("element_size")
    imperfection: float = number(0.0, "mm", "amplitude of a random out-of-plane imperfection", ge=0, le=5)
    imperfection_mm: ClassVar[Kernel[float]] = Kernel("imperfection")
    self_contact: bool = Field(
        False, description="self-contact of folds at the distance of the thickness, with fabric.macro.self_friction"
    )


class Model(Strict):
    """Scale and its discretisation."""

    scale: Scale = Field("meso", description="macro: shell elements; meso: one chain of beam elements per yarn")
    preset: Preset = Field("standard", description="element counts; paper: those of Table 4")
    meso: MesoModel = Field(default_factory=MesoModel)
    macro: MacroModel = Field(default_factory=MacroModel)


#: beginning of the description of a limit; a run above it is not compared with the experiment
LIMIT = "quality check:"


class Solver(Strict):
    """Explicit time integration and limits of its quality checks."""

    speed: float = number(2.0, "m/s", "speed of the clamp or tool after the ramp", gt=0, band=(1e-3, 50))
    speed_mm_per_ms: ClassVar[Kernel[float]] = Kernel("speed")
    ramp: float = number(0.5, "ms", "duration of the smooth start", ge=0, le=1000)
    ramp_ms: ClassVar[Kernel[float]] = Kernel("ramp")
    safety: float = number(0.9, "1", "time step over critical time step", gt=0, le=0.99)
    damping: float = number(0.5, "1/ms", "mass-proportional damping", ge=0, le=100)
    damping_per_ms: ClassVar[Kernel[float]] = Kernel("damping")
    target_step: float | None = number(None, "us", "mass scaling to this time step", gt=0, band=(1e-3, 1e3))
    target_step_ms: ClassVar[Kernel[float | None]] = Kernel("target_step")
    max_added_mass: float = number(5.0, "%", "largest added mass; more stops the run", ge=0, le=1000)
    max_kinetic_ratio: float = number(5.0, "%", f"{LIMIT} kinetic energy over work; 5 is 5 %", gt=0, le=100)
    max_energy_error: float = number(2.0, "%", f"{LIMIT} energy error; 10 % stops the run", gt=0, le=10)
    max_penetration: float = number(25.0, "%", f"{LIMIT} contact penetration over radius", gt=0, le=100)
    max_overlap: float = number(10.0, "%", f"{LIMIT} initial yarn overlap over radius; 20 % stops the run", gt=0, le=20)
    max_force_free_overlap: float = number(10.0, "%", f"{LIMIT} yarn overlap without force, over radius", gt=0, le=100)
    max_damping: float = number(5.0, "%", f"{LIMIT} damping energy over work", gt=0, le=100)
    max_contact_damping: float = number(
        5.0, "%", f"{LIMIT} damping energy of contacts and free tools, with the energy of contacts detected late, over "
        "work", gt=0, le=100,
    )  # fmt: skip
    max_hourglass: float = number(
        5.0, "%", f"{LIMIT} hourglass energy of shell elements over internal energy", gt=0, le=100
    )
    max_law_extrapolation: float = number(
        5.0,
        "%",
        f"{LIMIT} share of shell elements beyond the end of the shear law or of the biaxial table",
        gt=0,
        le=100,
    )
    max_damping_force: float = number(
        10.0, "%", f"{LIMIT} damping force at full speed over weight and blank-holder force (forming)", gt=0, le=100
    )


class Variability(Strict):
    """Scatter of fracture strain, slack and wave amplitude from yarn to yarn."""

    mode: Literal["uniform", "representative", "random"] = Field(
        "representative",
        description="uniform: mean values; representative: quantiles of the distributions in random order; random: "
        "independent draws",
    )
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of all random draws")
    specimens: int = Field(1, ge=1, le=1000, description="specimens of an ensemble; more than one: random draws")


class Output(Strict):
    """Output of a run."""

    samples: int = Field(400, ge=20, le=100000, description="approximate number of rows of curve.csv and energies.csv")
    frames: int = Field(12, ge=0, le=2000, description="number of VTU frames")
    checkpoint_interval: float = number(
        60.0, "s", "wall-clock time between checkpoints; a signal that stops the run writes one too", gt=0, le=86400
    )
    verify: bool = Field(
        False, description="repeat the run at half its speed and on another mesh, to state the numerical error"
    )


class Run(Strict):
    """Complete description of a virtual test; a subclass narrows the rig."""

    rig: Rig
    fabric: Fabric
    parameters: str = Field("calibrated", description="parameter set of the fabric file")
    accept_limits: bool = Field(
        False, description="accept limits looser than the preset's; only --accept-limits sets it"
    )
    model: Model = Field(default_factory=Model)
    solver: Solver = Field(default_factory=Solver)
    variability: Variability = Field(default_factory=Variability)
    output: Output = Field(default_factory=Output)

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        missing, macro = self.fabric.missing_yarns, self.fabric.macro
        if missing and self.model.scale == "meso":
            remedy = "" if macro.missing_card_parts else ", or use --scale macro"
            raise BoundsError(
                f"the meso scale needs {', '.join(missing)}: add what is missing to the fabric file{remedy}", "fabric"
            )
        if missing and macro.missing_card_parts and self.model.scale == "macro":
            raise BoundsError(
                f"the macro scale needs macro.{', macro.'.join(macro.missing_card_parts)}: add them, or the yarns "
                f"({', '.join(missing)}) from which they are derived",
                "fabric",
            )
        _check_run(self)
        return self

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        _rig_of(cls)

    def with_derived_numbers(self) -> Self:
        """Run with the numbers that its test derives from others; most tests derive none."""
        return self

    def with_fine_waves(self) -> Self:
        """Run whose beams in a wave are no longer than :data:`LONGEST_BEAM` diameters of an inlay.

        Corners of a coarser polygon overlap where inlays cross, by 5.6 % of a radius times the length of a beam over
        the diameter (measured on eight fabrics, 0.4 to 1.2 mm thick).
        """
        if self.model.scale != "meso":
            return self
        fabric, meso = self.fabric, self.model.meso
        thickness = min((one.section_mm[1] for one in fabric.inlays), default=fabric.knitting.beam_diameter_mm)
        pitch = max(fabric.wale_spacing, fabric.course_spacing)
        needed = 2 * round(0.5 * pitch / (LONGEST_BEAM * thickness))
        if needed <= meso.elements_per_wave:
            return self
        meso = meso.model_copy(update={"elements_per_wave": min(needed, MOST_IN_WAVE)})
        return self.model_copy(update={"model": self.model.model_copy(update={"meso": meso})})

    def with_fine_loops(self) -> Self:
        """Run whose beams of soft yarns are at most :data:`SOFT_BEAM` core diameters long."""
        if self.model.scale != "meso" or not self.fabric.has_soft_yarns:
            return self
        fabric, meso = self.fabric, self.model.meso
        needed = 2 * math.ceil(0.5 * fabric.loop_length_mm / (SOFT_BEAM * fabric.knitting.beam_diameter_mm))
        if needed <= meso.elements_per_loop:
            return self
        meso = meso.model_copy(update={"elements_per_loop": min(needed, MOST_IN_LOOP)})
        return self.model_copy(update={"model": self.model.model_copy(update={"meso": meso})})

    #: such values of a macro model whose fabric has a law of two strains: its waves are slow
    soft_sheet: ClassVar[Mapping[tuple[str, str], float]] = {}

    @property
    def pulls_loops(self) -> bool:
        """Tell whether the test pulls a direction without inlays, in which loops carry the force of a meso model."""
        return False

    @property
    def uses_tools(self) -> bool:
        """Tell whether plates or other rigid tools press the specimen."""
        return kinds()[self.rig.kind].tools

    def structure_defaults(self) -> dict[tuple[str, str], float]:
        """Fields of rig and solver with values that suit the structure of the fabric, where the user states none."""
        return dict(self.soft_sheet) if self.model.scale == "macro" and self.fabric.has_biaxial_law else {}

    @property
    def direction(self) -> str:
        """Yarn system along the strip; empty for a test without directions."""
        return getattr(self.rig, "direction", "")


def _check_run(run: Run) -> None:
    """Check the scale of the test, the element size and the imperfection of the specimen."""
    scales = kinds()[run.rig.kind].scales
    if run.model.scale not in scales:
        raise BoundsError(f"expected {' or '.join(scales)}, the scale of test {run.rig.kind}", "model.scale")
    lengths: dict[str, float] = {name: getattr(run.rig, name) for name in run.rig.spans}
    name = min(lengths, key=lengths.__getitem__, default="")
    if run.model.scale == "macro" and name and run.model.macro.element_size > lengths[name]:
        raise BoundsError(f"must be at most rig.{name}, {lengths[name]:g} mm", "model.macro.element_size")
    half = 0.5 * run.fabric.thickness.value
    if getattr(run.rig, "imperfection", 0.0) >= half:
        raise BoundsError(f"must be less than half the fabric thickness, {half:g} mm", "rig.imperfection")


#: model of the runs of each test
RUNS: Mapping[str, type[Run]] = Parts(lambda kind: kind.load("run"))


def rig_model(kind: str) -> type[Rig]:
    """Model of the rig in runs of ``kind``."""
    return _rig_of(RUNS[kind])


def _rig_of(run: type[Run]) -> type[Rig]:
    rig = run.model_fields["rig"].annotation
    if not (isinstance(rig, type) and issubclass(rig, Rig)):
        raise TypeError(f"{run.__name__}.rig: expected a knittest.config.rigs.Rig, found {rig}")
    return rig
