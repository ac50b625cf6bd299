"""Drift: the code's numbers and curves now against its own stored ones, whatever the experiment says."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.kinds import kinds
from knittest.config.run import Run, Scale
from knittest.studies.regress.baseline import Curve, Entry, has_curve, points
from knittest.studies.regress.cases import Case
from knittest.studies.regress.judge import no_result
from knittest.studies.regress.rounding import TIMES
from knittest.studies.trials.record import Record


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


@dataclass(frozen=True)
class Change:
    """One number, or the point of the curve that changed most: as stored, now, and the change [-] it may have."""

    what: str
    stored: float
    now: float
    change: float
    limit: float

    @property
    def passed(self) -> bool:
        """Tell whether the change is within its limit; one that is no number is not."""
        return abs(self.change) <= self.limit

    def __str__(self) -> str:
        return (
            f"{self.what}: {self.stored:.6g} stored, {self.now:.6g} now ({100.0 * self.change:+.3g} %, "
            f"limit {100.0 * self.limit:.3g} %)"
        )


@dataclass(frozen=True)
class Drift:
    """Changes of a case since ``entry``, None where the baseline has none; ``problem``: nothing to compare."""

    case: Case
    entry: Entry | None
    changes: tuple[Change, ...] = ()
    problem: str = ""

    @property
    def reasons(self) -> list[str]:
        """Changes that are out of tolerance."""
        return [self.problem] if self.problem else [str(change) for change in self.changes if not change.passed]

    @property
    def passed(self) -> bool:
        """Tell whether nothing is out of tolerance; a case without a stored entry is not judged."""
        return not self.reasons

    @property
    def largest(self) -> Change | None:
        """The change that uses most of its limit."""
        return max(self.changes, key=_used, default=None)


def drift_of(case: Case, run: Run, record: Record, folder: Path, entry: Entry | None) -> Drift:
    """The drift of ``case`` that ran in ``folder``; raises :class:`InputError` when its curve is gone."""
    if record.status != "completed":
        return Drift(case, entry, problem=no_result(record))
    if entry is None:
        return Drift(case, None)
    return Drift(case, entry, tuple(_changes(case, run, record, folder, entry)))


def own_limits(case: Case, entry: Entry) -> Limits | None:
    """Limits of a test that enlarges rounding, for an ``entry`` without the scatter of several runs."""
    own = kinds()[case.test].regression.drift.get(case.scale)
    return Limits(*own) if own and entry.runs == 1 else None


def limit_of(case: Case, entry: Entry, name: str) -> float:
    """Change [-] that the number ``name`` of ``case`` may have over that in ``entry``."""
    limits, stored = _limits(case, entry), entry.results[name]
    buckled = entry.runs == 1 and name in kinds()[case.test].regression.buckled
    scatter = TIMES * entry.scatter.get(name, 0.0) / abs(stored) if stored else 0.0
    return (limits.buckled if buckled else limits.number) + scatter


def _limits(case: Case, entry: Entry) -> Limits:
    return own_limits(case, entry) or LIMITS[case.scale]


def _changes(case: Case, run: Run, record: Record, folder: Path, entry: Entry) -> Iterator[Change]:
    assert record.cost is not None
    elements = record.cost["elements"]
    yield Change("elements", entry.elements, elements, elements / entry.elements - 1.0, 0.0)
    for name, stored in entry.results.items():
        now = record.results.get(name, math.nan)
        yield Change(name, stored, now, _relative(stored, now), limit_of(case, entry, name))
    if has_curve(run) and entry.curve is not None:
        yield _curve_change(run, folder, entry.curve, _limits(case, entry).curve)


def _curve_change(run: Run, folder: Path, curve: Curve, limit: float) -> Change:
    """The point that uses most of its limit."""
    stored = np.array(curve.y)
    now, largest = np.interp(curve.x, *points(run, folder)), np.abs(stored).max()
    scatter = np.array(curve.scatter) if curve.scatter else np.zeros_like(stored)
    shares, limits = (now - stored) / largest, limit + TIMES * scatter / largest
    worst = int(np.argmax(np.abs(shares) / limits))
    what = f"curve, {curve.y_name} at {curve.x_name} {curve.x[worst]:.4g}"
    return Change(what, float(stored[worst]), float(now[worst]), float(shares[worst]), float(limits[worst]))


def _relative(stored: float, now: float) -> float:
    if stored == 0.0:
        return 0.0 if now == 0.0 else math.inf
    return (now - stored) / abs(stored)


def _used(change: Change) -> float:
    if not math.isfinite(change.change):
        return math.inf
    if change.limit > 0.0:
        return abs(change.change) / change.limit
    return 0.0 if change.change == 0.0 else math.inf
