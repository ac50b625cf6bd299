"""The stored numbers and curves of the code itself, in one versioned JSON file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.base.resources import data_dir
from knittest.config.run import Run
from knittest.experiment.compare import STRAIN
from knittest.export.jsonfile import json_text
from knittest.export.manifest import now
from knittest.export.provenance import cpu_model, git_commit
from knittest.laboratory.registry import REPORTS
from knittest.studies.trials.record import Record

#: points of a stored curve
POINTS = 21
#: digits kept: ten times finer than the tightest tolerance needs
DIGITS = 6
#: results that say how exact a run is, close to zero by right: the quality gates judge them
EXACTNESS = ("_error_pct", "residual", "drift_deg")


class _Stored(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class Curve(_Stored):
    """A curve at ``POINTS`` places, equally far apart; ``x_name`` and ``y_name`` are columns of curve.csv, ``scatter``
    the standard deviation of ``y`` by rounding, empty where it is not known.
    """

    x_name: str
    y_name: str
    x: list[float] = Field(min_length=2)
    y: list[float] = Field(min_length=2)
    scatter: list[float] = Field(default_factory=list)


class Entry(_Stored):
    """Result of a run, with the code (commit), time and processor that gave it; or the mean of ``runs`` that round
    differently, with the standard deviations ``scatter``.
    """

    commit: str | None
    date: str
    cpu: str
    elements: int = Field(gt=0)
    results: dict[str, float]
    runs: int = Field(1, gt=0)
    scatter: dict[str, float] = Field(default_factory=dict)
    curve: Curve | None = None


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
        where = ".".join(map(str, first["loc"])) or "file"
        raise InputError(f"{path}: no baseline of this version: {where}: {first['msg']}") from None


def save(path: Path, baseline: Baseline) -> None:
    """Write ``baseline``, its entries in the order of their names; raises :class:`ResourceError`."""
    ordered = Baseline(entries=dict(sorted(baseline.entries.items())))
    write_atomic(path, json_text(ordered.model_dump(mode="json"), indent=1))


def entry_of(run: Run, record: Record, folder: Path) -> Entry:
    """Entry of a completed run in ``folder``; raises :class:`InputError` when its curve is gone."""
    assert record.cost is not None
    numbers = {k: v for k, v in record.results.items() if np.isfinite(v)}
    results = {k: rounded(v) for k, v in numbers.items() if not k.endswith(EXACTNESS)}
    return Entry(
        commit=git_commit(), date=now(), cpu=cpu_model(), elements=record.cost["elements"], results=results,
        curve=_curve(run, folder),
    )  # fmt: skip


def points(run: Run, folder: Path) -> tuple[Array, Array]:
    """Coordinate and value (n,) of the curve of a run, of a tensile test up to its peak: behind it yarns break one by
    one and a small shift in time is a large one in force.
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
    """Tell whether the test has a curve of a physical quantity; relaxation to rest has none."""
    return not REPORTS[run.rig.kind].axes.logarithmic


def rounded(value: float) -> float:
    """``value`` with :data:`DIGITS` digits."""
    return float(f"{value:.{DIGITS}g}")


def _curve(run: Run, folder: Path) -> Curve | None:
    if not has_curve(run):
        return None
    axes = REPORTS[run.rig.kind].axes
    x, y = points(run, folder)
    grid = np.array([rounded(v) for v in np.linspace(x[0], x[-1], POINTS)])
    values = [rounded(v) for v in np.interp(grid, x, y)]
    return Curve(x_name=axes.x, y_name=axes.y, x=grid.tolist(), y=values)


def renewed(baseline: Baseline, entries: Mapping[str, Entry]) -> Baseline:
    """``baseline`` with ``entries`` in place of those of the same names."""
    return Baseline(entries={**baseline.entries, **entries})


def difference(name: str, old: Entry | None, new: Entry) -> str:
    """Former entry ``name`` in a line: the number that changed most."""
    if old is None:
        return f"{name}: new"
    both = [(k, old.results[k], v) for k, v in new.results.items() if old.results.get(k)]
    what, was, now = max(both, key=lambda row: abs(row[2] / row[1] - 1.0), default=("nothing", 1.0, 1.0))
    if was == now:
        return f"{name}: as before"
    share, commit = 100.0 * (now / was - 1.0), (old.commit or "no commit")[:12]
    return f"{name}: {what} was {was:g} ({commit}), is {now:g} ({share:+.3g} %)"
