"""Numbers and curves of finished runs as the baseline keeps them."""

from pathlib import Path

import numpy as np
import pandas as pd

from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.config.run import Run
from knittest.experiment.compare import STRAIN
from knittest.export.manifest import now
from knittest.export.provenance import cpu_model, git_commit
from knittest.laboratory.lowered_speed import SPEED
from knittest.laboratory.registry import REPORTS
from knittest.studies.regress.baseline import Curve, Entry
from knittest.studies.trials.record import Record

#: points of a stored curve
POINTS = 21
#: digits kept: ten times finer than the tightest tolerance needs
DIGITS = 6
#: results that say how exact a run is, close to zero by right: the quality gates judge them
EXACTNESS = ("_error_pct", "residual", "drift_deg")


def numbers_of(record: Record) -> dict[str, float]:
    """Results that have a value and that the baseline keeps; the speed is that of the run."""
    left = (*EXACTNESS, SPEED)
    return {k: v for k, v in record.results.items() if np.isfinite(v) and not k.endswith(left)}


def entry_of(run: Run, record: Record, folder: Path) -> Entry:
    """Entry of a completed run in ``folder``; raises :class:`InputError` when its curve is gone."""
    assert record.cost is not None
    results = {k: rounded(v) for k, v in numbers_of(record).items()}
    return Entry(
        commit=git_commit(), date=now(), cpu=cpu_model(), elements=record.cost["elements"], results=results,
        curve=_curve(run, folder),
    )  # fmt: skip


def fault_of(run: Run, record: Record, folder: Path) -> str:
    """Reason why a completed run cannot be stored or compared, empty for none; raises :class:`InputError` when its
    curve is gone.
    """
    if not numbers_of(record):
        return "the run completed without a number"
    if not has_curve(run):
        return ""
    x, y = points(run, folder)
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        return "its curve has values that are no numbers"
    return "" if y.any() and x[-1] > x[0] else "its curve has no length or no height"


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
