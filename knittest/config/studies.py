"""Files of studies as models: sweeps, calibrations and studies of uncertainty."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from knittest.base.kinds import DEFAULT, kinds
from knittest.config.base import BoundsError, Strict, TestName, number
from knittest.config.fabric import Direction
from knittest.config.messages import parse_as
from knittest.config.run import Preset, Scale
from knittest.config.yaml_loader import Document


def _listed(value: object) -> list[str]:
    names = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str | int) and not isinstance(name, bool) for name in names):
        raise ValueError("expected a name or a list of names")
    return [str(name) for name in names]


#: one name or a list of names; a number is a name, too
Names = Annotated[list[str], BeforeValidator(_listed)]


class SweepBase(Strict):
    """Settings that all runs share; a list makes a run of each."""

    test: Names = Field(
        default_factory=lambda: [DEFAULT],
        min_length=1,
        description=", ".join(kinds()),
    )
    variant: Names = Field(default_factory=list, description="shipped fabrics: 1, 2, or names of configs/NAME.yaml")
    fabric: Names = Field(default_factory=list, description="fabric files, seen from the folder of the sweep")
    config: str | None = Field(None, description="a rig file or a whole run, seen from the folder of the sweep")
    scale: Names = Field(default_factory=list, description="macro, meso")
    direction: Names = Field(default_factory=list, description="warp, weft or both (default)")
    preset: Names = Field(default_factory=list, description="quick, standard, paper")
    parameters: Names = Field(default_factory=list, description="parameter sets of the fabric")
    set: dict[str, Any] = Field(default_factory=dict, description="fixed values: any field of a run, as --set takes it")


class Range(Strict):
    """Evenly spaced values from ``low`` to ``high``."""

    low: float = Field(description="first value")
    high: float = Field(description="last value")
    steps: int = Field(ge=2, description="number of values")
    spacing: Literal["linear", "log"] = Field("linear", description="even steps, or even ratios")

    @model_validator(mode="after")
    def _rises(self) -> Self:
        check_order(self.low, self.high, self.spacing == "log")
        return self


class Distribution(Strict):
    """Distribution that a field is drawn from; ``low`` and ``high`` truncate a normal distribution."""

    kind: Literal["uniform", "log-uniform", "normal"] = Field("uniform", description="distribution")
    low: float | None = Field(None, description="smallest value")
    high: float | None = Field(None, description="largest value")
    mean: float | None = Field(None, description="normal: mean before truncation")
    sd: float | None = Field(None, gt=0, description="normal: standard deviation before truncation")
    whole: bool = Field(False, description="round to whole numbers")

    @model_validator(mode="after")
    def _complete(self) -> Self:
        wanted = ("mean", "sd") if self.kind == "normal" else ("low", "high")
        for name in wanted:
            if getattr(self, name) is None:
                raise BoundsError(f"missing: a {self.kind} distribution needs {' and '.join(wanted)}", name)
        for name in ("mean", "sd"):
            if self.kind != "normal" and getattr(self, name) is not None:
                raise BoundsError(f"a {self.kind} distribution has none: leave it out, or take kind: normal", name)
        if self.low is not None and self.high is not None:
            check_order(self.low, self.high, self.kind == "log-uniform")
        return self


class Sample(Strict):
    """Points drawn for several fields at once."""

    method: Literal["random", "latin-hypercube"] = Field("latin-hypercube", description="how points are spread")
    n: int = Field(ge=1, description="number of points")
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of the draws")
    fields: dict[str, Distribution] = Field(min_length=1, description="field of a run: its distribution")


class Ensemble(Strict):
    """Scatter from specimen to specimen."""

    specimens: int | None = Field(None, ge=1, le=1000, description="specimens in one run, of which mean and sd count")
    seeds: list[Annotated[int, Field(ge=0, le=2**32 - 1)]] = Field(
        default_factory=list, description="a run for each seed"
    )


class Sweep(Strict):
    """All blocks multiply: every point of one with every point of the others."""

    base: SweepBase = Field(description="what all runs share")
    grid: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(
        default_factory=dict, description="field of a run: list of values"
    )
    range: dict[str, Range] = Field(default_factory=dict, description="field of a run: evenly spaced values")
    points: list[dict[str, Any]] = Field(default_factory=list, description="points, each with its fields and values")
    sample: Sample | None = Field(None, description="random or Latin-hypercube points")
    ensemble: Ensemble = Field(default_factory=Ensemble, description="specimens and seeds")
    time_limit: float = number(
        7200.0, "s", "a run that takes longer, by the clock on the wall, is stopped", gt=0, le=1e7
    )
    keep: Literal["tables", "pictures", "frames"] = Field(
        "tables", description="what a run folder keeps; pictures: tables, pictures and page; frames: also VTU frames"
    )


def parse_sweep(document: Document) -> Sweep:
    """The sweep in ``document``; raises :class:`InputError` with every finding."""
    return parse_as(Sweep, document)


def check_order(low: float, high: float, positive: bool) -> None:
    """Raise :class:`BoundsError` unless ``low`` is below ``high`` and, where asked for, ``positive``."""
    if positive and low <= 0.0:
        raise BoundsError("must be greater than 0, for there are ratios between the values", "low")
    if high <= low:
        raise BoundsError(f"must be greater than low = {low:g}", "high")


def _named(value: object) -> Any:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class Chosen(Strict):
    """A fabric, shipped or a file."""

    variant: Annotated[str | None, BeforeValidator(_named)] = Field(
        None, description="shipped fabric: 1, 2, or a name of configs/NAME.yaml"
    )
    fabric: str | None = Field(None, description="fabric file, seen from the folder of this file")


Method = Literal["auto", "root", "least-squares", "differential-evolution", "optuna"]


class CalibrationBase(Chosen):
    """The fabric that is calibrated, and what all tests share."""

    parameters: str | None = Field(None, description="parameter set of the fabric")
    scale: Scale | None = Field(None, description="macro or meso")
    preset: Preset | None = Field(None, description="quick, standard, paper")
    set: dict[str, Any] = Field(default_factory=dict, description="fixed values: any field of a run, as --set takes it")


class Parameter(Strict):
    """A number to find between ``low`` and ``high``, in the unit of its field."""

    low: float = Field(description="lower bound")
    high: float = Field(description="upper bound")
    spacing: Literal["linear", "log"] = Field("linear", description="log: steps are ratios, for a stiffness")
    start: float | None = Field(None, description="first value; none: mean, else the fabric's value, else the middle")
    mean: float | None = Field(None, description="prior mean: what is known without the targets")
    sd: float | None = Field(None, gt=0, description="prior standard deviation")
    also: list[str] = Field(default_factory=list, description="other fields that take the same value")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        check_order(self.low, self.high, self.spacing == "log")
        for name in ("start", "mean"):
            value = getattr(self, name)
            if value is not None and not self.low <= value <= self.high:
                raise BoundsError(f"must be between low = {self.low:g} and high = {self.high:g}", name)
        if (self.mean is None) != (self.sd is None):
            raise BoundsError("missing: a prior has mean and sd", "mean" if self.mean is None else "sd")
        return self


class Test(Strict):
    """A test to run at every point; what it does not say is that of ``base``."""

    test: TestName = Field(description="kind of test")
    direction: Direction | None = Field(None, description="warp or weft")
    config: str | None = Field(None, description="a rig file, seen from the folder of this file")
    scale: Scale | None = Field(None, description="macro or meso")
    preset: Preset | None = Field(None, description="quick, standard, paper")
    set: dict[str, Any] = Field(default_factory=dict, description="fixed values: any field of a run, as --set takes it")


class Target(Strict):
    """Target of a test: a row of the fabric's experiment, a value with its sd, or a curve."""

    test: str = Field(description="name of one of the tests")
    quantity: str | None = Field(None, description="result of the test, such as overhang_mm; alone: the table's row")
    value: float | None = Field(None, description="instead of the table's mean")
    sd: float | None = Field(None, gt=0, description="instead of the scatter in the table or the curve's sd column")
    curve: str | None = Field(None, description="CSV of a curve, seen from the folder of this file or the shipped data")
    weight: float = Field(1.0, gt=0, le=1e6, description="factor on the square of the deviation in sd")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.quantity is None) == (self.curve is None):
            raise BoundsError("expected quantity (a result) or curve (a CSV), one of them", "quantity")
        if self.value is not None and (self.curve is not None or self.sd is None):
            raise BoundsError("a value needs quantity and sd, its standard deviation", "value")
        return self


