"""A calibration: parameters, tests and what these must come to, as ``knittest calibrate`` reads it."""

from typing import Any, Literal, Self

from pydantic import Field, model_validator

from knittest.config.base import BoundsError, Strict, number
from knittest.config.chosen import Chosen
from knittest.config.fabric import Direction
from knittest.config.kind_name import TestName
from knittest.config.parsing import parse_as
from knittest.config.run import Preset, Scale
from knittest.config.sweep import check_order
from knittest.config.yaml_loader import Document

Method = Literal["auto", "root", "least-squares", "differential-evolution", "optuna"]


class Base(Chosen):
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

    base: Base = Field(description="the fabric, and what all tests share")
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
