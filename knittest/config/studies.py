"""Config files of studies: sweeps, calibrations and uncertainty studies."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from knittest.base.kinds import DEFAULT, kinds
from knittest.config.base import BoundsError, Strict, TestName, number
from knittest.config.fabric import Direction
from knittest.config.messages import parse_as
from knittest.config.run import Preset, Scale
from knittest.config.yaml_loader import Document


def _to_names(value: object) -> list[str]:
    names = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str | int) and not isinstance(name, bool) for name in names):
        raise ValueError("expected a name or a list of names")
    return [str(name) for name in names]


#: one name or a list of names; a number is a name too
Names = Annotated[list[str], BeforeValidator(_to_names)]


#: descriptions of fields that several studies have
_SET = "fixed values of any field of a run, as for --set"
_CONFIG = "rig file, relative to the folder of this file"
_PRESET = "quick, standard or paper"


class SweepBase(Strict):
    """Settings that all runs share; a list makes one run per entry."""

    test: Names = Field(default_factory=lambda: [DEFAULT], min_length=1, description=", ".join(kinds()))
    variant: Names = Field(default_factory=list, description="shipped fabrics: 1, 2, or names of configs/NAME.yaml")
    fabric: Names = Field(default_factory=list, description="fabric files, relative to the folder of the sweep")
    config: str | None = Field(None, description="rig file or whole run, relative to the folder of the sweep")
    scale: Names = Field(default_factory=list, description="macro, meso")
    direction: Names = Field(default_factory=list, description="warp, weft or both (default)")
    preset: Names = Field(default_factory=list, description=_PRESET)
    parameters: Names = Field(default_factory=list, description="parameter sets of the fabric")
    set: dict[str, Any] = Field(default_factory=dict, description=_SET)


class Range(Strict):
    """Evenly spaced values from ``low`` to ``high``."""

    low: float = Field(description="first value")
    high: float = Field(description="last value")
    steps: int = Field(ge=2, description="number of values")
    spacing: Literal["linear", "log"] = Field("linear", description="equal steps or equal ratios")

    @model_validator(mode="after")
    def _is_rising(self) -> Self:
        check_order(self.low, self.high, self.spacing == "log")
        return self


class Distribution(Strict):
    """Distribution of a field; ``low`` and ``high`` truncate a normal distribution."""

    kind: Literal["uniform", "log-uniform", "normal"] = Field("uniform", description="distribution")
    low: float | None = Field(None, description="smallest value")
    high: float | None = Field(None, description="largest value")
    mean: float | None = Field(None, description="normal: mean before truncation")
    sd: float | None = Field(None, gt=0, description="normal: standard deviation before truncation")
    whole: bool = Field(False, description="round to whole numbers")

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        wanted = ("mean", "sd") if self.kind == "normal" else ("low", "high")
        for name in wanted:
            if getattr(self, name) is None:
                raise BoundsError(f"missing: a {self.kind} distribution needs {' and '.join(wanted)}", name)
        for name in ("mean", "sd"):
            if self.kind != "normal" and getattr(self, name) is not None:
                raise BoundsError(f"a {self.kind} distribution has no {name}: leave it out, or set kind: normal", name)
        if self.low is not None and self.high is not None:
            check_order(self.low, self.high, self.kind == "log-uniform")
        return self


class Sample(Strict):
    """Random points of several fields."""

    method: Literal["random", "latin-hypercube"] = Field("latin-hypercube", description="sampling method")
    n: int = Field(ge=1, description="number of points")
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of the random draws")
    fields: dict[str, Distribution] = Field(min_length=1, description="distribution by field of a run")


class Ensemble(Strict):
    """Scatter from specimen to specimen."""

    specimens: int | None = Field(None, ge=1, le=1000, description="specimens in one run, with mean and sd as results")
    seeds: list[Annotated[int, Field(ge=0, le=2**32 - 1)]] = Field(default_factory=list, description="one run per seed")


class Sweep(Strict):
    """Parameter sweep; all blocks multiply: every point of one with every point of the others."""

    base: SweepBase = Field(description="settings that all runs share")
    grid: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(
        default_factory=dict, description="list of values by field of a run"
    )
    range: dict[str, Range] = Field(default_factory=dict, description="evenly spaced values by field of a run")
    points: list[dict[str, Any]] = Field(default_factory=list, description="single points: value by field of a run")
    sample: Sample | None = Field(None, description="random or Latin-hypercube points")
    ensemble: Ensemble = Field(default_factory=Ensemble, description="specimens and seeds")
    time_limit: float = number(7200.0, "s", "wall-clock limit of a run, which is stopped there", gt=0, le=1e7)
    keep: Literal["tables", "pictures", "frames"] = Field(
        "tables", description="files of each run; pictures: tables, pictures and page; frames: also VTU frames"
    )


def parse_sweep(document: Document) -> Sweep:
    """Read the sweep in ``document``; raises :class:`InputError` with all findings."""
    return parse_as(Sweep, document)


def check_order(low: float, high: float, positive: bool) -> None:
    """Raise :class:`BoundsError` unless ``low`` is below ``high`` and, if ``positive``, above 0."""
    if positive and low <= 0.0:
        raise BoundsError("must be greater than 0 for a logarithmic spacing", "low")
    if high <= low:
        raise BoundsError(f"must be greater than low = {low:g}", "high")


def _to_text(value: object) -> Any:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class FabricChoice(Strict):
    """Fabric: a shipped one or a file."""

    variant: Annotated[str | None, BeforeValidator(_to_text)] = Field(
        None, description="shipped fabric: 1, 2, or a name of configs/NAME.yaml"
    )
    fabric: str | None = Field(None, description="fabric file, relative to the folder of this file")


Method = Literal["auto", "root", "least-squares", "differential-evolution", "optuna"]


class CalibrationBase(FabricChoice):
    """Fabric that is calibrated, and settings that all tests share."""

    parameters: str | None = Field(None, description="parameter set of the fabric")
    scale: Scale | None = Field(None, description="macro or meso")
    preset: Preset | None = Field(None, description=_PRESET)
    set: dict[str, Any] = Field(default_factory=dict, description=_SET)


class Parameter(Strict):
    """Number to fit between ``low`` and ``high``, in the unit of its field."""

    low: float = Field(description="lower bound")
    high: float = Field(description="upper bound")
    spacing: Literal["linear", "log"] = Field("linear", description="log: equal ratios, as for a stiffness")
    start: float | None = Field(
        None, description="first value; none: mean, else the value of the fabric, else the middle"
    )
    mean: float | None = Field(None, description="prior mean: knowledge from other sources than the targets")
    sd: float | None = Field(None, gt=0, description="prior standard deviation")
    also: list[str] = Field(default_factory=list, description="other fields with the same value")

    @model_validator(mode="after")
    def _is_ordered(self) -> Self:
        check_order(self.low, self.high, self.spacing == "log")
        for name in ("start", "mean"):
            value = getattr(self, name)
            if value is not None and not self.low <= value <= self.high:
                raise BoundsError(f"must be between low = {self.low:g} and high = {self.high:g}", name)
        if (self.mean is None) != (self.sd is None):
            raise BoundsError("missing: a prior needs mean and sd", "mean" if self.mean is None else "sd")
        return self


class Test(Strict):
    """Test to run at every point; missing settings are those of ``base``."""

    test: TestName = Field(description="kind of test")
    direction: Direction | None = Field(None, description="warp or weft")
    config: str | None = Field(None, description=_CONFIG)
    scale: Scale | None = Field(None, description="macro or meso")
    preset: Preset | None = Field(None, description=_PRESET)
    set: dict[str, Any] = Field(default_factory=dict, description=_SET)


class Target(Strict):
    """Target of a test: a result in the experiment of the fabric, a value with sd, or a curve."""

    test: str = Field(description="name of a test of this file")
    quantity: str | None = Field(
        None, description="result of the test, such as overhang_mm; measured mean and sd are in the experiment"
    )
    value: float | None = Field(None, description="instead of the measured mean")
    sd: float | None = Field(None, gt=0, description="instead of the measured sd")
    curve: str | None = Field(
        None, description="CSV of a curve, relative to the folder of this file or the shipped data"
    )
    weight: float = Field(1.0, gt=0, le=1e6, description="weight of the squared deviation in sd")

    @model_validator(mode="after")
    def _has_one_target(self) -> Self:
        if (self.quantity is None) == (self.curve is None):
            raise BoundsError("expected either quantity (a result) or curve (a CSV)", "quantity")
        if self.value is not None and (self.curve is not None or self.sd is None):
            raise BoundsError("needs quantity and sd", "value")
        return self


class Calibration(Strict):
    """Calibration file."""

    base: CalibrationBase = Field(description="fabric, and settings that all tests share")
    parameters: dict[str, Parameter] = Field(min_length=1, max_length=12, description="bounds by field of a run")
    tests: dict[str, Test] = Field(min_length=1, description="tests to run at every point, by name")
    targets: list[Target] = Field(min_length=1, description="targets of the results")
    method: Method = Field(
        "auto", description="auto: root for one parameter and one number without prior, else least-squares"
    )
    tolerance: float = number(0.02, "1", "largest deviation from a target, as a share of its sd", gt=0, le=1)
    noise: float = number(
        0.05, "1", "smallest effect of a parameter over its bounds, in sd of a target; below, it has no influence",
        gt=0, le=1,
    )  # fmt: skip
    step: float = number(0.05, "1", "finite difference, as a share of the bounds", gt=0, le=0.5)
    max_runs: int = Field(60, ge=2, le=100_000, description="largest number of runs")
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of differential-evolution and optuna")
    storage: str | None = Field(
        None, description="URL of the database of method optuna; none: SQLite in the folder of the calibration"
    )
    time_limit: float = number(7200.0, "s", "time limit of a run; a longer one is stopped and failed", gt=0, le=1e7)


def parse_calibration(document: Document) -> Calibration:
    """Read the calibration in ``document``; raises :class:`InputError` with all findings."""
    return parse_as(Calibration, document)


#: smallest number of characters of a reason
REASON = 20


class UncertaintyBase(Test):
    """Test of all runs, and the settings that they share."""

    parameters: str | None = Field(None, description="parameter set of the fabrics")


class Prior(Distribution):
    """Prior of an assumed parameter between ``low`` and ``high``, in the unit of its field, with its reason."""

    reason: str = Field(description=f"knowledge of the parameter with its origin, at least {REASON} characters")
    also: list[str] = Field(default_factory=list, description="other fields with the same value")

    @model_validator(mode="after")
    def _is_justified(self) -> Self:
        if len(self.reason.strip()) < REASON:
            raise BoundsError(f"expected the knowledge and its origin, at least {REASON} characters", "reason")
        for name in ("low", "high"):
            if getattr(self, name) is None:
                raise BoundsError("missing: every prior needs bounds, also a normal one", name)
        return self


class StudyQuantity(Strict):
    """Result of the test, single or at several positions on an axis, and its ratios between fabrics."""

    result: str = Field(description="result in summary.json, such as overhang_mm")
    at: list[float] = Field(default_factory=list, description="positions on the axis, such as angles")
    axis: str = Field("", description="name of the axis, with its unit")
    unit: str = Field("", description="unit of the result")
    spacing: Literal["linear", "log"] = Field(
        "linear", description="log: indices of the logarithm, for results that span decades"
    )
    ratios: list[list[str]] = Field(default_factory=list, description="[A, B]: ratio A / B of two fabrics")
    any_end: bool = Field(
        False, description="without at: also use the result of a run that ended early, such as an initial thickness"
    )

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        if any(b <= a for a, b in zip(self.at, self.at[1:], strict=False)):
            raise BoundsError("must rise strictly", "at")
        if self.at and self.any_end:
            raise BoundsError("needs a quantity without at: leave out one of them", "any_end")
        if any(len(pair) != 2 or pair[0] == pair[1] for pair in self.ratios):
            raise BoundsError("expected pairs of different fabrics, [[A, B]] for A / B", "ratios")
        return self


class Statement(Strict):
    """Inequality whose probability under the priors is estimated; it must hold at all positions of the axis."""

    quantity: str = Field(description="name of a quantity of this file")
    of: str = Field(description="fabric, or A/B for a ratio")
    below: str | float | None = Field(None, description="upper bound: fabric or number")
    above: str | float | None = Field(None, description="lower bound: fabric or number")

    @model_validator(mode="after")
    def _has_bound(self) -> Self:
        if self.below is None and self.above is None:
            raise BoundsError("missing: expected below or above, with a fabric or a number", "below")
        return self


class Uncertainty(Strict):
    """Uncertainty study."""

    base: UncertaintyBase = Field(description="test, and settings that all runs share")
    fabrics: dict[str, FabricChoice] = Field(
        min_length=1, max_length=6, description="fabrics by name, with equal yarns"
    )
    differing_fields: list[str] = Field(
        default_factory=list,
        description="fields in which the fabrics may differ, such as fabric.loop_length; other differences are errors",
    )
    parameters: dict[str, Prior] = Field(
        min_length=2, max_length=30, description="prior by field of a run, the same for all fabrics"
    )
    quantities: dict[str, StudyQuantity] = Field(min_length=1, description="results to study, by name")
    statements: dict[str, Statement] = Field(default_factory=dict, description="inequalities by name")
    design: Literal["saltelli", "sample"] = Field(
        "saltelli",
        description="saltelli: Sobol indices, (parameters + 2) x samples runs; sample: rank regression, 2 x samples "
        "runs",
    )
    samples: int = Field(64, ge=2, le=8192, description="size of each of the two samples, a power of two")
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of sampling and resampling")
    shorter_ends: dict[str, Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=1)]] = Field(
        default_factory=dict, max_length=1,
        description="falling values of the field that ends the test, at which a rejected or failed run is repeated",
    )  # fmt: skip
    workers: int | None = Field(
        None,
        ge=1,
        le=1024,
        description="parallel processes, one thread each; --workers overrides it; none: one per core",
    )
    time_limit: float = number(7200.0, "s", "time limit of a run; a longer one is stopped without result", gt=0, le=1e7)

    @field_validator("samples", mode="after")
    @classmethod
    def _is_a_power_of_two(cls, samples: int) -> int:
        if samples & (samples - 1):
            below = 1 << (samples.bit_length() - 1)
            raise BoundsError(f"expected a power of two, {below} or {2 * below}")
        return samples


def parse_uncertainty(document: Document) -> Uncertainty:
    """Read the study in ``document``; raises :class:`InputError` with all findings."""
    return parse_as(Uncertainty, document)