class Calibration(Strict):
    """A calibration file."""

    base: CalibrationBase = Field(description="the fabric, and what all tests share")
    parameters: dict[str, Parameter] = Field(min_length=1, max_length=12, description="field of a run: its bounds")
    tests: dict[str, Test] = Field(min_length=1, description="name: a test to run at every point")
    targets: list[Target] = Field(min_length=1, description="what the tests must come to")
    method: Method = Field(
        "auto", description="auto: root for one parameter and one number without prior, else least-squares"
    )
    tolerance: float = number(0.02, "1", "a target is met within this share of its sd", gt=0, le=1)
    noise: float = number(
        0.05,
        "1",
        "a parameter that moves the targets less than this, in sd, over its bounds does not matter",
        gt=0,
        le=1,
    )
    step: float = number(0.05, "1", "finite difference, as a share of the bounds", gt=0, le=0.5)
    max_runs: int = Field(60, ge=2, le=100_000, description="most runs")
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of differential-evolution and optuna")
    storage: str | None = Field(
        None, description="URL of the database of method optuna; none: SQLite in the folder of the calibration"
    )
    time_limit: float = number(7200.0, "s", "a run that takes longer is stopped and counts as failed", gt=0, le=1e7)


def parse_calibration(document: Document) -> Calibration:
    """The calibration in ``document``; raises :class:`InputError` with every finding."""
    return parse_as(Calibration, document)


