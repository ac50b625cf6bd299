"""Drift: the code's numbers and curves now against its own stored ones, whatever the experiment says."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from knittest.base.kinds import kinds
from knittest.config.run import Run, Scale
from knittest.laboratory.lowered_speed import SPEED, kept_speed
from knittest.studies.regress.baseline import Entry
from knittest.studies.regress.cases import Case
from knittest.studies.regress.change import Change, of_crests, of_new, of_number
from knittest.studies.regress.curve_drift import curve_changes, curve_problem
from knittest.studies.regress.judge import no_result
from knittest.studies.regress.recorded import fault_of, numbers_of
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
