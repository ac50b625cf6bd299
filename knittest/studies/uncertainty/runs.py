"""Runs of the design: a trial for every point and fabric, and the numbers that its record gives."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.base.kinds import kinds
from knittest.config.messages import unknown
from knittest.studies.trials.record import OPEN, Record
from knittest.studies.trials.trial import Trial, trial_of
from knittest.studies.uncertainty.design import design, matrix_name
from knittest.studies.uncertainty.problem import Problem
from knittest.studies.uncertainty.variables import results_of


@dataclass(frozen=True)
class Planned:
    """The run of ``fabric`` at row ``row`` of the part ``part`` of the design, where the parameters are ``values``.

    ``problem`` says why the input is refused there, and is empty where there is a trial.
    """

    part: int
    row: int
    fabric: str
    values: tuple[float, ...]
    trial: Trial | None
    problem: str = ""

    def ended(self, records: Mapping[str, Record]) -> tuple[str, str]:
        """Status and reason."""
        if self.trial is None:
            return "invalid", self.problem
        record = records.get(self.trial.key)
        return (record.status, record.reason) if record else (OPEN, "not run yet")


def values_of(problem: Problem) -> Array:
    """Values (parts, n, d) of the parameters over the design."""
    study = problem.study
    unit = design(len(problem.parameters), study.samples, study.seed)[: problem.parts]
    return np.stack([one.values(unit[..., k]) for k, one in enumerate(problem.parameters)], axis=-1)


def planned(problem: Problem) -> list[Planned]:
    """All runs; a draw that the schema refuses makes one with a problem."""
    values = values_of(problem)
    return [
        _planned(problem, part, row, fabric, tuple(float(v) for v in values[part, row]))
        for part, row in np.ndindex(values.shape[:2])
        for fabric in problem.cases
    ]


def _planned(problem: Problem, part: int, row: int, fabric: str, values: tuple[float, ...]) -> Planned:
    names = [one.name for one in problem.parameters]
    label = f"{fabric}, {matrix_name(part, names)}, row {row + 1}"
    try:
        return Planned(part, row, fabric, values, trial_of(problem.run(fabric, values), label))
    except InputError as error:
        return Planned(part, row, fabric, values, None, str(error))


def numbers_of(problem: Problem, runs: Sequence[Planned], records: Mapping[str, Record]) -> dict[str, dict[str, Array]]:
    """Results asked for, by fabric and name, over the design (parts, n), NaN where a run gave none.

    Raises :class:`InputError` for a quantity that no run of the test has.
    """
    names = [name for one in problem.study.quantities.values() for name in results_of(one)]
    shape = (problem.parts, problem.study.samples)
    found = {fabric: {name: np.full(shape, np.nan) for name in names} for fabric in problem.cases}
    known: dict[str, None] = {}
    for one in runs:
        results = records[one.trial.key].results if one.trial and one.trial.key in records else {}
        known |= dict.fromkeys(results)
        for name in names:
            found[one.fabric][name][one.part, one.row] = results.get(name, np.nan)
    if known:
        _check_known(problem, list(known))
    return found


def check_first(problem: Problem, record: Record) -> None:
    """Raise :class:`InputError` where a run completed without any result of a quantity that the test has no label for.

    So a misspelt name ends the study with its first run.
    """
    if record.results:
        kind = next(iter(problem.cases.values())).kind
        _check_known(problem, [*record.results, *kinds()[kind].labels])


def _check_known(problem: Problem, known: list[str]) -> None:
    """Raise :class:`InputError` for a quantity none of whose results is ``known``."""
    for name, one in problem.study.quantities.items():
        if not any(result in known for result in results_of(one)):
            stem = list(dict.fromkeys(result.partition(".")[0] if one.at else result for result in known))
            said = f"{problem.name}.yaml: quantities.{name}.result = {one.result}"
            places = f" at {', '.join(f'{at:g}' for at in one.at)}" if one.at else ""
            raise InputError(f"{said}: no run has it{places}: {unknown(one.result, stem, 'result')}")


def missing(one: Planned, numbers: Mapping[str, Mapping[str, Array]]) -> list[str]:
    """Names of results that the run did not give."""
    return [name for name, found in numbers[one.fabric].items() if not np.isfinite(found[one.part, one.row])]


def points(runs: Sequence[Planned]) -> Iterator[list[Planned]]:
    """Runs of each point of the design, one a fabric, in the order of the design."""
    by: dict[tuple[int, int], list[Planned]] = {}
    for one in runs:
        by.setdefault((one.part, one.row), []).append(one)
    yield from by.values()