#: characters that a reason has at least
REASON = 20


class UncertaintyBase(Strict):
    """The test that all runs are of, and what they share."""

    test: TestName = Field(description="kind of test")
    direction: Direction | None = Field(None, description="warp or weft")
    config: str | None = Field(None, description="a rig file, seen from the folder of this file")
    scale: Scale | None = Field(None, description="macro or meso")
    preset: Preset | None = Field(None, description="quick, standard, paper")
    parameters: str | None = Field(None, description="parameter set of the fabrics")
    set: dict[str, Any] = Field(default_factory=dict, description="fixed values: any field of a run, as --set takes it")


class Prior(Distribution):
    """Prior of an assumed parameter, between ``low`` and ``high`` in the unit of its field, and the reason for it."""

    reason: str = Field(description=f"what is known of it, and from where; {REASON} characters at least")
    also: list[str] = Field(default_factory=list, description="other fields that take the same value")

    @field_validator("reason", mode="after")
    @classmethod
    def _says_something(cls, reason: str) -> str:
        if len(reason.strip()) < REASON:
            raise BoundsError(f"expected what is known of it, and from where, in {REASON} characters at least")
        return reason

    @model_validator(mode="after")
    def _has_ends(self) -> Self:
        for name in ("low", "high"):
            if getattr(self, name) is None:
                raise BoundsError("missing: a prior ends somewhere, a normal one too: what is beyond is excluded", name)
        return self


