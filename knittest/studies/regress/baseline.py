"""The stored numbers and curves of the code itself, in one versioned JSON file."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.base.resources import data_dir
from knittest.export.jsonfile import json_text

NotNegative = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]


class _Stored(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Curve(_Stored):
    """A curve at places equally far apart; ``x_name`` and ``y_name`` are columns of curve.csv, ``scatter`` the standard
    deviation of ``y`` by rounding, empty where it is not known.
    """

    x_name: str
    y_name: str
    x: list[float] = Field(min_length=2)
    y: list[float] = Field(min_length=2)
    scatter: list[NotNegative] = Field(default_factory=list)

    @model_validator(mode="after")
    def _as_long(self) -> Self:
        places = len(self.x)
        if len(self.y) != places:
            raise ValueError(f"y has {len(self.y)} values, x {places}: expected as many")
        if self.scatter and len(self.scatter) != places:
            raise ValueError(f"scatter has {len(self.scatter)} values, y {places}: expected as many")
        if any(b <= a for a, b in zip(self.x, self.x[1:], strict=False)):
            raise ValueError("x: expected values that grow")
        if not any(self.y):
            raise ValueError("y: expected values other than 0")
        return self


class Entry(_Stored):
    """Result of a run, with the code (commit), time and processor that gave it; or the mean of ``runs`` that round
    differently, with standard deviations ``scatter``, of crests least and greatest number (``ranges``), and the names
    of numbers that only some of the runs have. ``accepted`` are limits that updates are judged by.
    """

    commit: str | None
    date: str
    cpu: str
    elements: int = Field(gt=0)
    results: dict[str, float] = Field(min_length=1)
    runs: int = Field(1, gt=0)
    scatter: dict[str, NotNegative] = Field(default_factory=dict)
    ranges: dict[str, tuple[Count, Count]] = Field(default_factory=dict)
    sometimes: list[str] = Field(default_factory=list)
    accepted: dict[str, NotNegative] = Field(default_factory=dict)
    curve: Curve | None = None

    @model_validator(mode="after")
    def _of_its_runs(self) -> Self:
        """Refuse a scatter that is not of these runs: one of a single run would widen limits that nobody measured."""
        if self.runs == 1 and (self.scatter or self.ranges or (self.curve and self.curve.scatter)):
            raise ValueError("scatter, ranges: expected none of 1 run")
        _expect("scatter, ranges", {*self.scatter, *self.ranges}, self.results if self.runs > 1 else ())
        if self.runs > 1 and self.curve and not self.curve.scatter:
            raise ValueError(f"curve.scatter: expected that of {self.runs} runs")
        for name, (low, high) in self.ranges.items():
            if not low <= self.results[name] <= high:
                raise ValueError(f"ranges.{name}: {low} to {high} does not hold the mean {self.results[name]:g}")
        return self


def _expect(field: str, found: set[str], names: Iterable[str]) -> None:
    """Refuse names that are missing or too many."""
    if odd := sorted(found ^ set(names)):
        raise ValueError(f"{field}: expected one for each number in results: {odd[0]} is in one of them only")


class Baseline(_Stored):
    """Entries by the name of their case."""

    format: Literal[1] = 1
    entries: dict[str, Entry] = Field(default_factory=dict)


def shipped() -> Path:
    """The baseline of this version."""
    return data_dir() / "regress" / "baseline.json"


def load(path: Path) -> Baseline:
    """The baseline in ``path``; raises :class:`InputError` for one that cannot be read or is none."""
    try:
        return Baseline.model_validate_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: no baseline: {error.strerror}; --update-baseline writes one") from None
    except ValidationError as error:
        first = error.errors()[0]
        where, what = ".".join(map(str, first["loc"])) or "file", first["msg"].removeprefix("Value error, ")
        raise InputError(
            f"{path}: no baseline of this version: {where}: {what}; take back the file as it was committed, or remove "
            "the run from it and store it anew by --update-baseline"
        ) from None


def save(path: Path, baseline: Baseline) -> None:
    """Write ``baseline``, its entries in the order of their names; raises :class:`ResourceError`."""
    ordered = Baseline(entries=dict(sorted(baseline.entries.items())))
    write_atomic(path, json_text(ordered.model_dump(mode="json"), indent=1))


def renewed(baseline: Baseline, entries: Mapping[str, Entry], dropped: Iterable[str] = ()) -> Baseline:
    """``baseline`` with ``entries`` in place of those of the same names, without those ``dropped``."""
    together = {**baseline.entries, **entries}
    return Baseline(entries={name: entry for name, entry in together.items() if name not in set(dropped)})
