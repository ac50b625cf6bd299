"""Drift: change of the code's numbers and curves since the baseline, their limits, and scatter by rounding."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.history import Array
from knittest.base.kinds import kinds
from knittest.config.run import Run, Scale
from knittest.laboratory.report_base import REPORTS
from knittest.laboratory.restart import SPEED, has_configured_speed
from knittest.studies.regress.baseline import (
    Curve,
    Entry,
    curve_points,
    has_curve,
    numbers_of,
    reject_reason,
    round_to_digits,
)
from knittest.studies.regress.cases import Case, local_trial
from knittest.studies.regress.published_tables import no_result_reason
from knittest.studies.trials.trial import Record, Trial


@dataclass(frozen=True)
class Change:
    """Change [-] of one number, or of the point of the curve that changed most, since the baseline (NaN: not stored).

    For numbers of crests ``change`` and ``limit`` are beyond ``counted``, the least and greatest of the stored runs.
    """

    what: str
    stored: float
    now: float
    change: float
    limit: float
    counted: tuple[int, int] | None = None

    @property
    def passed(self) -> bool:
        """Tell whether the change is within its limit; NaN is not."""
        return abs(self.change) <= self.limit

    @property
    def used(self) -> float:
        """Share [-] of the limit that the change uses."""
        if not math.isfinite(self.change):
            return math.inf
        if self.limit > 0.0:
            return abs(self.change) / self.limit
        return 0.0 if self.change == 0.0 else math.inf

    def __str__(self) -> str:
        if math.isnan(self.stored):
            return f"{self.what}: {self.now:.6g} now, no value in the baseline"
        if self.counted is not None:
            low, high = self.counted
            stored = f"{low}" if low == high else f"{low} to {high}"
            return f"{self.what}: {stored} stored, {self.now:g} now ({self.change:+g}, limit {self.limit:g} crest)"
        percent = f"{100.0 * self.change:+.3g} %, limit {100.0 * self.limit:.3g} %"
        return f"{self.what}: {self.stored:.6g} stored, {self.now:.6g} now ({percent})"


def number_change(name: str, stored: float, now: float, limit: float) -> Change:
    """Change of a number over its stored value."""
    change = (now - stored) / abs(stored) if stored != 0.0 else 0.0 if now == 0.0 else math.inf
    return Change(name, stored, now, change, limit)


# Scatter of a run by rounding: its numbers and curve over runs whose time steps differ by billionths.
#
# Wrinkling sheets and stick-slip of yarns amplify rounding, and processors, compilers and libraries round differently.
# A change of the time step by 1e-9 is far below the error of the step itself; any change above rounding shows the same
# scatter.

#: runs whose mean and scatter are stored, the unchanged one included
RUNS = 12
#: relative decrease of the time step from run to run
STEP_REDUCTION = 1e-9
#: largest deviation from the mean in standard deviations: with 12 runs, one in 2000 of a normal scatter exceeds it
SCATTER_FACTOR = 5.0


def rounding_trials(case: Case, trial: Trial) -> list[Trial]:
    """Runs that measure the scatter of ``case`` together with ``trial``; none if it does not amplify rounding."""

    def shorter(run: Run, number: int) -> Run:
        solver = run.solver.model_copy(update={"safety": run.solver.safety * (1.0 - number * STEP_REDUCTION)})
        return run.model_copy(update={"solver": solver})

    numbers = range(1, RUNS) if case.enlarges else ()
    return [local_trial(shorter(trial.run, number), f"{case.name}, rounding {number}") for number in numbers]


def pool_entries(
    entry: Entry, others: Sequence[Entry], curves: Sequence[tuple[Run, Path]], crests: Sequence[str]
) -> Entry:
    """Entry with means and standard deviations of the numbers of ``entry`` and ``others`` and of their ``curves`` (runs
    and folders), and the ranges of numbers of ``crests``; only the names of numbers that one of them lacks.

    Raises :class:`InputError` for a missing curve.
    """

    def mean_sd(values: np.ndarray) -> tuple[list[float], list[float]]:
        mean, sd = values.mean(axis=0), values.std(axis=0, ddof=1)
        return [round_to_digits(float(v)) for v in mean], [round_to_digits(float(v)) for v in sd]

    together = [entry.results, *(other.results for other in others)]
    names = [name for name in entry.results if all(name in one for one in together)]
    values = np.array([[one[name] for name in names] for one in together])
    results, scatter = (dict(zip(names, row, strict=True)) for row in mean_sd(values))
    ranges = {name: (int(min(row)), int(max(row))) for name, row in zip(names, values.T, strict=True) if name in crests}
    update: dict[str, object] = {
        "runs": len(together),
        "results": results,
        "scatter": {name: sd for name, sd in scatter.items() if name not in crests},
        "ranges": ranges,
        "sometimes": sorted({name for one in together for name in one} - {*names}),
    }
    if entry.curve is not None:
        grid = entry.curve.x
        y = np.array([entry.curve.y, *(np.interp(grid, *curve_points(run, folder)) for run, folder in curves)])
        mean, sd = mean_sd(y)
        update["curve"] = entry.curve.model_copy(update={"y": mean, "scatter": sd})
    return entry.model_copy(update=update)


def curve_problem(run: Run, curve: Curve | None) -> str:
    """Reason why the curve of ``run`` cannot be compared with the stored one, or empty."""
    if curve is None:
        return "the baseline has no curve of this run" if has_curve(run) else ""
    if not has_curve(run):
        return "the baseline has a curve, but the test has none"
    axes = REPORTS[run.rig.kind].axes
    if (axes.x, axes.y) != (curve.x_name, curve.y_name):
        return f"the baseline has a curve of {curve.y_name} over {curve.x_name}, the test of {axes.y} over {axes.x}"
    return ""


def curve_changes(run: Run, folder: Path, curve: Curve, limit: float) -> list[Change]:
    """Changes of the end that moved more, over the length, and of the worst point, over the largest value."""
    x, y = curve_points(run, folder)
    ends = [(curve.x[0], float(x[0])), (curve.x[-1], float(x[-1]))]
    before, now = max(ends, key=lambda end: abs(end[1] - end[0]))
    moved = (now - before) / (curve.x[-1] - curve.x[0])
    stored, values = np.array(curve.y), np.interp(curve.x, x, y)
    shares, limits = (values - stored) / np.abs(stored).max(), limits_along(curve, limit)
    worst = int(np.argmax(np.abs(shares) / limits))
    what = f"curve, {curve.y_name} at {curve.x_name} {curve.x[worst]:.4g}"
    return [
        Change(f"curve, end in {curve.x_name}", before, now, moved, limit),
        Change(what, float(stored[worst]), float(values[worst]), float(shares[worst]), float(limits[worst])),
    ]


def limits_along(curve: Curve, limit: float) -> Array:
    """Limits (n,) of the change of each point over the largest value [-]."""
    scatter = np.array(curve.scatter) if curve.scatter else np.zeros(len(curve.y))
    return limit + SCATTER_FACTOR * scatter / np.abs(curve.y).max()


@dataclass(frozen=True)
class Limits:
    """Limits of the change of a number over its stored value, of a curve over its largest value, and of a number that
    describes buckles only; a stored scatter by rounding is added to them.
    """

    number: float
    curve: float
    buckled: float


#: one processor model gives bitwise identical results; others and newer libraries round differently, and failing yarns
#: amplify this
LIMITS: dict[Scale, Limits] = {"macro": Limits(0.001, 0.002, 0.001), "meso": Limits(0.01, 0.02, 0.01)}
#: crests fewer or more than in the stored runs: 12 runs do not show all possible numbers
CRESTS = 1.0
#: problem of a run without an entry
MISSING = "not in the baseline, so it is not compared: store it with --update-baseline"


@dataclass(frozen=True)
class Drift:
    """Changes of a case since ``entry``, None if the baseline has none; ``problem`` says what cannot be compared, with
    ``no_room`` only for lack of disk space or memory.
    """

    case: Case
    entry: Entry | None
    changes: tuple[Change, ...] = ()
    problem: str = ""
    is_blocked: bool = False

    @property
    def reasons(self) -> list[str]:
        """Problem and changes that are out of tolerance."""
        failed = [str(change) for change in self.changes if not change.passed]
        return [self.problem, *failed] if self.problem else failed

    @property
    def passed(self) -> bool:
        """Tell whether all was compared and nothing is out of tolerance."""
        return not self.reasons


def drift_of(case: Case, run: Run, record: Record, folder: Path, entry: Entry | None) -> Drift:
    """Drift of ``case`` that ran in ``folder``; raises :class:`InputError` if its curve is missing."""
    if record.status != "completed":
        return Drift(case, entry, problem=no_result_reason(record), is_blocked=record.status == "blocked")
    if problem := reject_reason(run, record, folder):
        return Drift(case, entry, problem=problem)
    if entry is None:
        return Drift(case, None, problem=MISSING)
    problem = curve_problem(run, entry.curve)
    changes = list(_changes(case, record, entry))
    if not has_configured_speed(run, record.results):
        changes.append(number_change(SPEED, run.solver.speed, record.results[SPEED], 0.0))
    if entry.curve is not None and not problem:
        changes += curve_changes(run, folder, entry.curve, limits_for(case, entry).curve)
    return Drift(case, entry, tuple(changes), problem)


def own_limits(case: Case, entry: Entry) -> Limits | None:
    """Limits of a test that amplifies rounding, for an ``entry`` without the scatter of several runs."""
    own = kinds()[case.test].regression.drift.get(case.scale)
    return Limits(*own) if own and entry.runs == 1 else None


def limits_for(case: Case, entry: Entry) -> Limits:
    """Limits of ``case`` before scatter."""
    return own_limits(case, entry) or LIMITS[case.scale]


def limit_of(case: Case, entry: Entry, name: str) -> float:
    """Limit [-] of the change of the number ``name`` of ``case``, which counts no crests, over that in ``entry``."""
    limits, stored = limits_for(case, entry), entry.results[name]
    buckled = entry.runs == 1 and name in kinds()[case.test].regression.buckled
    scatter = SCATTER_FACTOR * entry.scatter.get(name, 0.0) / abs(stored) if stored else 0.0
    return (limits.buckled if buckled else limits.number) + scatter


def crest_range(case: Case, entry: Entry, name: str) -> tuple[int, int] | None:
    """Least and greatest number of the stored runs if ``name`` counts crests, else None."""
    if name not in kinds()[case.test].regression.crests:
        return None
    return entry.ranges.get(name) or (math.floor(entry.results[name]), math.ceil(entry.results[name]))


def change_of(case: Case, entry: Entry, name: str, now: float) -> Change:
    """Change of the stored number ``name`` to ``now``."""
    stored = entry.results[name]
    if crests := crest_range(case, entry, name):
        return Change(name, stored, now, float(now - np.clip(now, *crests)), CRESTS, crests)
    return number_change(name, stored, now, limit_of(case, entry, name))


def _changes(case: Case, record: Record, entry: Entry) -> Iterator[Change]:
    assert record.cost is not None
    yield number_change("elements", entry.elements, record.cost["elements"], 0.0)
    for name in entry.results:
        yield change_of(case, entry, name, record.results.get(name, math.nan))
    for name, now in numbers_of(record).items():
        if name not in entry.results and name not in entry.sometimes:
            yield Change(name, math.nan, now, math.nan, 0.0)
