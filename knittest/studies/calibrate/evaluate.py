"""Points of a calibration: the trials of each, found in the ledger or run, and how far they are from the targets."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from knittest.base.errors import InputError, KnittestError, ResourceError
from knittest.base.history import Array
from knittest.studies.calibrate.problem import Problem, described
from knittest.studies.trials.record import Record
from knittest.studies.trials.runner import TrialRunner
from knittest.studies.trials.trial import Trial, trial_of

Point = tuple[float, ...]


class Exhausted(KnittestError):
    """The most runs that were allowed are used up."""


@dataclass(frozen=True)
class Evaluation:
    """Outcome of the tests at ``values``; ``reason`` says why there is no number, and is empty where there is one.

    ``simulated`` is that of each target and ``deviations`` (m,) are over sd, a number one, a curve several;
    ``weights`` (m,). ``records`` are by test.
    """

    number: int
    values: Point
    records: dict[str, Record]
    simulated: tuple[float, ...] = ()
    deviations: Array | None = None
    weights: Array | None = None
    reason: str = ""

    @property
    def good(self) -> bool:
        """Tell whether there are numbers."""
        return self.deviations is not None

    @property
    def residuals(self) -> Array:
        """Weighted deviations (m,)."""
        if self.deviations is None or self.weights is None:
            raise ValueError(f"no numbers at {self.values}: {self.reason}")
        residuals: Array = np.sqrt(self.weights) * self.deviations
        return residuals


class Evaluator(Protocol):
    """Interface that the searches ask for evaluations."""

    problem: Problem
    history: list[Evaluation]

    def many(self, points: Sequence[Point]) -> list[Evaluation]:
        """Evaluations of ``points``, all at once; each point is evaluated once in a calibration."""


class TrialEvaluator:
    """Runs the tests of ``problem`` as trials of ``runner``; ``tell`` hears of every point that is done, ``ended``
    of every trial.

    Raises :class:`Exhausted` instead of going over the runs allowed, :class:`ResourceError` when the machine has no
    room for a trial, :class:`InputError` for a target that no test has.
    """

    def __init__(
        self,
        problem: Problem,
        runner: TrialRunner,
        tell: Callable[[Evaluation], None],
        ended: Callable[[Trial, Record], None],
    ) -> None:
        self.problem, self.history = problem, list[Evaluation]()
        self._runner, self._tell, self._ended = runner, tell, ended
        self._known: dict[Point, Evaluation] = {}
        self._asked: set[str] = set()
        self._records: dict[str, Record] = {}

    def many(self, points: Sequence[Point]) -> list[Evaluation]:
        """See :meth:`Evaluator.many`."""
        new = [point for point in dict.fromkeys(points) if point not in self._known]
        trials = {point: self._trials(point) for point in new}
        self._run([t for found in trials.values() if isinstance(found, dict) for t in found.values()])
        for point in new:
            evaluation = self._judged(point, trials[point])
            self._known[point] = evaluation
            self.history.append(evaluation)
            self._tell(evaluation)
        return [self._known[point] for point in points]

    def _trials(self, point: Point) -> dict[str, Trial] | str:
        """The trials at ``point`` by test, or why the input is refused there."""
        label = described(point, self.problem.parameters)
        try:
            return {c.name: trial_of(self.problem.run(c, point), f"{c.name}: {label}") for c in self.problem.cases}
        except InputError as error:
            return f"invalid: {error}"

    def _run(self, trials: Sequence[Trial]) -> None:
        wanted = {trial.key: trial for trial in trials if trial.key not in self._asked}
        most = self.problem.calibration.max_runs
        if len(self._asked) + len(wanted) > most:
            raise Exhausted(f"max_runs = {most} runs were not enough")
        self._asked |= wanted.keys()
        for record in self._runner.run(list(wanted.values())):
            self._records[record.key] = record
            self._ended(wanted[record.key], record)
            if record.status == "blocked":
                raise ResourceError(f"{record.reason}; what is finished is kept, run the same command again to go on")

    def _judged(self, point: Point, trials: dict[str, Trial] | str) -> Evaluation:
        number = len(self.history) + 1
        if isinstance(trials, str):
            return Evaluation(number, point, {}, reason=trials)
        records = {name: self._records[trial.key] for name, trial in trials.items()}
        lost = [f"{name} {r.status}: {r.reason}" for name, r in records.items() if r.status != "completed"]
        if lost:
            return Evaluation(number, point, records, reason="; ".join(lost))
        simulated, deviations, weights = [], [], []
        for target in self.problem.targets:
            record, folder = records[target.test], self._runner.place(trials[target.test])
            simulated.append(target.simulated(record, folder))
            deviations.append(target.deviations(record, folder))
            weights.append(np.full(len(deviations[-1]), target.weight))
        return Evaluation(number, point, records, tuple(simulated), np.concatenate(deviations), np.concatenate(weights))
