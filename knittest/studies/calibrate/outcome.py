"""Outcome of a calibration, as in calibration.json: values, sensitivities, intervals, warnings."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

import knittest
from knittest.base.history import Array
from knittest.base.result_rows import LABELS
from knittest.config.base import Quantity
from knittest.config.yaml_loader import dotted_path
from knittest.export.summary import timestamp
from knittest.report_page.files import Number as Value
from knittest.studies.calibrate.fit import jacobian, positions_of, prior_slopes
from knittest.studies.calibrate.problem import Evaluation, Evaluator, Parameter, Problem, current_number
from knittest.studies.calibrate.targets import NumberTarget
from knittest.studies.trials.page import unit_text
from knittest.studies.trials.trial import code_digest, relaxed_limits_note

#: half width of a 95 % interval in standard deviations
Z95 = 1.959964
#: least correlation of two parameters with a warning
CORRELATION_LIMIT = 0.95
#: a smaller distance to a bound, as a share of the bounds, is none
BOUND_MARGIN = 1e-3
#: least distance of two points that give a slope, as a share of the bounds
LEAST_DISTANCE = 2e-3


@dataclass(frozen=True)
class Estimate:
    """Estimate of a parameter: standard deviation and 95 % ``interval`` follow from the scatter of the targets.

    ``sensitivity`` is the change of all targets, in sd, over the whole bounds, by the slope at the value.
    """

    value: float
    sd: float
    interval: tuple[float, float]
    sensitivity: float


@dataclass(frozen=True)
class Estimates:
    """Estimate of every parameter, and ``warnings``."""

    found: list[Estimate]
    warnings: list[str]


def estimate_parameters(evaluator: Evaluator, best: Evaluation) -> Estimates:
    """Estimate the parameters at ``best`` from the slopes of known points (method root) or of new runs."""
    problem = evaluator.problem
    slopes = _slope(evaluator, best) if problem.method == "root" else jacobian(evaluator, best.values)
    return estimate_from_slopes(problem.parameters, best.values, slopes, problem.calibration.noise)


def estimate_from_slopes(
    parameters: Sequence[Parameter], values: tuple[float, ...], slopes: Array, noise: float
) -> Estimates:
    """Estimate parameters from ``slopes`` (m, n), the change of the residuals over the whole bounds of each parameter.

    The covariance is (J' J)^-1 with J of residuals and priors over their sd: that of values from single specimens.
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
    found = []
    for p, value, at, off, moved in zip(parameters, values, here, sd, sensitivity, strict=True):
        ends = p.value(max(at - Z95 * off, 0.0)), p.value(min(at + Z95 * off, 1.0))
        found.append(Estimate(value, float(off * p.span(value)), ends, float(moved)))
    warnings = [text for one in zip(parameters, found, here, strict=True) for text in _warnings(*one, noise)]
    if determined:
        warnings += _correlation_warnings(parameters, covariance, known)
    elif known.any():
        warnings.append("the targets cannot determine all parameters: add a target or a prior")
    return Estimates(found, warnings)


def _warnings(parameter: Parameter, found: Estimate, here: float, noise: float) -> list[str]:
    name = parameter.name
    if found.sensitivity < noise:
        prior = "; its value is that of the prior" if parameter.prior else ""
        small = f"{found.sensitivity:.2g} sd, less than noise = {noise:g}"
        return [f"{name} has no influence: over its bounds it changes the targets by {small}{prior}"]
    texts = []
    if min(here, 1.0 - here) < BOUND_MARGIN:
        texts.append(f"{name} is at its bound: widen the bounds unless it is a limit of the material")
    if found.interval == (parameter.low, parameter.high):
        texts.append(f"{name} is poorly determined: its 95 % interval is as wide as its bounds")
    return texts


def _correlation_warnings(parameters: Sequence[Parameter], covariance: Array, known: NDArray[np.bool_]) -> list[str]:
    texts = []
    for a, b in combinations(np.flatnonzero(known).tolist(), 2):
        share = covariance[a, b] / np.sqrt(covariance[a, a] * covariance[b, b])
        if abs(share) > CORRELATION_LIMIT:
            names = f"{parameters[a].name} and {parameters[b].name}"
            texts.append(f"{names} are strongly correlated ({share:+.2f}): add a target or a prior")
    return texts


def _slope(evaluator: Evaluator, best: Evaluation) -> Array:
    """Slope (1, 1) at ``best`` of the parabola through it and its neighbours beyond :data:`LEAST_DISTANCE`."""
    (parameter,) = evaluator.problem.parameters
    here = parameter.position(best.values[0])
    steps = [(parameter.position(one.values[0]) - here, one) for one in evaluator.history if one.good]
    nearest = [
        min((step for step in steps if side * step[0] > LEAST_DISTANCE), key=lambda step: abs(step[0]), default=None)
        for side in (-1.0, 1.0)
    ]
    secants = [(abs(step), (one.residuals[0] - best.residuals[0]) / step) for step, one in filter(None, nearest)]
    if len(secants) == 1:
        return np.array([[secants[0][1]]])
    (left, before), (right, after) = secants
    return np.array([[(before * right + after * left) / (left + right)]])


class TargetRow(BaseModel):
    """Target with its value at the best point; a curve has no ``quantity``, ``mean``, ``sd`` and ``simulated``."""

    target: str
    test: str = ""
    weight: float = 1.0
    source: str = ""
    quantity: str = ""
    mean: Value = None
    sd: Value = None
    simulated: Value = None
    deviation_sd: Value = None


class ParameterRow(BaseModel):
    """Parameter: its bounds, start, prior, value found (None without one), value before, and estimate."""

    fields: list[str]
    unit: str = ""
    low: Value = None
    high: Value = None
    start: Value = None
    prior_mean: Value = None
    prior_sd: Value = None
    value: Value = None
    before: Value = None
    before_source: str = ""
    sd: Value = None
    interval_95: list[float] | None = None
    sensitivity_sd: Value = None


class PointRow(BaseModel):
    """Point of the search: the keys of its ``trials`` by test."""

    number: int
    values: list[float]
    simulated: list[Value] | None = None
    reason: str = ""
    trials: dict[str, str] = {}


class Calibration(BaseModel):
    """Contents of calibration.json."""

    calibration: str = ""
    status: str = ""
    reason: str = ""
    method: str = ""
    parameters: list[ParameterRow] = []
    targets: list[TargetRow] = []
    rms_deviation_sd: Value = None
    warnings: list[str] = []
    runs: int = 0
    runs_by_status: dict[str, int] = {}
    evaluations: list[PointRow] = []
    version: str = ""
    code: str = ""
    written: str = ""

    @property
    def best(self) -> PointRow | None:
        """Point with the values that were found."""
        values = [row.value for row in self.parameters]
        return next((one for one in self.evaluations if one.values == values), None)


@dataclass(frozen=True)
class Outcome:
    """Points of the search in ``history``, the ``best`` one and the ``estimates`` there.

    ``failure`` says why there is no valid result, and is empty where there is one.
    """

    problem: Problem
    history: list[Evaluation]
    best: Evaluation | None
    estimates: Estimates | None
    failure: str = ""

    @property
    def converged(self) -> bool:
        """Tell whether the search came to its end and its result is valid."""
        return not self.failure

    @property
    def runs(self) -> int:
        """Number of runs, those without a result included."""
        return len({record.key for one in self.history for record in one.records.values()})

    @property
    def rms(self) -> float:
        """Root mean square over the targets of the best point's deviation [sd]; nan without one."""
        found = [row.deviation_sd for row in target_rows(self)] if self.best else []
        squares = [math.nan if deviation is None else deviation**2 for deviation in found]
        return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def target_rows(outcome: Outcome) -> list[TargetRow]:
    """Rows of the targets at the best point; the deviation of a curve is its root mean square."""
    rows = []
    for k, target in enumerate(outcome.problem.targets):
        off = simulated = outcome.best.simulated[k] if outcome.best else None
        more: dict[str, Any] = {}
        if isinstance(target, NumberTarget):
            off = None if simulated is None else (simulated - target.mean) / target.sd
            more = {"quantity": target.quantity, "mean": target.mean, "sd": target.sd, "simulated": simulated}
        more |= {"test": target.test, "weight": target.weight, "source": target.source}
        rows.append(TargetRow(target=target.label, deviation_sd=off, **more))
    return rows


def parameter_rows(outcome: Outcome) -> list[ParameterRow]:
    """Rows of the parameters: bounds, start, prior, value before and value found."""
    rows = []
    runs = [case.run() for case in outcome.problem.cases]
    for k, one in enumerate(outcome.problem.parameters):
        before = current_number(one.paths[0], runs)
        value, source = (before.value, before.source) if isinstance(before, Quantity) else (before, "")
        mean, sd = one.prior or (None, None)
        more: dict[str, Any] = {}
        if outcome.estimates:
            found = outcome.estimates.found[k]
            finite = found.sd if math.isfinite(found.sd) else None
            more = {"sd": finite, "interval_95": list(found.interval), "sensitivity_sd": found.sensitivity}
        more |= {"unit": one.unit, "low": one.low, "high": one.high, "start": one.start, "prior_mean": mean}
        more |= {"prior_sd": sd, "value": outcome.best.values[k] if outcome.best else None}
        fields = [dotted_path(path) for path in one.paths]
        rows.append(ParameterRow(fields=fields, before=value, before_source=source, **more))
    return rows


def calibration_of(outcome: Outcome) -> Calibration:
    """Contents of calibration.json; warnings on limits of the runs come first."""
    records = {r.key: r for one in outcome.history for r in one.records.values()}
    points = [
        PointRow(
            number=one.number, values=list(one.values), simulated=list(one.simulated) if one.good else None,
            reason=one.reason, trials={name: record.key for name, record in one.records.items()},
        )
        for one in outcome.history
    ]  # fmt: skip
    return Calibration(
        calibration=outcome.problem.name, status="converged" if outcome.converged else "not converged",
        reason=outcome.failure, method=outcome.problem.method, parameters=parameter_rows(outcome),
        targets=target_rows(outcome), rms_deviation_sd=outcome.rms if outcome.best else None,
        warnings=[*relaxed_limits_note(records.values()), *(outcome.estimates.warnings if outcome.estimates else [])],
        runs=outcome.runs, runs_by_status=dict(Counter(record.status for record in records.values())),
        evaluations=points, version=knittest.__version__, code=code_digest(), written=timestamp(),
    )  # fmt: skip


def report_lines(found: Calibration) -> list[str]:
    """Lines that the command prints at its end."""
    lines = [f"{found.status}{': ' + found.reason if found.reason else ''} ({found.runs} runs)"]
    for row in found.parameters:
        if row.value is not None:
            ends = row.interval_95
            interval = f", 95 % interval {ends[0]:.4g} to {ends[1]:.4g}" if ends else ""
            lines.append(f"  {' = '.join(row.fields)} = {row.value:.5g}{unit_text(row.unit)}{interval}")
    for one in found.targets:
        if one.deviation_sd is not None:
            form = LABELS.get(one.quantity, ("", "{:.5g}"))[1]
            values = "" if one.mean is None else f"{form.format(one.simulated)} for {one.mean:g} ± {one.sd:g}, "
            lines.append(f"  {one.target}: {values}{one.deviation_sd:+.3f} sd ({one.source})")
    lines += [f"  warning: {text}" for text in found.warnings]
    return lines + [f"  point {one.number} has no result: {one.reason}" for one in found.evaluations if one.reason]
