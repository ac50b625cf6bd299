"""New entries of the baseline from finished runs."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from knittest.base.kinds import kinds
from knittest.studies.regress.baseline import Entry
from knittest.studies.regress.cases import Case
from knittest.studies.regress.recorded import entry_of, fault_of
from knittest.studies.regress.rounding import pooled
from knittest.studies.regress.widening import GROWTH, accepting, difference, said, wider
from knittest.studies.trials.record import MEANING, Record
from knittest.studies.trials.trial import Trial

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
