"""Problem of a study of uncertainty: fabrics, parameters with priors, variables, points of the design, shorter ends."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.base.kinds import kinds
from knittest.config import studies as file
from knittest.config.base import field_meta
from knittest.config.fields import field_at
from knittest.config.messages import number_path
from knittest.config.run import Run
from knittest.config.settings import Setting, leaf_values
from knittest.config.studies import Uncertainty
from knittest.config.yaml_loader import Document, KeyPath, dotted_path, value_excerpt
from knittest.laboratory.records import EndSetting
from knittest.studies.homogenise.derived_card import complete_cards
from knittest.studies.trials.case import (
    Case,
    fabric_path,
    number_paths,
    quantiles,
    round_to_trial,
    settings_of,
    sibling_file,
)
from knittest.studies.uncertainty.variables import Statement, Variable, statements_of, variables_of

#: names and labels: no result depends on them
_NAMES = ("fabric.name", "fabric.title", "fabric.experiment", "fabric.rigs", "output.")


def check_differences(runs: Mapping[str, Run], study: Uncertainty, document: Document) -> dict[str, list[object]]:
    """Values of every field in which ``runs`` differ; raises :class:`InputError` for one outside ``differ``."""
    flat = [dict(leaf_values(run.model_dump(mode="json"))) for run in runs.values()]
    meso = next(iter(runs.values())).model.scale == "meso"
    unused = (*_NAMES, "fabric.macro.") if meso else _NAMES
    names = dict.fromkeys(name for one in flat for name in one if not name.startswith(unused))
    values = {name: [one.get(name) for one in flat] for name in names}
    found = {name: several for name, several in values.items() if any(value != several[0] for value in several)}
    allowed = [tuple(name.split(".")) for name in study.differing_fields]
    more = [name for name in found if not any(tuple(name.split("."))[: len(one)] == one for one in allowed)]
    if more:
        name = more[0]
        pairs = zip(runs, found[name], strict=True)
        shown_values = ", ".join(f"{fabric} {value_excerpt(value, 30)}" for fabric, value in pairs)
        others = f"; so do {', '.join(more[1:])}" if more[1:] else ""
        raise InputError(
            f"{document.place_of(('fabrics',))}: the fabrics differ in {name} ({shown_values}){others}: "
            "set it in base.set, make it a parameter, or add it to differing_fields"
        )
    return found


@dataclass(frozen=True)
class ShorterEnds:
    """Falling ``values`` of the ``field`` that ends the test, in ``unit``, stated at ``where``; none by default."""

    field: str = ""
    values: tuple[float, ...] = ()
    unit: str = ""
    where: str = ""

    def setting(self, end: float) -> Setting:
        """Setting that ends a run at ``end``."""
        return Setting(tuple(self.field.split(".")), end, self.where)


def shorter_ends_of(
    study: Uncertainty, document: Document, middle: Mapping[str, Run], drawn: Sequence[KeyPath]
) -> ShorterEnds:
    """Shorter ends of ``study``; raises :class:`InputError` for a field that is drawn or ends no test."""
    if not study.shorter_ends:
        return ShorterEnds()
    ((name, values),) = study.shorter_ends.items()
    where = f"{document.place_of(('shorter_ends', name))}: shorter_ends.{name}"
    kind = next(iter(middle.values())).rig.kind
    path = number_path(name, document.place_of(("shorter_ends", name)), [kind])
    if path in drawn:
        raise InputError(f"{where}: is also one of the parameters: remove it from one of them")
    told = ", ".join(f"{value:g}" for value in values)
    for fabric, run in middle.items():
        ending: EndSetting | None = kinds()[kind].load("ending")(run) if kinds()[kind].ending else None
        if ending is None or ending.field != name:
            remedy = f"expected {ending.field}" if ending else "the test has results only at its end; remove it"
            raise InputError(f"{where}: does not end this test ({kind}) sooner: {remedy}")
        _check_values(values, ending, study, f"{where} = [{told}]", fabric)
    unit = str(field_meta(type(run.rig), str(path[-1])).get("unit", ""))
    return ShorterEnds(name, tuple(values), unit, document.place_of(("shorter_ends", name)))


def _check_values(values: Sequence[float], ending: EndSetting, study: Uncertainty, where: str, fabric: str) -> None:
    for before, end in pairwise([ending.now, *values]):
        if end >= before:
            what = f"the full end of {fabric}" if before == ending.now else "the value before it"
            raise InputError(f"{where}: {end:g} must be below {what}, {before:g}: each run ends sooner than the last")
    places = sorted({at for one in study.quantities.values() for at in one.at})
    for end in values:
        cut = [at for at in places if end - ending.near < at <= end]
        if cut:
            least, such = cut[0] + ending.near, cut[0] + 2.0 * ending.near
            why = f"{end:g} is within the range of the mean at {cut[0]:g}, which ends at {least:g}"
            raise InputError(f"{where}: {why}: expected this value or more, such as {such:g}")
        if not any(at <= end for at in places) and not any(one.any_end for one in study.quantities.values()):
            first = f"the first place is {places[0]:g}" if places else "no quantity has places (at) or any_end: true"
            raise InputError(f"{where}: a run to {end:g} has none of the requested results: {first}")


@dataclass(frozen=True)
class Parameter:
    """Assumed number at all ``paths`` of a run, its unit and its prior."""

    paths: tuple[KeyPath, ...]
    unit: str
    prior: file.Prior
    where: str

    @property
    def name(self) -> str:
        """Dotted path of the first field."""
        return dotted_path(self.paths[0])

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest value of the prior."""
        low, high = self.prior.low, self.prior.high
        if low is None or high is None:
            raise ValueError(f"{self.name}: a prior has both ends")  # config.studies has seen to it
        return low, high

    @property
    def median(self) -> float:
        """Median of the prior."""
        return float(self.values(np.array(0.5)))

    def values(self, unit: Array) -> Array:
        """Quantiles of the prior at the shares ``unit``, in the shape of ``unit``."""
        low, high = self.ends
        found = quantiles(self.prior, unit)
        found = np.rint(found) if self.prior.whole else found
        return np.array([round_to_trial(v, low, high) for v in found.ravel()]).reshape(unit.shape)

    def settings(self, value: float) -> list[Setting]:
        """Settings of ``value`` at every path."""
        given = int(value) if self.prior.whole else float(value)
        return [Setting(path, given, self.where) for path in self.paths]


