"""New entries of the baseline from finished runs, and the limits that they would widen."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from knittest.base.kinds import kinds
from knittest.studies.regress.baseline import Entry, entry_of, reject_reason, round_to_digits
from knittest.studies.regress.cases import Case
from knittest.studies.regress.drift import CRESTS, Drift, crest_range, limit_of, limits_along, limits_for, pool_entries
from knittest.studies.trials.runner import RESUME_HINT
from knittest.studies.trials.trial import MEANING, Record, Trial

#: largest relative growth of a limit without a request: the standard deviation of 12 runs has an error of a fifth
GROWTH = 0.3
CURVE, WIDEST = "curve, mean over its points", "curve, widest point"

#: limits by name: before, and in the new entry, None if the number is missing there
WidenedLimits = dict[str, tuple[float, float | None]]


def limits_of(case: Case, entry: Entry) -> dict[str, float]:
    """Limits of all numbers [-], of crests the width of the allowed range, and of the curve."""
    found = {}
    for name in entry.results:
        crests = crest_range(case, entry, name)
        found[name] = crests[1] - crests[0] + 2.0 * CRESTS if crests else limit_of(case, entry, name)
    if entry.curve is not None:
        along = limits_along(entry.curve, limits_for(case, entry).curve)
        found |= {CURVE: float(along.mean()), WIDEST: float(along.max())}
    return found


def widened_limits(case: Case, old: Entry, new: Entry) -> WidenedLimits:
    """Limits that grow by more than :data:`GROWTH` over those of ``old`` or its accepted ones, so that small steps do
    not add up; and limits of numbers that are missing now.
    """
    limits = limits_of(case, new)
    pairs = {k: (min(was, old.accepted.get(k, was)), limits.get(k)) for k, was in limits_of(case, old).items()}
    return {name: (was, now) for name, (was, now) in pairs.items() if now is None or now > (1.0 + GROWTH) * was}


def limits_text(case: Case, changed: WidenedLimits) -> str:
    """Limits ``changed`` as text."""

    def limit(name: str, value: float | None) -> str:
        if value is None:
            return "none, as it is missing"
        return f"{value:g} crests" if name in kinds()[case.test].regression.crests else f"{100.0 * value:.3g} %"

    return ", ".join(f"{k} {limit(k, was)} to {limit(k, now)}" for k, (was, now) in changed.items())


def difference_text(case: Case, old: Entry | None, new: Entry, accepted: WidenedLimits) -> str:
    """Difference of the new entry from the old one in a line: the largest change, new numbers, and changed limits."""
    if old is None:
        return f"{case.name}: new" + (f"; only some runs have: {', '.join(new.sometimes)}" if new.sometimes else "")
    was, now = limits_of(case, old), limits_of(case, new)
    both = {name: (was[name], now[name]) for name in was if name in now}
    parts = {
        "new": ", ".join(name for name in new.results if name not in old.results),
        "only some runs have": ", ".join(new.sometimes),
        "accepted as requested": limits_text(case, accepted),
        "wider": limits_text(case, {name: pair for name, pair in both.items() if pair[1] > pair[0]}),
        "narrower": limits_text(case, {name: pair for name, pair in both.items() if pair[1] < pair[0]}),
    }
    changes = [(k, old.results[k], v) for k, v in new.results.items() if old.results.get(k)]
    what, before, value = max(changes, key=lambda row: abs(row[2] / row[1] - 1.0), default=("nothing", 1.0, 1.0))
    share, commit = 100.0 * (value / before - 1.0), (old.commit or "no commit")[:12]
    moved = f"{what} was {before:g} ({commit}), is {value:g} ({share:+.3g} %)" if before != value else "unchanged"
    return "; ".join([f"{case.name}: {moved}", *(f"{name}: {text}" for name, text in parts.items() if text)])


Place = Callable[[Trial], Path]


@dataclass(frozen=True)
class Update:
    """New ``entries`` by case, ``lines`` on their changes, and ``problems`` of completed runs without an entry."""

    entries: dict[str, Entry] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    problems: dict[str, Drift] = field(default_factory=dict)


def update_of(
    trials: Mapping[Case, Trial], others: Mapping[Case, Sequence[Trial]], records: Mapping[str, Record], place: Place,
    before: Mapping[str, Entry], accept: Collection[str],
) -> Update:  # fmt: skip
    """Entries of completed ``trials`` with the scatter of ``others``; wider limits are a problem unless accepted."""
    update = Update()
    for case, trial in trials.items():
        if records[trial.key].status != "completed":
            continue
        old, runs = before.get(case.name), [trial, *others[case]]
        problem, no_room = _lost_run_problem(others[case], records)
        for one in () if problem else runs:
            if fault := reject_reason(one.run, records[one.key], place(one)):
                problem = f"{one.label}: {fault}"
                break
        if not problem:
            new, *again = (entry_of(one.run, records[one.key], place(one)) for one in runs)
            if again:
                curves = [(one.run, place(one)) for one in others[case]]
                new = pool_entries(new, again, curves, kinds()[case.test].regression.crests)
            loosened = widened_limits(case, old, new) if old else {}
            if not loosened or case.name in accept:
                if new.runs > 1:  # later updates are compared with the old limits except the accepted ones
                    known = {**limits_of(case, old), **old.accepted} if old and old.runs > 1 else {}
                    limits = limits_of(case, new).items()
                    kept = {k: round_to_digits(now if k in loosened else known.get(k, now)) for k, now in limits}
                    new = new.model_copy(update={"accepted": kept})
                update.entries[case.name] = new
                update.lines.append(difference_text(case, old, new, loosened))
                continue
            remedy = f"find the cause; if the change is right, accept it with --accept-wider {case.name}"
            problem = f"limits would grow by more than {100.0 * GROWTH:g} %: {limits_text(case, loosened)}: {remedy}"
        update.problems[case.name] = Drift(case, old, problem=f"not stored: {problem}", is_blocked=no_room)
    return update


def _lost_run_problem(others: Sequence[Trial], records: Mapping[str, Record]) -> tuple[str, bool]:
    """Problem of runs that round differently and did not complete, and whether only disk space or memory is missing."""
    lost = [(trial, records[trial.key]) for trial in others if records[trial.key].status != "completed"]
    if not lost:
        return "", False
    trial, record = min(lost, key=lambda one: (one[1].status != "blocked", one[1].settled))
    what = f"{trial.label}, the same run with other rounding, {record.status}: {record.reason}"
    if len(lost) > 1:
        what += f" (and {len(lost) - 1} more of {len(others)} did not complete)"
    meaning = {
        "refused": "a run at the limit of a quality check is no baseline",
        "failed": "a run that fails by rounding alone is no baseline",
    }.get(record.status, f"{MEANING[record.status]}; {RESUME_HINT}")
    return f"{what}; {meaning}", record.status == "blocked"
