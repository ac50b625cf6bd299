"""A sweep: one base run and the fields that change from run to run, as ``knittest batch`` reads it."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from knittest.base.kinds import DEFAULT, kinds
from knittest.config.base import BoundsError, Strict, number
from knittest.config.parsing import parse_as
from knittest.config.yaml_loader import Document


def _listed(value: object) -> list[str]:
    names = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str | int) and not isinstance(name, bool) for name in names):
        raise ValueError("expected a name or a list of names")
    return [str(name) for name in names]


#: one name or a list of names; a number is a name, too
Names = Annotated[list[str], BeforeValidator(_listed)]


class Base(Strict):
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

    base: Base = Field(description="what all runs share")
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