@dataclass(frozen=True)
class Problem:
    """Checked contents of a file of ``knittest uncertainty``; ``cases`` are by the name of their fabric."""

    name: str
    study: file.Uncertainty
    parameters: list[Parameter]
    cases: dict[str, Case]
    variables: list[Variable]
    statements: list[Statement]
    differences: Mapping[str, Sequence[object]]
    shorter: ShorterEnds

    @property
    def parts(self) -> int:
        """Parts of the design: A and B, and one a parameter for Sobol indices."""
        return 2 + (len(self.parameters) if self.study.design == "saltelli" else 0)

    def run(self, fabric: str, values: Sequence[float], end: float | None = None) -> Run:
        """Run of ``fabric`` with ``values``, to its full or shorter ``end``; raises :class:`InputError` if invalid."""
        sooner = [] if end is None else [self.shorter.setting(end)]
        return complete_cards([self.cases[fabric].run([*settings_at(self.parameters, values), *sooner])])[0]


def settings_at(parameters: Sequence[Parameter], values: Sequence[float]) -> list[Setting]:
    """Settings of ``values`` of ``parameters``."""
    return [one for p, value in zip(parameters, values, strict=True) for one in p.settings(value)]


def problem_of(document: Document, accept_limits: bool = False) -> Problem:
    """Read the problem in ``document``; raises :class:`InputError` with file and line."""
    study = file.parse_uncertainty(document)
    cases = _cases(study, document, accept_limits)
    first = next(iter(cases.values())).run()
    parameters = _parameters(study, document, first.rig.kind)
    for case in cases.values():
        _check_ends(case, parameters)
    try:
        settings = settings_at(parameters, [one.median for one in parameters])
        middle = {name: case.run(settings) for name, case in cases.items()}
    except InputError as error:
        raise InputError(f"{error} (at the medians of all priors, which do not fit together)") from None
    differences = check_differences(middle, study, document)
    variables = variables_of(study, document)
    stated = statements_of(study, document)
    shorter = shorter_ends_of(study, document, middle, [path for one in parameters for path in one.paths])
    return Problem(Path(document.source).stem, study, parameters, cases, variables, stated, differences, shorter)


def _cases(study: file.Uncertainty, document: Document, accept_limits: bool) -> dict[str, Case]:
    base = study.base
    config = base.config and sibling_file(document, base.config, document.place_of(("base", "config")))
    settings = tuple(settings_of(base, document, ("base",)))
    found = {}
    for name, chosen in study.fabrics.items():
        fabric = fabric_path(chosen, document, ("fabrics", name))
        if "/" in name:
            where = document.place_of(("fabrics", name))
            raise InputError(f"{where}: fabrics.{name}: expected a name without /, which is for ratios")
        found[name] = Case(name, base.test, fabric, config or None, settings, accept_limits)
    return found


def _parameters(study: file.Uncertainty, document: Document, kind: str) -> list[Parameter]:
    """All parameters; raises :class:`InputError` for a field that the test does not have, or that is given twice."""
    found = []
    claimed: dict[KeyPath, str] = {tuple(n.split(".")): document.place_of(("base", "set", n)) for n in study.base.set}
    for name, prior in study.parameters.items():
        where = document.place_of(("parameters", name))
        paths = number_paths([name, *prior.also], where, [kind], claimed)
        field = field_at(paths[0], kind)
        found.append(Parameter(paths, field.unit if field else "", prior, where))
    return found


def _check_ends(case: Case, parameters: Sequence[Parameter]) -> None:
    """Raise :class:`InputError` if the schema rejects an end of a prior both with the other parameters as in the fabric
    and at their medians: some fields need each other.
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
                raise InputError(f"{error} ({prior}: limit the prior to valid values)") from None


# Points of a design: two samples A and B of the prior, and by Saltelli et al. (2010) A with one column of B each.
#
# Saltelli, A., et al.: Variance based sensitivity analysis of model output. Computer Physics Communications 181 (2010),
# 259-270.


def design(parameters: int, samples: int, seed: int) -> Array:
    """Points (parameters + 2, samples, parameters) in the unit cube: A, B, then A with column i of B, i = 0, 1, ...

    The first two parts are a design of their own, for bands and regression. A and B are the halves of one scrambled
    Sobol sequence of twice the dimensions. With more samples the first points stay the same.
    """
    from scipy.stats import qmc

    dice = np.random.default_rng(seed)
    both = np.asarray(qmc.Sobol(2 * parameters, scramble=True, seed=dice).random(samples))
    a, b = both[:, :parameters], both[:, parameters:]
    mixed = np.repeat(a[None], parameters, axis=0)
    for i in range(parameters):
        mixed[i, :, i] = b[:, i]
    return np.concatenate([a[None], b[None], mixed])


def matrix_name(number: int, names: list[str]) -> str:
    """Name of the part ``number`` of the design: A, B, or the parameter that A has from B."""
    return ("A", "B")[number] if number < 2 else f"A, {names[number - 2]} of B"
