"""Problem of a calibration file: its parameters, tests and targets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from knittest.base.errors import InputError
from knittest.config import calibration as file
from knittest.config.run import Run
from knittest.config.yaml_loader import Document, dotted
from knittest.studies.calibrate.parameters import Parameter, parameters_of
from knittest.studies.calibrate.targets import Number, Target, targets_of
from knittest.studies.homogenise.yarn_card import with_cards
from knittest.studies.trials.case import Case, existing, fabric_path, settings_of


@dataclass(frozen=True)
class Problem:
    """Parameters, tests and targets of a calibration."""

    name: str
    calibration: file.Calibration
    parameters: list[Parameter]
    cases: list[Case]
    targets: list[Target]

    def run(self, case: Case, values: Sequence[float]) -> Run:
        """The run of ``case`` with ``values`` of the parameters."""
        pairs = zip(self.parameters, values, strict=True)
        run = case.run([setting for one, value in pairs for setting in one.settings(value, case.kind)])
        return with_cards([run])[0]

    @property
    def method(self) -> file.Method:
        """The method, with ``auto`` decided."""
        asked = self.calibration.method
        if asked != "auto":
            return asked
        return "root" if self.root_hindrance == "" else "least-squares"

    @property
    def root_hindrance(self) -> str:
        """Reason why no root can be looked for; empty if one can."""
        if len(self.parameters) != 1 or len(self.targets) != 1 or not isinstance(self.targets[0], Number):
            return "it takes one parameter, and one number as target"
        return "a prior has no place in it" if self.parameters[0].prior else ""


def problem_of(document: Document, accept_limits: bool = False) -> Problem:
    """The problem in ``document``, raises :class:`InputError` with file and line; limits looser
    than the preset's may be accepted.
    """
    calibration = file.parse_calibration(document)
    cases = [replace(case, accept_limits=accept_limits) for case in _cases(calibration, document)]
    runs = {case.name: case.run() for case in cases}
    parameters = parameters_of(calibration, document, list(runs.values()))
    targets = targets_of(calibration, document, runs)
    idle = [case.name for case in cases if all(target.test != case.name for target in targets)]
    if idle:
        where = document.where(("tests", idle[0]))
        raise InputError(f"{where}: tests.{idle[0]}: no target is about it: add one, or leave the test out")
    problem = Problem(Path(document.source).stem, calibration, parameters, cases, targets)
    _check_bounds(problem)
    if calibration.method == "root" and problem.root_hindrance:
        raise InputError(f"{document.where(('method',))}: method = root: {problem.root_hindrance}")
    if calibration.storage is not None and calibration.method != "optuna":
        raise InputError(f"{document.where(('storage',))}: storage: only method = optuna has a database")
    return problem


def _check_bounds(problem: Problem) -> None:
    """Raise :class:`InputError` when the schema refuses a bound."""
    for case in problem.cases:
        for parameter in problem.parameters:
            for bound in (parameter.low, parameter.high):
                case.run(parameter.settings(bound, case.kind))


def _cases(calibration: file.Calibration, document: Document) -> list[Case]:
    folder = Path(document.source).resolve().parent
    fabric = fabric_path(calibration.base, document, ("base",))
    found = []
    for name, test in calibration.tests.items():
        at = ("tests", name)
        config = None if test.config is None else existing(folder / test.config, document.where((*at, "config")))
        settings = [*settings_of(calibration.base, document, ("base",)), *settings_of(test, document, at)]
        found.append(Case(name, test.test, fabric, config, tuple(settings)))
    return found


def described(values: Sequence[float], parameters: Sequence[Parameter]) -> str:
    """``strain.warp=1.75 ...``: a point in a line."""
    pairs = zip(parameters, values, strict=True)
    return ", ".join(f"{'.'.join(dotted(p.paths[0]).split('.')[-2:])}={value:.5g}" for p, value in pairs)
