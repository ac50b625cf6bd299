"""Baseline: stored numbers and curves of the code itself in one versioned JSON file, and how runs become entries."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from knittest.base.errors import InputError
from knittest.base.files import data_dir, write_atomic
from knittest.base.history import Array
from knittest.config.run import Run
from knittest.experiment.comparison import STRAIN
from knittest.export.files import json_text
from knittest.export.identity import cpu_model, git_commit
from knittest.export.summary import timestamp
from knittest.laboratory.report_base import REPORTS
from knittest.laboratory.restart import SPEED
from knittest.studies.trials.trial import Record

NotNegative = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]


class _StoredModel(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Curve(_StoredModel):
    """Curve at equally spaced places; ``x_name`` and ``y_name`` are columns of curve.csv, ``scatter`` the standard
    deviation of ``y`` by rounding, empty if it is not known.
    """

    x_name: str
    y_name: str
    x: list[float] = Field(min_length=2)
    y: list[float] = Field(min_length=2)
    scatter: list[NotNegative] = Field(default_factory=list)

    @model_validator(mode="after")
    def _check_lengths(self) -> Self:
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


class Entry(_StoredModel):
    """Results of a run with commit, date and processor; or the means of ``runs`` that round differently.

    Means have standard deviations in ``scatter``, numbers of crests their ``ranges``; ``sometimes`` names numbers that
    only some of the runs have. ``accepted`` are the limits for later updates.
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
    def _check_scatter(self) -> Self:
        """Reject a scatter that does not fit the runs: one run has no scatter to widen limits with."""
        if self.runs == 1 and (self.scatter or self.ranges or (self.curve and self.curve.scatter)):
            raise ValueError("scatter, ranges: expected none of 1 run")
        if odd := sorted({*self.scatter, *self.ranges} ^ {*(self.results if self.runs > 1 else ())}):
            raise ValueError(f"scatter, ranges: expected one for each number in results: {odd[0]} is in only one")
        if self.runs > 1 and self.curve and not self.curve.scatter:
            raise ValueError(f"curve.scatter: expected that of {self.runs} runs")
        for name, (low, high) in self.ranges.items():
            if not low <= self.results[name] <= high:
                raise ValueError(f"ranges.{name}: {low} to {high} does not contain the mean {self.results[name]:g}")
        return self


class Baseline(_StoredModel):
    """Entries by the name of their case."""

    format: Literal[1] = 1
    entries: dict[str, Entry] = Field(default_factory=dict)


def shipped_path() -> Path:
    """Path of the baseline of this version."""
    return data_dir() / "regress" / "baseline.json"


def load(path: Path) -> Baseline:
    """Read the baseline in ``path``; raises :class:`InputError` for an unreadable or invalid file."""
    try:
        return Baseline.model_validate_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: no baseline: {error.strerror}; write one with --update-baseline") from None
    except ValidationError as error:
        first = error.errors()[0]
        where, what = ".".join(map(str, first["loc"])) or "file", first["msg"].removeprefix("Value error, ")
        remedy = "restore the committed file, or remove the run from it and use --update-baseline"
        raise InputError(f"{path}: no baseline of this version: {where}: {what}; {remedy}") from None


def save(path: Path, baseline: Baseline) -> None:
    """Write ``baseline`` with its entries in alphabetical order; raises :class:`ResourceError`."""
    ordered = Baseline(entries=dict(sorted(baseline.entries.items())))
    write_atomic(path, json_text(ordered.model_dump(mode="json"), indent=1))


def update_entries(baseline: Baseline, entries: Mapping[str, Entry], dropped: Iterable[str] = ()) -> Baseline:
    """Replace ``entries`` of the same names in ``baseline``, and remove those ``dropped``."""
    together = {**baseline.entries, **entries}
    return Baseline(entries={name: entry for name, entry in together.items() if name not in set(dropped)})


#: points of a stored curve
POINTS = 21
#: digits kept: ten times finer than the tightest tolerance needs
DIGITS = 6
#: numerical errors of a run, ideally zero, which the quality checks limit
ACCURACY_SUFFIXES = ("_error_pct", "residual", "drift_deg")


def numbers_of(record: Record) -> dict[str, float]:
    """Finite results that the baseline keeps."""
    return {k: v for k, v in record.results.items() if np.isfinite(v) and not k.endswith((*ACCURACY_SUFFIXES, SPEED))}


def entry_of(run: Run, record: Record, folder: Path) -> Entry:
    """Entry of a completed run in ``folder``; raises :class:`InputError` if its curve is missing."""
    assert record.cost is not None
    results, curve = {k: round_to_digits(v) for k, v in numbers_of(record).items()}, None
    if has_curve(run):
        axes = REPORTS[run.rig.kind].axes
        x, y = curve_points(run, folder)
        grid = np.array([round_to_digits(v) for v in np.linspace(x[0], x[-1], POINTS)])
        values = [round_to_digits(v) for v in np.interp(grid, x, y)]
        curve = Curve(x_name=axes.x, y_name=axes.y, x=grid.tolist(), y=values)
    elements, commit, cpu = record.cost["elements"], git_commit(), cpu_model()
    return Entry(commit=commit, date=timestamp(), cpu=cpu, elements=elements, results=results, curve=curve)


def reject_reason(run: Run, record: Record, folder: Path) -> str:
    """Reason not to store or compare a completed run, or empty; raises :class:`InputError` for a missing curve."""
    if not numbers_of(record):
        return "the run completed without a number"
    if not has_curve(run):
        return ""
    x, y = curve_points(run, folder)
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        return "its curve has values that are not finite"
    return "" if y.any() and x[-1] > x[0] else "its curve has no length or no height"


def curve_points(run: Run, folder: Path) -> tuple[Array, Array]:
    """Coordinate and value (n,) of the curve of a run, of a tensile test up to its peak: after it yarns fail one by
    one, and a small shift in time is a large one in force.
    """
    axes = REPORTS[run.rig.kind].axes
    try:
        table = pd.read_csv(folder / "curve.csv")
        x, y = table[axes.x].to_numpy(float), table[axes.y].to_numpy(float)
    except (OSError, ValueError, KeyError) as error:
        raise InputError(f"{folder}: its curve cannot be read ({error}): remove the folder and run again") from None
    end = int(np.argmax(y)) + 1 if axes.x == STRAIN else len(x)
    return x[:end], y[:end]


def has_curve(run: Run) -> bool:
    """Tell whether the test has a curve of a physical quantity; relaxation has none."""
    return not REPORTS[run.rig.kind].axes.logarithmic


def round_to_digits(value: float) -> float:
    """Round ``value`` to :data:`DIGITS` digits."""
    return float(f"{value:.{DIGITS}g}")
