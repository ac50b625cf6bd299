"""Outcome of a calibration, as calibration.json holds it: values, sensitivities, intervals, warnings."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NotRequired, TypedDict

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

import knittest
from knittest.base.history import Array
from knittest.base.result_rows import LABELS
from knittest.config.base import Quantity
from knittest.export.summary import now
from knittest.report_page.files import Number as StoredNumber
from knittest.studies.calibrate.fit import jacobian, positions_of, prior_slopes
from knittest.studies.calibrate.problem import Evaluation, Evaluator, Parameter, Problem, current
from knittest.studies.calibrate.targets import Number, Target
from knittest.studies.trials.trial import code_digest, looser_note

#: half width of a 95 % interval in standard deviations
Z95 = 1.959964
#: correlation of two parameters from which they are not told apart
CORRELATED = 0.95
#: this near to a bound, as a share of the bounds, is at it
AT_BOUND = 1e-3
#: points nearer than this, as a share of the bounds, give no slope
NEAREST = 2e-3


@dataclass(frozen=True)
class Found:
    """A parameter's ``value``, its standard deviation and 95 % ``interval`` from the scatter of the targets.

    ``sensitivity`` is the change of all targets, in sd, over the whole bounds, by the slope at the value.
    """

    value: float
    sd: float
    interval: tuple[float, float]
    sensitivity: float


@dataclass(frozen=True)
class Judgement:
    """Findings on every parameter, and ``warnings``."""

    found: list[Found]
    warnings: list[str]


def judge(evaluator: Evaluator, best: Evaluation) -> Judgement:
    """Judge ``best`` by the slopes there: of points at hand for one parameter, else of runs beside it."""
    problem = evaluator.problem
    slopes = _slope(evaluator, best) if problem.method == "root" else jacobian(evaluator, best.values)
    return judgement(problem.parameters, best.values, slopes, problem.calibration.noise)


def judgement(parameters: Sequence[Parameter], values: tuple[float, ...], slopes: Array, noise: float) -> Judgement:
    """Covariance from ``slopes`` (m, n): change of the residuals over the whole bounds of each parameter.

    The covariance is (J' J)^-1 with J of residuals and priors over their sd, which is that of the values that single
    specimens would lead to.
    """
    sensitivity = np.linalg.norm(slopes, axis=0)
    rows = np.vstack([slopes, prior_slopes(parameters, values)])
    known = np.linalg.norm(rows, axis=0) >= noise  # the others would make all intervals infinite
    covariance = np.full((len(values), len(values)), np.inf)
    determined = known.any() and np.linalg.matrix_rank(rows[:, known]) == known.sum()
    if determined:
        covariance[np.ix_(known, known)] = np.linalg.inv(rows[:, known].T @ rows[:, known])
    sd = np.sqrt(np.diag(covariance))
    here = positions_of(parameters, values)
    found = [_found(*one) for one in zip(parameters, values, here, sd, sensitivity, strict=True)]
    warnings = [text for one in zip(parameters, found, here, strict=True) for text in _warnings(*one, noise)]
    pairs = _correlated(parameters, covariance, known) if determined else []
    lost = (
        []
        if determined or not known.any()
        else ["the targets do not tell the parameters apart: add a target or a prior"]
    )
    return Judgement(found, warnings + pairs + lost)


def _found(parameter: Parameter, value: float, here: float, sd: float, sensitivity: float) -> Found:
    ends = (parameter.value(max(here - Z95 * sd, 0.0)), parameter.value(min(here + Z95 * sd, 1.0)))
    span = value * np.log(parameter.high / parameter.low) if parameter.log else parameter.high - parameter.low
    return Found(value, float(sd * span), ends, float(sensitivity))


def _warnings(parameter: Parameter, found: Found, here: float, noise: float) -> list[str]:
    if found.sensitivity < noise:
        prior = "; its value is the prior's" if parameter.prior else ""
        return [
            f"{parameter.name} does not matter: over its bounds it moves the targets by {found.sensitivity:.2g} sd, "
            f"less than noise = {noise:g}{prior}"
        ]
    texts = []
    if min(here, 1.0 - here) < AT_BOUND:
        texts.append(f"{parameter.name} is at its bound: widen the bounds if that is no limit of the material")
    if found.interval == (parameter.low, parameter.high):
        texts.append(f"{parameter.name} is hardly determined: its 95 % interval is as wide as its bounds")
    return texts


def _correlated(parameters: Sequence[Parameter], covariance: Array, known: NDArray[np.bool_]) -> list[str]:
    numbers = [k for k in range(len(parameters)) if known[k]]
    texts = []
    for i, a in enumerate(numbers):
        for b in numbers[i + 1 :]:
            share = covariance[a, b] / np.sqrt(covariance[a, a] * covariance[b, b])
            if abs(share) > CORRELATED:
                names = f"{parameters[a].name} and {parameters[b].name}"
                texts.append(f"{names} are hardly told apart (correlation {share:+.2f}): add a target or a prior")
    return texts


def _slope(evaluator: Evaluator, best: Evaluation) -> Array:
    """Slope (1, 1) at ``best`` of the parabola through it and its neighbours, not nearer than a run can tell."""
    (parameter,) = evaluator.problem.parameters
    here = parameter.position(best.values[0])
    steps = [(parameter.position(one.values[0]) - here, one) for one in evaluator.history if one.good]
    nearest = [
        min((step for step in steps if side * step[0] > NEAREST), key=lambda step: abs(step[0]), default=None)
        for side in (-1.0, 1.0)
    ]
    secants = [(abs(step), (one.residuals[0] - best.residuals[0]) / step) for step, one in filter(None, nearest)]
    if len(secants) == 1:
        return np.array([[secants[0][1]]])
    (left, before), (right, after) = secants
    return np.array([[(before * right + after * left) / (left + right)]])


class TargetRow(TypedDict):
    """A target beside the best point, None without one; ``mean``, ``sd`` and ``simulated`` are of a single number."""

    target: str
    test: str
    weight: float
    source: str
    quantity: NotRequired[str]
    mean: NotRequired[float]
    sd: NotRequired[float]
    simulated: NotRequired[float | None]
    deviation_sd: float | None


class ParameterRow(TypedDict):
    """A parameter: its bounds, start, prior, value before and value found, None without one."""

    fields: list[str]
    unit: str
    low: float
    high: float
    start: float
    prior_mean: float | None
    prior_sd: float | None
    value: float | None
    before: float | None
    before_source: str
    sd: NotRequired[float | None]
    interval_95: NotRequired[list[float]]
    sensitivity_sd: NotRequired[float]


@dataclass(frozen=True)
class Outcome:
    """``history`` in the order of the search, its ``best`` and what is known of it; ``failure`` says why it did not end
    well, and is empty where it did.
    """

    problem: Problem
    history: list[Evaluation]
    best: Evaluation | None
    judgement: Judgement | None
    failure: str = ""

    @property
    def converged(self) -> bool:
        """Tell whether the search came to its end and its result may be used."""
        return not self.failure

    @property
    def runs(self) -> int:
        """Number of runs, those that came to nothing included."""
        return len({record.key for one in self.history for record in one.records.values()})

    @property
    def rms(self) -> float:
        """Root mean square over the targets of the best point's deviation [sd]; nan without one."""
        found = [row["deviation_sd"] for row in target_rows(self)] if self.best else []
        squares = [math.nan if deviation is None else deviation**2 for deviation in found]
        return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def target_rows(outcome: Outcome) -> list[TargetRow]:
    """Each target beside the best point; the deviation of a curve is its root mean square."""
    best = outcome.best
    return [
        _target_row(target, best.simulated[k] if best else None) for k, target in enumerate(outcome.problem.targets)
    ]


def _target_row(target: Target, simulated: float | None) -> TargetRow:
    if isinstance(target, Number):
        off = None if simulated is None else (simulated - target.mean) / target.sd
        return {
            "target": target.label, "test": target.test, "weight": target.weight, "source": target.source,
            "quantity": target.quantity, "mean": target.mean, "sd": target.sd, "simulated": simulated,
            "deviation_sd": off,
        }  # fmt: skip
    return {
        "target": target.label, "test": target.test, "weight": target.weight, "source": target.source,
        "deviation_sd": simulated,
    }  # fmt: skip


def parameter_rows(outcome: Outcome) -> list[ParameterRow]:
    """Each parameter: bounds, start, prior, what it was before and what was found."""
    rows = []
    runs = [case.run() for case in outcome.problem.cases]
    for k, parameter in enumerate(outcome.problem.parameters):
        before, source = _before(current(parameter.paths[0], runs))
        row: ParameterRow = {
            "fields": [".".join(map(str, path)) for path in parameter.paths],
            "unit": parameter.unit, "low": parameter.low, "high": parameter.high, "start": parameter.start,
            "prior_mean": parameter.prior[0] if parameter.prior else None,
            "prior_sd": parameter.prior[1] if parameter.prior else None,
            "value": outcome.best.values[k] if outcome.best else None,
            "before": before, "before_source": source,
        }  # fmt: skip
        if outcome.judgement:
            found = outcome.judgement.found[k]
            finite = found.sd if math.isfinite(found.sd) else None
            row |= {"sd": finite, "interval_95": list(found.interval), "sensitivity_sd": found.sensitivity}
        rows.append(row)
    return rows


def _before(number: Quantity | float | None) -> tuple[float | None, str]:
    return (number.value, number.source) if isinstance(number, Quantity) else (number, "")


def warnings_of(outcome: Outcome) -> list[str]:
    """Warnings that a reader of the result must know: limits of its runs first."""
    limits = looser_note(record for one in outcome.history for record in one.records.values())
    return [*limits, *(outcome.judgement.warnings if outcome.judgement else [])]


def as_data(outcome: Outcome) -> dict[str, object]:
    """Plain data of calibration.json."""
    statuses = {r.key: r.status for one in outcome.history for r in one.records.values()}
    return {
        "calibration": outcome.problem.name,
        "status": "converged" if outcome.converged else "not converged",
        "reason": outcome.failure,
        "method": outcome.problem.method,
        "parameters": parameter_rows(outcome),
        "targets": target_rows(outcome),
        "rms_deviation_sd": outcome.rms if outcome.best else None,
        "warnings": warnings_of(outcome),
        "runs": outcome.runs,
        "runs_by_status": dict(Counter(statuses.values())),
        "evaluations": [_evaluation(one) for one in outcome.history],
        "version": knittest.__version__,
        "code": code_digest(),
        "written": now(),
    }


def _evaluation(one: Evaluation) -> dict[str, object]:
    return {
        "number": one.number,
        "values": list(one.values),
        "simulated": list(one.simulated) if one.good else None,
        "reason": one.reason,
        "trials": {name: record.key for name, record in one.records.items()},
    }


def report_lines(outcome: Outcome) -> list[str]:
    """Lines that the command prints at its end."""
    lines = [f"{'converged' if outcome.converged else 'not converged: ' + outcome.failure} ({outcome.runs} runs)"]
    for parameter, row in zip(outcome.problem.parameters, parameter_rows(outcome), strict=True):
        if row["value"] is not None:
            unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
            ends = row.get("interval_95")
            interval = f", 95 % interval {ends[0]:.4g} to {ends[1]:.4g}" if ends else ""
            lines.append(f"  {' = '.join(row['fields'])} = {row['value']:.5g}{unit}{interval}")
    for one in target_rows(outcome) if outcome.best else []:
        form = LABELS.get(one.get("quantity", ""), ("", "{:.5g}"))[1]
        values = f"{form.format(one['simulated'])} for {one['mean']:g} ± {one['sd']:g}, " if "mean" in one else ""
        lines.append(f"  {one['target']}: {values}{one['deviation_sd']:+.3f} sd ({one['source']})")
    lines += [f"  warning: {text}" for text in warnings_of(outcome)]
    lost = [one for one in outcome.history if not one.good]
    lines += [f"  no number at point {one.number}: {one.reason}" for one in lost]
    return lines


def largest_deviations(outcome: Outcome) -> np.ndarray:
    """Largest deviation [sd] among the targets at each point (n,), nan without numbers."""
    found = [np.abs(one.deviations).max() if one.deviations is not None else math.nan for one in outcome.history]
    return np.array(found)


class StoredParameter(BaseModel):
    """A parameter of calibration.json."""

    fields: list[str]
    unit: str = ""
    low: StoredNumber = None
    high: StoredNumber = None
    prior_mean: StoredNumber = None
    prior_sd: StoredNumber = None
    before: StoredNumber = None
    before_source: str = ""
    value: StoredNumber = None
    interval_95: list[float] | None = None
    sensitivity_sd: StoredNumber = None


class StoredTarget(BaseModel):
    """A target of calibration.json; ``quantity``, ``mean`` and ``sd`` are those of a number."""

    target: str
    test: str = ""
    weight: float = 1.0
    source: str = ""
    quantity: str = ""
    mean: StoredNumber = None
    sd: StoredNumber = None
    simulated: StoredNumber = None
    deviation_sd: StoredNumber = None


class Point(BaseModel):
    """A point of the search: the keys of its ``trials`` by test."""

    number: int
    values: list[float]
    simulated: list[StoredNumber] | None = None
    reason: str = ""
    trials: dict[str, str] = {}


class Calibration(BaseModel):
    """calibration.json."""

    calibration: str = ""
    status: str = ""
    reason: str = ""
    method: str = ""
    parameters: list[StoredParameter] = []
    targets: list[StoredTarget] = []
    rms_deviation_sd: StoredNumber = None
    warnings: list[str] = []
    runs: int = 0
    runs_by_status: dict[str, int] = {}
    evaluations: list[Point] = []
    version: str = ""
    code: str = ""
    written: str = ""

    @property
    def best(self) -> Point | None:
        """The point of the values that were found."""
        values = [row.value for row in self.parameters]
        return next((one for one in self.evaluations if one.values == values), None)
