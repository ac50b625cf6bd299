"""Certainty of the parameters that the targets determine: sensitivities, intervals, warnings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array
from knittest.studies.calibrate.evaluate import Evaluation, Evaluator
from knittest.studies.calibrate.fit import jacobian, positions_of, prior_slopes
from knittest.studies.calibrate.parameters import Parameter

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
