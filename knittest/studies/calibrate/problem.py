"""Problem of a calibration file: its parameters, tests and targets."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.config import calibration as file
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
from knittest.config.yaml_loader import Document, dotted
from knittest.studies.calibrate.parameters import Parameter, parameters_of
from knittest.studies.calibrate.targets import Number, Target, targets_of


@dataclass(frozen=True)
class Case:
    """One test of the fabric file ``fabric``."""

    name: str
    kind: str
    fabric: Path
    config: Path | None
    settings: tuple[Setting, ...]
    accept_limits: bool = False

    def run(self, settings: Sequence[Setting] = ()) -> Run:
        """The run with ``settings``; raises :class:`InputError` where the schema refuses them."""
        return resolve(
            test=self.kind, fabric=self.fabric, config=self.config, sets=[*self.settings, *settings],
            accept_limits=self.accept_limits,
        )  # fmt: skip


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
        return case.run([setting for one, value in pairs for setting in one.settings(value, case.kind)])

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
    fabric = _fabric(calibration.base, document, folder)
    found = []
    for name, test in calibration.tests.items():
        at = ("tests", name)
        config = None if test.config is None else _existing(folder / test.config, document.where((*at, "config")))
        settings = [*_settings(calibration.base, document, ("base",)), *_settings(test, document, at)]
        found.append(Case(name, test.test, fabric, config, tuple(settings)))
    return found


def _fabric(base: file.Base, document: Document, folder: Path) -> Path:
    where = document.where(("base",))
    if (base.variant is None) == (base.fabric is None):
        raise InputError(f"{where}: base: expected variant (a shipped fabric) or fabric (a file), one of them")
    if base.fabric is not None:
        return _existing(folder / base.fabric, document.where(("base", "fabric")))
    try:
        return variant_path(str(base.variant))
    except InputError as error:
        raise InputError(f"{document.where(('base', 'variant'))}: {error}") from None


def _existing(path: Path, where: str) -> Path:
    if not path.is_file():
        raise InputError(f"{where}: no such file: {path}")
    return path


#: fields of ``base`` and of a test, and where in a run they belong
_FIELDS = {
    "parameters": ("parameters",),
    "scale": ("model", "scale"),
    "preset": ("model", "preset"),
    "direction": ("rig", "direction"),
}


def _settings(given: file.Base | file.Test, document: Document, at: tuple[str, ...]) -> list[Setting]:
    found = [
        Setting(path, value, document.where((*at, name)))
        for name, path in _FIELDS.items()
        if (value := getattr(given, name, None)) is not None
    ]
    values: dict[str, Any] = given.set
    for name, value in values.items():
        where, path = document.where((*at, "set", name)), tuple(name.split("."))
        if not all(path):
            raise InputError(f"{where}: {name!r}: expected the dotted path of a field, for example rig.width")
        found.append(Setting(path, value, where))
    return found


def described(values: Sequence[float], parameters: Sequence[Parameter]) -> str:
    """``strain.warp=1.75 ...``: a point in a line."""
    pairs = zip(parameters, values, strict=True)
    return ", ".join(f"{'.'.join(dotted(p.paths[0]).split('.')[-2:])}={value:.5g}" for p, value in pairs)
