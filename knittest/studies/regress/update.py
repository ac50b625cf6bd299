"""New entries of the baseline from finished runs, and limits that they would loosen."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from knittest.base.kinds import kinds
from knittest.studies.regress.baseline import Entry, entry_of, fault_of, rounded
from knittest.studies.regress.cases import Case
from knittest.studies.regress.drift import CRESTS, counted, limit_of, limits_along, limits_for, pooled
from knittest.studies.trials.trial import MEANING, Record, Trial

#: share by which a limit may grow unasked: the standard deviation of 12 runs is itself known to a fifth
GROWTH = 0.3
CURVE, WIDEST = "curve, mean over its points", "curve, widest point"

#: by name of a limit: before, and in the new entry, None where that has no such number
Wider = dict[str, tuple[float, float | None]]


def limits_of(case: Case, entry: Entry) -> dict[str, float]:
    """Limits of all numbers [-], of crests the width of what passes, and of the curve."""
    found = {}
    for name in entry.results:
        crests = counted(case, entry, name)
        found[name] = crests[1] - crests[0] + 2.0 * CRESTS if crests else limit_of(case, entry, name)
    if entry.curve is not None:
        along = limits_along(entry.curve, limits_for(case, entry).curve)
        found |= {CURVE: float(along.mean()), WIDEST: float(along.max())}
    return found


def wider(case: Case, old: Entry, new: Entry) -> Wider:
    """Limits that grow by more than :data:`GROWTH` over those of ``old``, or over those it was judged by, so that small
    steps do not add up; and limits of numbers that are gone, which nothing holds any more.
    """
    limits = limits_of(case, new)
    pairs = {k: (min(was, old.accepted.get(k, was)), limits.get(k)) for k, was in limits_of(case, old).items()}
    return {name: (was, now) for name, (was, now) in pairs.items() if now is None or now > (1.0 + GROWTH) * was}


def accepting(case: Case, old: Entry | None, new: Entry, accepted: Mapping[str, object]) -> Entry:
    """``new`` with the limits that later updates are judged by: those of ``old`` but for the ``accepted``."""
    if new.runs == 1:
        return new
    before = {**limits_of(case, old), **old.accepted} if old and old.runs > 1 else {}
    limits = limits_of(case, new)
    kept = {k: rounded(now if k in accepted else before.get(k, now)) for k, now in limits.items()}
    return new.model_copy(update={"accepted": kept})


def said(case: Case, loosened: Wider) -> str:
    """Limits ``loosened``, or narrowed, as text."""
    return ", ".join(f"{k} {_limit(case, k, was)} to {_limit(case, k, now)}" for k, (was, now) in loosened.items())


def difference(case: Case, old: Entry | None, new: Entry, accepted: Wider) -> str:
    """The new entry beside the former one in a line: the number that changed most, what came, went, and each limit."""
    if old is None:
        return f"{case.name}: new" + (f"; only some runs have: {', '.join(new.sometimes)}" if new.sometimes else "")
    was, now = limits_of(case, old), limits_of(case, new)
    both = {name: (was[name], now[name]) for name in was if name in now}
    parts = {
        "new": ", ".join(name for name in new.results if name not in old.results),
        "only some runs have": ", ".join(new.sometimes),
        "accepted as asked": said(case, accepted),
        "wider": said(case, {name: pair for name, pair in both.items() if pair[1] > pair[0]}),
        "narrower": said(case, {name: pair for name, pair in both.items() if pair[1] < pair[0]}),
    }
    return "; ".join([f"{case.name}: {_moved(old, new)}", *(f"{what}: {text}" for what, text in parts.items() if text)])


def _limit(case: Case, name: str, value: float | None) -> str:
    if value is None:
        return "none, as it is gone"
    return f"{value:g} crests" if name in kinds()[case.test].regression.crests else f"{100.0 * value:.3g} %"


def _moved(old: Entry, new: Entry) -> str:
    both = [(k, old.results[k], v) for k, v in new.results.items() if old.results.get(k)]
    what, was, now = max(both, key=lambda row: abs(row[2] / row[1] - 1.0), default=("nothing", 1.0, 1.0))
    if was == now:
        return "as before"
    share, commit = 100.0 * (now / was - 1.0), (old.commit or "no commit")[:12]
    return f"{what} was {was:g} ({commit}), is {now:g} ({share:+.3g} %)"


Place = Callable[[Trial], Path]


@dataclass(frozen=True)
class Problem:
    """Reason why a run that completed is not stored; with ``no_room`` only because the machine had none."""

    text: str
    no_room: bool = False


@dataclass(frozen=True)
class Update:
    """New ``entries`` by the name of their case, ``lines`` that say what is new in each, and ``problems``, by name: why
    there is no entry though the run itself completed.
    """

    entries: dict[str, Entry] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    problems: dict[str, Problem] = field(default_factory=dict)


def update_of(
    trials: Mapping[Case, Trial],
    others: Mapping[Case, Sequence[Trial]],
    records: Mapping[str, Record],
    place: Place,
    before: Mapping[str, Entry],
    accept: Collection[str],
) -> Update:
    """Entries of the ``trials`` that completed, with the scatter of those (``others``) that round differently.

    ``records`` are by key. An entry whose limits are wider than those ``before`` is a problem, unless the name of its
    run is one to ``accept``. Raises :class:`InputError` when a curve is gone.
    """
    update = Update()
    for case, trial in trials.items():
        if records[trial.key].status != "completed":
            continue
        if problem := _lost(others[case], records) or _faulty([trial, *others[case]], records, place):
            update.problems[case.name] = problem
            continue
        old, new = before.get(case.name), _entry(case, trial, others[case], records, place)
        loosened = wider(case, old, new) if old else {}
        if loosened and case.name not in accept:
            update.problems[case.name] = Problem(
                f"not stored: limits would grow by more than {100.0 * GROWTH:g} %: {said(case, loosened)}: find out "
                f"why, and if it is right, accept them by --accept-wider {case.name}"
            )
            continue
        update.entries[case.name] = accepting(case, old, new, loosened)
        update.lines.append(difference(case, old, new, loosened))
    return update


def _entry(case: Case, trial: Trial, others: Sequence[Trial], records: Mapping[str, Record], place: Place) -> Entry:
    first, *again = (entry_of(one.run, records[one.key], place(one)) for one in (trial, *others))
    if not again:
        return first
    return pooled(first, again, [(one.run, place(one)) for one in others], kinds()[case.test].regression.crests)


def _lost(others: Sequence[Trial], records: Mapping[str, Record]) -> Problem | None:
    """The problem of runs that round differently and did not complete, first that of a machine without room."""
    lost = [(trial, records[trial.key]) for trial in others if records[trial.key].status != "completed"]
    if not lost:
        return None
    trial, record = min(lost, key=lambda one: (one[1].status != "blocked", one[1].settled))
    what = f"{trial.label}, the same run with other rounding, {record.status}: {record.reason}"
    if len(lost) > 1:
        what += f" (and {len(lost) - 1} more of {len(others)} did not complete)"
    meaning = {
        "refused": "a run at the edge of a gate guards nothing",
        "failed": "a run that rounding alone makes fail guards nothing",
    }.get(record.status, f"{MEANING[record.status]}; what is finished is kept: run again")
    return Problem(f"not stored: {what}; {meaning}", record.status == "blocked")


def _faulty(trials: Sequence[Trial], records: Mapping[str, Record], place: Place) -> Problem | None:
    """The problem of the first run that cannot be stored."""
    for trial in trials:
        if fault := fault_of(trial.run, records[trial.key], place(trial)):
            return Problem(f"not stored: {trial.label}: {fault}")
    return None
