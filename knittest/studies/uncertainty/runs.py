"""Runs of the design: a trial for every point and fabric, and the results of its record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.base.kinds import kinds
from knittest.config.messages import unknown_name_text
from knittest.studies.trials.trial import OPEN, Record, Trial, trial_of
from knittest.studies.uncertainty.problem import Problem, design, matrix_name
from knittest.studies.uncertainty.variables import results_of

#: statuses of a run after which a shorter one may pass: locked loops stop a run before it begins, and a run that hung
#: or died would do so again
REPEATED_STATUSES = ("refused", "failed")


@dataclass(frozen=True)
class Attempt:
    """Run to its full end, or to the shorter ``end``; without a trial, ``problem`` says why the input is invalid."""

    trial: Trial | None
    problem: str = ""
    end: float | None = None

    def ended(self, records: Mapping[str, Record]) -> tuple[str, str]:
        """Status and reason."""
        if self.trial is None:
            return "invalid", self.problem
        record = records.get(self.trial.key)
        return (record.status, record.reason) if record else (OPEN, "not run yet")

    @property
    def key(self) -> str:
        """Key of the trial; empty without one."""
        return self.trial.key if self.trial else ""

    def results(self, records: Mapping[str, Record]) -> dict[str, float]:
        """Results of a completed run; empty for any other."""
        return records[self.key].results if self.key in records else {}


@dataclass(frozen=True)
class PlannedRun:
    """Run of ``fabric`` at row ``row`` of the part ``part`` of the design, with ``values`` of the parameters.

    ``attempts`` are the run to the full end and, if it failed on the way, runs to shorter ends, one after the other.
    The last one counts, if it passed.
    """

    part: int
    row: int
    fabric: str
    values: tuple[float, ...]
    attempts: tuple[Attempt, ...]

    @property
    def full(self) -> Attempt:
        """Attempt to the full end."""
        return self.attempts[0]

    @property
    def last(self) -> Attempt:
        """Attempt that counts, if it passed."""
        return self.attempts[-1]


def values_of(problem: Problem) -> Array:
    """Values (parts, n, d) of the parameters over the design."""
    study = problem.study
    unit = design(len(problem.parameters), study.samples, study.seed)[: problem.parts]
    return np.stack([one.values(unit[..., k]) for k, one in enumerate(problem.parameters)], axis=-1)


def plan_runs(problem: Problem) -> list[PlannedRun]:
    """All runs; a draw that the schema rejects makes a run with a problem."""
    values = values_of(problem)
    runs = [
        PlannedRun(part, row, fabric, tuple(values[part, row].tolist()), ())
        for part, row in np.ndindex(values.shape[:2])
        for fabric in problem.cases
    ]
    return [replace(one, attempts=(_attempt(problem, one),)) for one in runs]


def _attempt(problem: Problem, one: PlannedRun, end: float | None = None) -> Attempt:
    """Attempt of ``one`` to its full end, or to the shorter ``end``."""
    label = f"{one.fabric}, {matrix_name(one.part, [p.name for p in problem.parameters])}, row {one.row + 1}"
    label += "" if end is None else f", to {end:g}"
    try:
        return Attempt(trial_of(problem.run(one.fabric, one.values, end), label), end=end)
    except InputError as error:
        return Attempt(None, str(error), end)


def add_shorter_attempts(
    problem: Problem, runs: Sequence[PlannedRun], records: Mapping[str, Record]
) -> list[PlannedRun]:
    """Add to ``runs`` all attempts to shorter ends that follow from ``records``."""
    found = []
    for one in runs:
        for end in problem.shorter.values[len(one.attempts) - 1 :]:
            if one.last.ended(records)[0] not in REPEATED_STATUSES:
                break
            one = replace(one, attempts=(*one.attempts, _attempt(problem, one, end)))
        found.append(one)
    return found


def numbers_of(
    problem: Problem, runs: Sequence[PlannedRun], records: Mapping[str, Record]
) -> dict[str, dict[str, Array]]:
    """Requested results over the design, NaN without one; raises :class:`InputError` for an unknown quantity."""
    quantities = problem.study.quantities.values()
    names = [name for one in quantities for name in results_of(one)]
    sooner = [name for one in quantities if one.at or one.any_end for name in results_of(one)]
    shape = (problem.parts, problem.study.samples)
    found = {fabric: {name: np.full(shape, np.nan) for name in names} for fabric in problem.cases}
    known: dict[str, None] = {}
    for run in runs:
        known |= dict.fromkeys(run.full.results(records))
        results = run.last.results(records)
        for name in names if run.last.end is None else sooner:  # others are not those of the full end
            found[run.fabric][name][run.part, run.row] = results.get(name, np.nan)
    if known:
        _check_known(problem, list(known))
    return found


def check_first_run(problem: Problem, record: Record) -> None:
    """Raise :class:`InputError` after the first run for a quantity that neither it nor the labels of its test have."""
    if record.results:
        kind = next(iter(problem.cases.values())).kind
        _check_known(problem, [*record.results, *kinds()[kind].labels])


def _check_known(problem: Problem, known: list[str]) -> None:
    """Raise :class:`InputError` for a quantity without a ``known`` result."""
    for name, one in problem.study.quantities.items():
        if not any(result in known for result in results_of(one)):
            stem = list(dict.fromkeys(result.partition(".")[0] if one.at else result for result in known))
            where = f"{problem.name}.yaml: quantities.{name}.result = {one.result}"
            places = f" at {', '.join(f'{at:g}' for at in one.at)}" if one.at else ""
            raise InputError(
                f"{where}: no run has this result{places}: {unknown_name_text(one.result, stem, 'result')}"
            )
