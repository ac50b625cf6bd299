"""Problem of a calibration: its parameters, tests and targets, and the evaluation of points."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.errors import InputError, KnittestError, ResourceError
from knittest.base.history import Array
from knittest.config import studies as file
from knittest.config.base import Quantity
from knittest.config.fields import field_at
from knittest.config.quality_checks import field_value
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.yaml_loader import Document, KeyPath, dotted_path
from knittest.studies.calibrate.targets import NumberTarget, Target, targets_of
from knittest.studies.homogenise.derived_card import complete_cards
from knittest.studies.trials.case import Case, fabric_path, number_paths, round_to_trial, settings_of, sibling_file
from knittest.studies.trials.runner import RESUME_HINT, TrialRunner
from knittest.studies.trials.trial import Record, Trial, trial_of


@dataclass(frozen=True)
class Parameter:
    """Number between ``low`` and ``high``, the same at all ``paths`` of a run; ``prior`` is its mean and sd."""

    paths: tuple[KeyPath, ...]
    unit: str
    low: float
    high: float
    start: float
    log: bool
    prior: tuple[float, float] | None
    where: str

    @property
    def name(self) -> str:
        """Dotted path of the first field."""
        return dotted_path(self.paths[0])

    def value(self, position: float) -> float:
        """Value at ``position``, 0 at ``low`` and 1 at ``high``."""
        p = min(max(float(position), 0.0), 1.0)
        found = self.low * (self.high / self.low) ** p if self.log else self.low + p * (self.high - self.low)
        return round_to_trial(found, self.low, self.high)

    def position(self, value: float) -> float:
        """Position of ``value``, the inverse of :meth:`value`."""
        if self.log:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def span(self, value: float) -> float:
        """Change over the whole bounds by the slope at ``value``."""
        return value * float(np.log(self.high / self.low)) if self.log else self.high - self.low

    def settings(self, value: float, kind: str) -> list[Setting]:
        """Settings of ``value`` at the paths that a test of ``kind`` has."""
        return [Setting(path, value, self.where) for path in self.paths if field_at(path, kind) is not None]


def parameters_of(calibration: file.Calibration, document: Document, runs: Sequence[Run]) -> list[Parameter]:
    """All parameters; raises :class:`InputError` for a field that no run has, is no number, or is given twice."""
    kinds = [run.rig.kind for run in runs]
    found, claimed = [], dict[KeyPath, str]()
    for name, one in calibration.parameters.items():
        where = document.place_of(("parameters", name))
        paths = number_paths([name, *one.also], where, kinds, claimed)
        prior = None if one.mean is None or one.sd is None else (one.mean, one.sd)
        field = next(field for kind in kinds if (field := field_at(paths[0], kind)))
        start = _start_value(one, current_number(paths[0], runs))
        found.append(Parameter(paths, field.unit, one.low, one.high, start, one.spacing == "log", prior, where))
    return found


def _start_value(one: file.Parameter, here: Quantity | float | None) -> float:
    for value in (one.start, one.mean, here.value if isinstance(here, Quantity) else here):
        if value is not None and one.low <= value <= one.high:
            return value
    return float(np.sqrt(one.low * one.high)) if one.spacing == "log" else 0.5 * (one.low + one.high)


def current_number(path: KeyPath, runs: Sequence[Run]) -> Quantity | float | None:
    """Number at ``path`` in the first run that has it; ``None`` for anything but a number."""
    run: Any = next((run for run in runs if field_at(path, run.rig.kind) is not None), None)
    value = None if run is None else field_value(run, dotted_path(path))
    return value if isinstance(value, Quantity | int | float) else None


@dataclass(frozen=True)
class Problem:
    """Parameters, tests and targets of a calibration."""

    name: str
    calibration: file.Calibration
    parameters: list[Parameter]
    cases: list[Case]
    targets: list[Target]

    def run(self, case: Case, values: Sequence[float]) -> Run:
        """Run of ``case`` with ``values`` of the parameters."""
        pairs = zip(self.parameters, values, strict=True)
        run = case.run([setting for one, value in pairs for setting in one.settings(value, case.kind)])
        return complete_cards([run])[0]

    @property
    def method(self) -> file.Method:
        """The method, with ``auto`` decided."""
        asked = self.calibration.method
        if asked != "auto":
            return asked
        return "root" if self.root_hindrance == "" else "least-squares"

    @property
    def root_hindrance(self) -> str:
        """Reason why the method root does not fit; empty if it does."""
        if len(self.parameters) != 1 or len(self.targets) != 1 or not isinstance(self.targets[0], NumberTarget):
            return "expected one parameter, and one number as target"
        return "expected a parameter without a prior" if self.parameters[0].prior else ""


def problem_of(document: Document, accept_limits: bool = False) -> Problem:
    """Read the problem in ``document``; raises :class:`InputError` with file and line."""
    calibration = file.parse_calibration(document)
    base = settings_of(calibration.base, document, ("base",))
    fabric = fabric_path(calibration.base, document, ("base",))
    cases = []
    for name, test in calibration.tests.items():
        at = ("tests", name)
        config = test.config and sibling_file(document, test.config, document.place_of((*at, "config")))
        settings = (*base, *settings_of(test, document, at))
        cases.append(Case(name, test.test, fabric, config or None, settings, accept_limits))
    runs = {case.name: case.run() for case in cases}
    parameters = parameters_of(calibration, document, list(runs.values()))
    targets = targets_of(calibration, document, runs)
    idle = [case.name for case in cases if all(target.test != case.name for target in targets)]
    if idle:
        where = document.place_of(("tests", idle[0]))
        raise InputError(f"{where}: tests.{idle[0]}: no target belongs to this test: add one, or remove the test")
    problem = Problem(Path(document.source).stem, calibration, parameters, cases, targets)
    for case in cases:
        for parameter in parameters:
            for bound in (parameter.low, parameter.high):
                case.run(parameter.settings(bound, case.kind))  # the schema may reject a bound
    if calibration.method == "root" and problem.root_hindrance:
        raise InputError(f"{document.place_of(('method',))}: method = root: {problem.root_hindrance}")
    if calibration.storage is not None and calibration.method != "optuna":
        raise InputError(f"{document.place_of(('storage',))}: storage: only method = optuna uses a database")
    return problem


def describe_point(values: Sequence[float], parameters: Sequence[Parameter]) -> str:
    """``strain.warp=1.75, ...``: a point in a line."""
    pairs = zip(parameters, values, strict=True)
    return ", ".join(f"{'.'.join(dotted_path(p.paths[0]).split('.')[-2:])}={value:.5g}" for p, value in pairs)


Point = tuple[float, ...]


class RunLimitReached(KnittestError):
    """The largest allowed number of runs is reached."""


@dataclass(frozen=True)
class Evaluation:
    """Results of the tests at ``values``; ``reason`` says why there is no result, and is empty where there is one.

    ``simulated`` has a number for each target. ``deviations`` (m,) over sd and ``weights`` (m,) have one value for a
    number and several for a curve. ``records`` are by test.
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
        """Tell whether there is a result."""
        return self.deviations is not None

    @property
    def residuals(self) -> Array:
        """Weighted deviations (m,)."""
        if self.deviations is None or self.weights is None:
            raise ValueError(f"no result at {self.values}: {self.reason}")
        return np.sqrt(self.weights) * self.deviations


