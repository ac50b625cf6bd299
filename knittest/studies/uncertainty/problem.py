"""Problem of a study of uncertainty: fabrics, parameters with their priors, and the variables asked for."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.config import uncertainty as file
from knittest.config.fields import place
from knittest.config.number_path import number_path
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.yaml_loader import Document, KeyPath, dotted
from knittest.studies.homogenise.yarn_card import with_cards
from knittest.studies.trials.case import Case, existing, fabric_path, settings_of
from knittest.studies.trials.draws import quantiles, tried
from knittest.studies.uncertainty.differences import check_differences
from knittest.studies.uncertainty.shorter import Shorter, shorter_of
from knittest.studies.uncertainty.variables import Stated, Variable, statements_of, variables_of


@dataclass(frozen=True)
class Parameter:
    """An assumed number at all ``paths`` of a run, its unit and its prior."""

    paths: tuple[KeyPath, ...]
    unit: str
    prior: file.Prior
    where: str

    @property
    def name(self) -> str:
        """Dotted path of the first field."""
        return dotted(self.paths[0])

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value of the prior."""
        low, high = self.prior.low, self.prior.high
        if low is None or high is None:
            raise ValueError(f"{self.name}: a prior has both ends")  # config.uncertainty has seen to it
        return low, high

    @property
    def median(self) -> float:
        """Median of the prior."""
        return float(self.values(np.array(0.5)))

    def values(self, unit: Array) -> Array:
        """Values below which the shares ``unit`` of the prior lie, in the shape of ``unit``."""
        low, high = self.ends
        found = quantiles(self.prior, unit)
        found = np.rint(found) if self.prior.whole else found
        return np.array([tried(v, low, high) for v in found.ravel()]).reshape(unit.shape)

    def settings(self, value: float) -> list[Setting]:
        """``value`` at every path."""
        given = int(value) if self.prior.whole else float(value)
        return [Setting(path, given, self.where) for path in self.paths]


@dataclass(frozen=True)
class Problem:
    """Contents of a file of ``knittest uncertainty``, checked; ``cases`` are by the name of their fabric."""

    name: str
    study: file.Uncertainty
    parameters: list[Parameter]
    cases: dict[str, Case]
    variables: list[Variable]
    statements: list[Stated]
    differences: Mapping[str, Sequence[object]]
    shorter: Shorter

    @property
    def parts(self) -> int:
        """Parts of the design: A and B, and one a parameter where indices of Sobol are asked for."""
        return 2 + (len(self.parameters) if self.study.design == "saltelli" else 0)

    def run(self, fabric: str, values: Sequence[float], end: float | None = None) -> Run:
        """The run of ``fabric`` with ``values`` of the parameters, to its full end or to the shorter ``end``; raises
        :class:`InputError` where it is refused.
        """
        sooner = [] if end is None else [self.shorter.setting(end)]
        return with_cards([self.cases[fabric].run([*settings_at(self.parameters, values), *sooner])])[0]


def settings_at(parameters: Sequence[Parameter], values: Sequence[float]) -> list[Setting]:
    """Settings of ``values`` of ``parameters``."""
    return [one for p, value in zip(parameters, values, strict=True) for one in p.settings(value)]


def problem_of(document: Document, accept_limits: bool = False) -> Problem:
    """The problem in ``document``, raises :class:`InputError` with file and line; limits looser
    than the preset's may be accepted.
    """
    study = file.parse_uncertainty(document)
    cases = _cases(study, document, accept_limits)
    first = next(iter(cases.values())).run()
    parameters = _parameters(study, document, first.rig.kind)
    for case in cases.values():
        _check_ends(case, parameters)
    middle = _middle(cases, parameters)
    differences = check_differences(middle, study, document)
    variables = variables_of(study, document)
    stated = statements_of(study, document)
    shorter = shorter_of(study, document, middle, [path for one in parameters for path in one.paths])
    return Problem(Path(document.source).stem, study, parameters, cases, variables, stated, differences, shorter)


def _cases(study: file.Uncertainty, document: Document, accept_limits: bool) -> dict[str, Case]:
    base = study.base
    folder = Path(document.source).resolve().parent
    config = None if base.config is None else existing(folder / base.config, document.where(("base", "config")))
    settings = tuple(settings_of(base, document, ("base",)))
    found = {}
    for name, chosen in study.fabrics.items():
        fabric = fabric_path(chosen, document, ("fabrics", name))
        if "/" in name:
            where = document.where(("fabrics", name))
            raise InputError(f"{where}: fabrics.{name}: expected a name without /, which stands for a ratio")
        found[name] = Case(name, base.test, fabric, config, settings, accept_limits)
    return found


def _parameters(study: file.Uncertainty, document: Document, kind: str) -> list[Parameter]:
    """All parameters; raises :class:`InputError` for a field that the test has not, or that is given twice."""
    found = []
    said = dict[KeyPath, str]()
    for name in study.base.set:
        said[tuple(name.split("."))] = document.where(("base", "set", name))
    for name, prior in study.parameters.items():
        where = document.where(("parameters", name))
        paths = tuple(number_path(one, where, [kind]) for one in (name, *prior.also))
        for path in paths:
            for other, at in said.items():
                if path[: len(other)] == other[: len(path)]:
                    raise InputError(f"{where}: {dotted(path)}: given twice, first at {at}: give it once")
            said[path] = where
        field = place(paths[0], kind)
        found.append(Parameter(paths, field.unit if field else "", prior, where))
    return found


def _check_ends(case: Case, parameters: Sequence[Parameter]) -> None:
    """Raise :class:`InputError` where the schema refuses an end of a prior, all else as in the fabric and also where
    the other parameters are at their medians: some fields take each other to be there at all.
    """
    for parameter in parameters:
        others = [setting for one in parameters if one is not parameter for setting in one.settings(one.median)]
        for end in parameter.ends:
            with suppress(InputError):
                case.run(parameter.settings(end))
                continue
            try:
                case.run([*others, *parameter.settings(end)])
            except InputError as error:
                prior = f"an end of the prior of {parameter.name}, {end:g}, for fabric {case.name}"
                raise InputError(f"{error} ({prior}: no draw may lie where the field cannot)") from None


def _middle(cases: Mapping[str, Case], parameters: Sequence[Parameter]) -> dict[str, Run]:
    """Run of each case at the medians of all priors; raises :class:`InputError` where it is refused."""
    settings = settings_at(parameters, [one.median for one in parameters])
    try:
        return {name: case.run(settings) for name, case in cases.items()}
    except InputError as error:
        raise InputError(f"{error} (at the medians of all priors: they do not fit each other)") from None
