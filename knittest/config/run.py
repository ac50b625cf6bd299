"""A run: rig, model, solver, variability and output. The fully resolved config of a run folder is one of these."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from knittest.base.kinds import Parts, kinds
from knittest.config.base import BoundsError, Kernel, Strict, number
from knittest.config.fabric import YARN_LEVEL, Fabric
from knittest.config.rigs import Rig

Scale = Literal["macro", "meso"]
Preset = Literal["quick", "standard", "paper"]

#: longest beam in the wave of an inlay, over the inlay's height, and the most beams of a wave for it
LONGEST_BEAM, MOST_IN_WAVE = 1.3, 16


class MesoModel(Strict):
    """Discretisation of the yarns."""

    elements_per_loop: int = Field(30, ge=16, le=256, multiple_of=2, description="beams in one knitting loop")
    elements_per_wave: int = Field(
        8,
        ge=4,
        le=64,
        multiple_of=2,
        description="beams in the longer wave of the reinforcing yarns; the shorter one gets beams of the same length; "
        "where it is not stated that of the preset, or more for yarns thin beside their spacing",
    )
    contact: bool = Field(True, description="yarn-yarn contact")
    knitting: bool = Field(True, description="model the knitting yarn")


class MacroModel(Strict):
    """Discretisation of the shell model."""

    element_size: float = number(5.0, "mm", "side of a square shell", gt=0, band=(0.2, 100))
    element_size_mm: ClassVar[Kernel[float]] = Kernel("element_size")
    imperfection: float = number(0.0, "mm", "seeded out-of-plane imperfection amplitude", ge=0, le=5)
    imperfection_mm: ClassVar[Kernel[float]] = Kernel("imperfection")
    self_contact: bool = Field(
        False, description="the sheet touches itself where it folds, a thickness apart, with fabric.macro.self_friction"
    )


class Model(Strict):
    """Scale and its discretisation."""

    scale: Scale = Field("meso", description="macro: shells; meso: one beam chain a yarn")
    preset: Preset = Field("standard", description="element counts; paper is Table 4's")
    meso: MesoModel = Field(default_factory=MesoModel)
    macro: MacroModel = Field(default_factory=MacroModel)


class Solver(Strict):
    """Explicit time integration and its guards."""

    speed: float = number(2.0, "m/s", "clamp speed after the ramp", gt=0, band=(1e-3, 50))
    speed_mm_per_ms: ClassVar[Kernel[float]] = Kernel("speed")
    ramp: float = number(0.5, "ms", "smooth start of the motion", ge=0, le=1000)
    ramp_ms: ClassVar[Kernel[float]] = Kernel("ramp")
    safety: float = number(0.9, "1", "share of the critical time step", gt=0, le=0.99)
    damping: float = number(0.5, "1/ms", "mass-proportional damping", ge=0, le=100)
    damping_per_ms: ClassVar[Kernel[float]] = Kernel("damping")
    target_step: float | None = number(
        None, "us", "raise masses to reach this time step (mass scaling)", gt=0, band=(1e-3, 1e3)
    )
    target_step_ms: ClassVar[Kernel[float | None]] = Kernel("target_step")
    max_added_mass: float = number(5.0, "%", "refuse more added mass than this", ge=0, le=1000)
    max_kinetic_ratio: float = number(
        5.0, "%", "kinetic energy over work [%] above which comparison is refused: 5 is 5 %, not a share", gt=0, le=100
    )
    max_energy_error: float = number(2.0, "%", "energy error above which comparison is refused; 10 stops", gt=0, le=10)
    max_penetration: float = number(
        25.0, "%", "penetration over radius above which comparison is refused", gt=0, le=100
    )
    max_overlap: float = number(
        10.0, "%", "overlap of yarns at the start over radius above which comparison is refused; 20 stops", gt=0, le=20
    )
    max_force_free: float = number(
        10.0,
        "%",
        "overlap of yarns that carries no force, over radius, above which comparison is refused",
        gt=0,
        le=100,
    )
    max_damping: float = number(5.0, "%", "damping over work above which comparison is refused", gt=0, le=100)
    max_contact_damping: float = number(
        5.0,
        "%",
        "damping of contacts and free tools, and energy given to contacts found late, over work above which comparison "
        "is refused",
        gt=0,
        le=100,
    )
    max_hourglass: float = number(
        5.0, "%", "hourglass energy of shells over internal energy above which comparison is refused", gt=0, le=100
    )
    max_beyond_law: float = number(
        5.0,
        "%",
        "share of the shells sheared beyond the end of the law above which comparison is refused",
        gt=0,
        le=100,
    )
    max_drag: float = number(
        10.0,
        "%",
        "forming: drag of damping at full speed, over weight and holder's force, above which comparison is refused",
        gt=0,
        le=100,
    )


class Variability(Strict):
    """Yarn-to-yarn scatter of fracture strain, slack and wave amplitude."""

    mode: Literal["uniform", "representative", "random"] = Field(
        "representative",
        description="uniform: every yarn the mean; representative: the quantiles of the distributions in seeded order; "
        "random: independent draws",
    )
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of all draws")
    specimens: int = Field(1, ge=1, le=1000, description="specimens of an ensemble (more than one: random draws)")


class Output(Strict):
    """Output that a run keeps."""

    samples: int = Field(400, ge=20, le=100000, description="rows of curve.csv and energies.csv, about")
    frames: int = Field(12, ge=0, le=2000, description="VTU frames over the run")
    checkpoint_interval: float = number(
        60.0, "s", "time between checkpoints, by the clock on the wall; a signal writes one too", gt=0, le=86400
    )
    verify: bool = Field(
        False, description="repeat the run at half its speed and on another mesh: results carry their numerical error"
    )


class Run(Strict):
    """One virtual test, fully described; a subclass narrows the rig."""

    rig: Rig
    fabric: Fabric
    parameters: str = Field("calibrated", description="parameter set of the fabric file that was applied")
    accept_limits: bool = Field(
        False, description="limits looser than the preset's were accepted, by --accept-limits; nothing else sets it"
    )
    model: Model = Field(default_factory=Model)
    solver: Solver = Field(default_factory=Solver)
    variability: Variability = Field(default_factory=Variability)
    output: Output = Field(default_factory=Output)

    @model_validator(mode="after")
    def _yarns_are_described(self) -> Self:
        missing = [name for name in YARN_LEVEL if getattr(self.fabric, name) is None]
        if missing and self.model.scale == "meso":
            shells = "" if self.fabric.macro.missing else ", or use --scale macro"
            needed = ", ".join(missing)
            raise BoundsError(f"the meso scale needs {needed}: expected in the fabric file{shells}", "fabric")
        if missing and (unknown := self.fabric.macro.missing) and self.model.scale == "macro":
            raise BoundsError(
                f"the macro scale needs macro.{', macro.'.join(unknown)}: give them, or the yarns "
                f"({', '.join(missing)}) from which they are derived",
                "fabric",
            )
        return self

    @model_validator(mode="after")
    def _specimen_is_possible(self) -> Self:
        _check_run(self)
        return self

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        _rig_of(cls)

    def with_derived_numbers(self) -> Self:
        """The run with the numbers that its test derives from others; most tests derive none."""
        return self

    def with_fine_waves(self) -> Self:
        """The run with as many beams in a wave that none is longer than :data:`LONGEST_BEAM` diameters of an inlay.

        Corners of a coarser polygon overlap where inlays cross, by 5.6 % of a radius times the length of a beam over
        the diameter (measured on eight fabrics, 0.4 to 1.2 mm thick).
        """
        if self.model.scale != "meso":
            return self
        fabric, meso = self.fabric, self.model.meso
        thickness = min(fabric.reinforcing.section_mm(way)[1] for way in ("warp", "weft"))
        pitch = max(fabric.wale_spacing, fabric.course_spacing)
        needed = 2 * round(0.5 * pitch / (LONGEST_BEAM * thickness))
        if needed <= meso.elements_per_wave:
            return self
        meso = meso.model_copy(update={"elements_per_wave": min(needed, MOST_IN_WAVE)})
        return self.model_copy(update={"model": self.model.model_copy(update={"meso": meso})})

    @property
    def direction(self) -> str:
        """Yarn system along the strip; empty for a test that has none."""
        return getattr(self.rig, "direction", "")


def _check_run(run: Run) -> None:
    """The test is one of its scale, the specimen larger than its elements, the fabric thicker than its unevenness."""
    scales = kinds()[run.rig.kind].scales
    if run.model.scale not in scales:
        what = "shells have nothing that it could find" if run.model.scale == "macro" else "yarns have none"
        raise BoundsError(f"{run.rig.kind} is a test of --scale {' or '.join(scales)} only: {what}", "model.scale")
    if run.model.scale == "macro":
        _check_element(run)
    uneven = getattr(run.rig, "imperfection", 0.0)
    if uneven >= 0.5 * run.fabric.thickness.value:
        half = 0.5 * run.fabric.thickness.value
        raise BoundsError(f"must be less than half the fabric's thickness, {half:g} mm", "rig.imperfection")


def _check_element(run: Run) -> None:
    """A shell is no larger than its specimen."""
    lengths: dict[str, float] = {name: getattr(run.rig, name) for name in run.rig.spans}
    name = min(lengths, key=lengths.__getitem__, default="")
    if name and run.model.macro.element_size > lengths[name]:
        raise BoundsError(f"must be at most rig.{name}, {lengths[name]:g} mm", "model.macro.element_size")


#: the run model of every kind of test
RUNS: Mapping[str, type[Run]] = Parts(lambda kind: kind.load("run"))


def rig_model(kind: str) -> type[Rig]:
    """Return the model of the rig in runs of ``kind``."""
    return _rig_of(RUNS[kind])


def _rig_of(run: type[Run]) -> type[Rig]:
    rig = run.model_fields["rig"].annotation
    if not (isinstance(rig, type) and issubclass(rig, Rig)):
        raise TypeError(f"{run.__name__}.rig: expected a knittest.config.rigs.Rig, found {rig}")
    return rig
