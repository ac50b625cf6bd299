"""Drift: the code's numbers and curves now against its own stored ones, their limits, and scatter by rounding."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.history import Array
from knittest.base.kinds import kinds
from knittest.config.run import Run, Scale
from knittest.laboratory.after_rest import SPEED, kept_speed
from knittest.laboratory.report_base import REPORTS
from knittest.studies.regress.baseline import Curve, Entry, fault_of, has_curve, numbers_of, points, rounded
from knittest.studies.regress.cases import Case, trial_here
from knittest.studies.regress.judge import no_result
from knittest.studies.trials.trial import Record, Trial


@dataclass(frozen=True)
class Change:
    """One number, or the point of the curve that changed most: as stored (NaN: not), now, and the change [-] it may
    have; of crests ``change`` and ``limit`` are those beyond ``counted``, the least and greatest of the stored runs.
    """

    what: str
    stored: float
    now: float
    change: float
    limit: float
    counted: tuple[int, int] | None = None

    @property
    def passed(self) -> bool:
        """Tell whether the change is within its limit; one that is no number is not."""
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
        return (
            f"{self.what}: {self.stored:.6g} stored, {self.now:.6g} now ({100.0 * self.change:+.3g} %, "
            f"limit {100.0 * self.limit:.3g} %)"
        )


def of_number(name: str, stored: float, now: float, limit: float) -> Change:
    """Change of a number over its stored value."""
    if stored == 0.0:
        return Change(name, stored, now, 0.0 if now == 0.0 else math.inf, limit)
    return Change(name, stored, now, (now - stored) / abs(stored), limit)


def of_crests(name: str, stored: float, now: float, counted: tuple[int, int], limit: float) -> Change:
    """Change of a number of crests beyond those ``counted`` in the stored runs."""
    return Change(name, stored, now, float(now - np.clip(now, *counted)), limit, counted)


def of_new(name: str, now: float) -> Change:
    """Change of a number that has a value now and none in the baseline."""
    return Change(name, math.nan, now, math.nan, 0.0)


# Scatter of a run by rounding: its numbers and curve over runs whose time steps differ by billionths.
#
# Folding sheets and yarns that stick and slip enlarge rounding as far as their states go, and processors, compilers and
# libraries round differently. A change of the step by 1e-9 is far below what the step itself costs in exactness, and
# any change of it above rounding shows the same scatter.

#: runs whose mean and scatter are stored, the one as it is among them
RUNS = 12
#: part by which the step of each is shorter than that of the one before
SHORTER = 1e-9
#: standard deviations that a number may be off the mean: with 12 runs, one in 2000 of a normal scatter is
TIMES = 5.0


def otherwise_rounded(case: Case, trial: Trial) -> list[Trial]:
    """The runs beside ``trial`` by which the scatter of ``case`` is known; none where it does not enlarge rounding."""
    if not case.enlarges:
        return []
    return [trial_here(_shorter(trial.run, number), f"{case.name}, rounding {number}") for number in range(1, RUNS)]


def pooled(entry: Entry, others: Sequence[Entry], curves: Sequence[tuple[Run, Path]], crests: Sequence[str]) -> Entry:
    """``entry`` with the mean of its numbers and those of ``others``, its curve of ``curves`` (runs and folders) too,
    their standard deviations, and the range of what counts ``crests``; numbers that one of them lacks are named alone.
    Raises :class:`InputError` for a lost curve.
    """
    together = [entry.results, *(other.results for other in others)]
    names = [name for name in entry.results if all(name in one for one in together)]
    values = np.array([[one[name] for name in names] for one in together])
    results, scatter = (dict(zip(names, _digits(row), strict=True)) for row in _mean_sd(values))
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
        y = np.array([entry.curve.y, *(np.interp(grid, *points(run, folder)) for run, folder in curves)])
        mean, sd = map(_digits, _mean_sd(y))
        update["curve"] = entry.curve.model_copy(update={"y": mean, "scatter": sd})
    return entry.model_copy(update=update)


def _shorter(run: Run, number: int) -> Run:
    solver = run.solver.model_copy(update={"safety": run.solver.safety * (1.0 - number * SHORTER)})
    return run.model_copy(update={"solver": solver})


def _mean_sd(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return values.mean(axis=0), values.std(axis=0, ddof=1)


def _digits(values: np.ndarray) -> list[float]:
    return [rounded(float(v)) for v in values]


def curve_problem(run: Run, curve: Curve | None) -> str:
    """Reason why the curve of ``run`` cannot be held against the stored one, empty for none."""
    if curve is None:
        return "the baseline has no curve of this run" if has_curve(run) else ""
    if not has_curve(run):
        return "the baseline has a curve, the test has none"
    axes = REPORTS[run.rig.kind].axes
    if (axes.x, axes.y) != (curve.x_name, curve.y_name):
        return f"the baseline has a curve of {curve.y_name} over {curve.x_name}, the test of {axes.y} over {axes.x}"
    return ""


def curve_changes(run: Run, folder: Path, curve: Curve, limit: float) -> list[Change]:
    """Change of the end that moved more, over the length of the stored curve, and of the point that uses most of its
    limit, over its largest value: beyond an end a curve has no value that could be compared.
    """
    x, y = points(run, folder)
    return [_end_change(x, curve, limit), _worst_change(x, y, curve, limit)]


def limits_along(curve: Curve, limit: float) -> Array:
    """Change (n,) that each point may have over the largest value [-]."""
    scatter = np.array(curve.scatter) if curve.scatter else np.zeros(len(curve.y))
    return limit + TIMES * scatter / np.abs(curve.y).max()


def _end_change(x: Array, curve: Curve, limit: float) -> Change:
    ends = [(curve.x[0], float(x[0])), (curve.x[-1], float(x[-1]))]
    stored, now = max(ends, key=lambda end: abs(end[1] - end[0]))
    return Change(f"curve, end in {curve.x_name}", stored, now, (now - stored) / (curve.x[-1] - curve.x[0]), limit)


def _worst_change(x: Array, y: Array, curve: Curve, limit: float) -> Change:
    stored, now = np.array(curve.y), np.interp(curve.x, x, y)
    shares, limits = (now - stored) / np.abs(stored).max(), limits_along(curve, limit)
    worst = int(np.argmax(np.abs(shares) / limits))
    what = f"curve, {curve.y_name} at {curve.x_name} {curve.x[worst]:.4g}"
    return Change(what, float(stored[worst]), float(now[worst]), float(shares[worst]), float(limits[worst]))


@dataclass(frozen=True)
class Limits:
    """Change that a number may have over its stored value, a curve over its largest value, and a number that is
    nothing but buckles over its stored value; to which the scatter by rounding comes where it is stored.
    """

    number: float
    curve: float
    buckled: float


#: one processor model gives the same bits; others and newer libraries round differently, which breaking yarns enlarge
LIMITS: dict[Scale, Limits] = {"macro": Limits(0.001, 0.002, 0.001), "meso": Limits(0.01, 0.02, 0.01)}
#: crests fewer or more than the stored runs have: they come and go as a whole, and 12 runs do not show all there is
CRESTS = 1.0
#: what is said of a run without an entry: nothing judges it
MISSING = "not in the baseline, so nothing judges it: --update-baseline stores it"


@dataclass(frozen=True)
class Drift:
    """Changes of a case since ``entry``, None where the baseline has none; ``problem``: what cannot be compared, and
    with ``no_room`` only because the machine had none.
    """

    case: Case
    entry: Entry | None
    changes: tuple[Change, ...] = ()
    problem: str = ""
    no_room: bool = False

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
    """The drift of ``case`` that ran in ``folder``; raises :class:`InputError` when its curve is gone."""
    if record.status != "completed":
        return Drift(case, entry, problem=no_result(record), no_room=record.status == "blocked")
    if problem := fault_of(run, record, folder):
        return Drift(case, entry, problem=problem)
    if entry is None:
        return Drift(case, None, problem=MISSING)
    problem = curve_problem(run, entry.curve)
    changes = list(_changes(case, record, entry))
    if not kept_speed(run, record.results):
        changes.append(of_number(SPEED, run.solver.speed, record.results[SPEED], 0.0))
    if entry.curve is not None and not problem:
        changes += curve_changes(run, folder, entry.curve, limits_for(case, entry).curve)
    return Drift(case, entry, tuple(changes), problem)


def own_limits(case: Case, entry: Entry) -> Limits | None:
    """Limits of a test that enlarges rounding, for an ``entry`` without the scatter of several runs."""
    own = kinds()[case.test].regression.drift.get(case.scale)
    return Limits(*own) if own and entry.runs == 1 else None


def limits_for(case: Case, entry: Entry) -> Limits:
    """Limits of ``case`` before scatter."""
    return own_limits(case, entry) or LIMITS[case.scale]


def limit_of(case: Case, entry: Entry, name: str) -> float:
    """Change [-] that the number ``name`` of ``case``, which counts no crests, may have over that in ``entry``."""
    limits, stored = limits_for(case, entry), entry.results[name]
    buckled = entry.runs == 1 and name in kinds()[case.test].regression.buckled
    scatter = TIMES * entry.scatter.get(name, 0.0) / abs(stored) if stored else 0.0
    return (limits.buckled if buckled else limits.number) + scatter


def counted(case: Case, entry: Entry, name: str) -> tuple[int, int] | None:
    """Least and greatest of the stored runs where ``name`` counts crests, None where it does not."""
    if name not in kinds()[case.test].regression.crests:
        return None
    return entry.ranges.get(name) or (math.floor(entry.results[name]), math.ceil(entry.results[name]))


def change_of(case: Case, entry: Entry, name: str, now: float) -> Change:
    """Change of the stored number ``name`` to ``now``."""
    stored = entry.results[name]
    if crests := counted(case, entry, name):
        return of_crests(name, stored, now, crests, CRESTS)
    return of_number(name, stored, now, limit_of(case, entry, name))


def _changes(case: Case, record: Record, entry: Entry) -> Iterator[Change]:
    assert record.cost is not None
    yield of_number("elements", entry.elements, record.cost["elements"], 0.0)
    for name in entry.results:
        yield change_of(case, entry, name, record.results.get(name, math.nan))
    for name, now in numbers_of(record).items():
        if name not in entry.results and name not in entry.sometimes:
            yield of_new(name, now)