class Evaluator:
    """Runs the tests of ``problem`` as trials of ``runner``; ``tell`` gets every evaluation, ``ended`` every record.

    Raises :class:`RunLimitReached` before it exceeds the allowed number of runs, :class:`ResourceError` if the
    machine has no room for a trial, :class:`InputError` for a target that no test has.
    """

    def __init__(
        self, problem: Problem, runner: TrialRunner, tell: Callable[[Evaluation], None],
        ended: Callable[[Trial, Record], None],
    ) -> None:  # fmt: skip
        self.problem, self.history = problem, list[Evaluation]()
        self._runner, self._tell, self._ended = runner, tell, ended
        self._known: dict[Point, Evaluation] = {}
        self._asked: set[str] = set()
        self._records: dict[str, Record] = {}

    def evaluate_points(self, points: Sequence[Point]) -> list[Evaluation]:
        """Evaluate ``points`` in parallel; each point is evaluated once in a calibration."""
        new = [point for point in dict.fromkeys(points) if point not in self._known]
        trials = {point: self._trials(point) for point in new}
        self._run([t for found in trials.values() if isinstance(found, dict) for t in found.values()])
        for point in new:
            evaluation = self._evaluation(point, trials[point])
            self._known[point] = evaluation
            self.history.append(evaluation)
            self._tell(evaluation)
        return [self._known[point] for point in points]

    def _trials(self, point: Point) -> dict[str, Trial] | str:
        """Trials at ``point`` by test, or the reason why its input is invalid."""
        label = describe_point(point, self.problem.parameters)
        try:
            return {c.name: trial_of(self.problem.run(c, point), f"{c.name}: {label}") for c in self.problem.cases}
        except InputError as error:
            return f"invalid: {error}"

    def _run(self, trials: Sequence[Trial]) -> None:
        wanted = {trial.key: trial for trial in trials if trial.key not in self._asked}
        most = self.problem.calibration.max_runs
        if len(self._asked) + len(wanted) > most:
            raise RunLimitReached(f"the search needs more than max_runs = {most} runs")
        self._asked |= wanted.keys()
        for record in self._runner.run(list(wanted.values())):
            self._records[record.key] = record
            self._ended(wanted[record.key], record)
            if record.status == "blocked":
                raise ResourceError(f"{record.reason}; {RESUME_HINT}")

    def _evaluation(self, point: Point, trials: dict[str, Trial] | str) -> Evaluation:
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
