"""New entries of the baseline from finished runs."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from knittest.studies.regress.baseline import Entry, entry_of
from knittest.studies.regress.cases import Case
from knittest.studies.regress.rounding import pooled
from knittest.studies.trials.record import Record
from knittest.studies.trials.trial import Trial


@dataclass(frozen=True)
class Update:
    """New ``entries`` by the name of their case; ``problems``: why there is none though the run itself completed."""

    entries: dict[str, Entry] = field(default_factory=dict)
    problems: dict[str, str] = field(default_factory=dict)


def update_of(
    trials: Mapping[Case, Trial],
    others: Mapping[Case, Sequence[Trial]],
    records: Mapping[str, Record],
    place: Callable[[Trial], Path],
) -> Update:
    """Entries of the ``trials`` that completed, with the scatter of those (``others``) that round differently.

    ``records`` are by key. Raises :class:`InputError` when a curve is gone.
    """
    update = Update()
    for case, trial in trials.items():
        if records[trial.key].status != "completed":
            continue
        lost = [records[other.key] for other in others[case] if records[other.key].status != "completed"]
        if lost:
            what = f"the same run, rounded differently, {lost[0].status}: {lost[0].reason}"
            update.problems[case.name] = f"{what}; a run at the edge of a gate guards nothing"
            continue
        entry = entry_of(trial.run, records[trial.key], place(trial))
        if others[case]:
            again = [entry_of(other.run, records[other.key], place(other)) for other in others[case]]
            entry = pooled(entry, again, [(other.run, place(other)) for other in others[case]])
        update.entries[case.name] = entry
    return update