class Wanted(Strict):
    """A result of the test, alone or at several places of an axis, and its ratios between fabrics."""

    result: str = Field(description="result of the test in its summary.json, such as overhang_mm")
    at: list[float] = Field(
        default_factory=list, description="places on its axis, for a result with one value at each, such as angles"
    )
    axis: str = Field("", description="name of the axis, with its unit")
    unit: str = Field("", description="unit of the result")
    spacing: Literal["linear", "log"] = Field(
        "linear", description="log: indices share out the variance of the logarithm, for what spans decades"
    )
    ratios: list[list[str]] = Field(default_factory=list, description="[A, B]: A over B, two of the fabrics")
    any_end: bool = Field(
        False, description="without places: whether a run that ends sooner gives it too, such as a thickness at rest"
    )

    @model_validator(mode="after")
    def _is_in_order(self) -> Self:
        if any(b <= a for a, b in zip(self.at, self.at[1:], strict=False)):
            raise BoundsError("must rise", "at")
        if self.at and self.any_end:
            raise BoundsError("is for a quantity without places: a run gives those that it comes to", "any_end")
        if any(len(pair) != 2 or pair[0] == pair[1] for pair in self.ratios):
            raise BoundsError("expected pairs of different fabrics, [[A, B]] for A over B", "ratios")
        return self


class Statement(Strict):
    """An inequality whose share of the prior is looked for; it holds where it holds at all places of the axis."""

    quantity: str = Field(description="name of one of the quantities")
    of: str = Field(description="a fabric, or A/B for a ratio")
    below: str | float | None = Field(None, description="a fabric or a number that it is below")
    above: str | float | None = Field(None, description="a fabric or a number that it is above")

    @model_validator(mode="after")
    def _compares(self) -> Self:
        if self.below is None and self.above is None:
            raise BoundsError("missing: expected below or above, a fabric or a number", "below")
        return self


class Uncertainty(Strict):
    """A file of ``knittest uncertainty``."""

    base: UncertaintyBase = Field(description="the test, and what all runs share")
    fabrics: dict[str, Chosen] = Field(min_length=1, max_length=6, description="name: a fabric; all have equal yarns")
    differ: list[str] = Field(
        default_factory=list,
        description="fields in which the fabrics may differ, such as fabric.loop_length; any other stops the command",
    )
    parameters: dict[str, Prior] = Field(
        min_length=2, max_length=30, description="field of a run: its prior; all fabrics take the same value"
    )
    quantities: dict[str, Wanted] = Field(min_length=1, description="name: what is asked for")
    statements: dict[str, Statement] = Field(default_factory=dict, description="name: an inequality")
    design: Literal["saltelli", "sample"] = Field(
        "saltelli",
        description="saltelli: Sobol indices, (parameters + 2) x samples points; sample: 2 x samples, rank regression",
    )
    samples: int = Field(64, ge=2, le=8192, description="points of each of the two samples, a power of two")
    seed: int = Field(1, ge=0, le=2**32 - 1, description="seed of the sequence and of the resampling")
    shorter: dict[str, Annotated[list[Annotated[float, Field(gt=0)]], Field(min_length=1)]] = Field(
        default_factory=dict, max_length=1,
        description="field that ends the test: falling values at which a run that was refused or failed is tried again",
    )  # fmt: skip
    workers: int | None = Field(
        None, ge=1, le=1024, description="processes, one thread each; --workers goes before it; none: one a core"
    )
    time_limit: float = number(7200.0, "s", "a run that takes longer is stopped, and has no result", gt=0, le=1e7)

    @field_validator("samples", mode="after")
    @classmethod
    def _is_a_power_of_two(cls, samples: int) -> int:
        if samples & (samples - 1):
            below = 1 << (samples.bit_length() - 1)
            raise BoundsError(f"expected a power of two, {below} or {2 * below}: the sequence is balanced there only")
        return samples


def parse_uncertainty(document: Document) -> Uncertainty:
    """The study in ``document``; raises :class:`InputError` with every finding."""
    return parse_as(Uncertainty, document)
