"""A study of what assumed parameters are worth: priors, quantities, statements, for ``knittest uncertainty``."""

from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from knittest.config.base import BoundsError, Strict, number
from knittest.config.chosen import Chosen
from knittest.config.fabric import Direction
from knittest.config.kind_name import TestName
from knittest.config.parsing import parse_as
from knittest.config.run import Preset, Scale
from knittest.config.sweep import Distribution
from knittest.config.yaml_loader import Document

#: characters that a reason has at least
REASON = 20


class Base(Strict):
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

    base: Base = Field(description="the test, and what all runs share")
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
