"""Search for parameters: least squares with bounds after a global search, or one root by the method of Brent (1973)."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import Bounds, brentq, differential_evolution, least_squares

from knittest.base.errors import NumericalError
from knittest.base.history import Array
from knittest.studies.calibrate.problem import Evaluation, Evaluator, Parameter, Point, RunLimitReached

#: least squares ends at a smaller step, as a share of the bounds, or a smaller relative change of the sum of squares
SMALL_STEP, SMALL_GAIN = 2e-3, 1e-3
#: members of a generation for each parameter, and the share of the runs for the global search
MEMBERS, GLOBAL_SHARE = 5, 0.6


class _TargetsMet(Exception):
    """All targets are met within the tolerance."""


def point_at(parameters: Sequence[Parameter], positions: Sequence[float] | Array) -> Point:
    """Values at ``positions`` (n,) between the bounds."""
    return tuple(p.value(float(x)) for p, x in zip(parameters, positions, strict=True))


def positions_of(parameters: Sequence[Parameter], values: Point) -> Array:
    """Positions (n,) of ``values``, the inverse of :func:`point_at`."""
    return np.array([p.position(v) for p, v in zip(parameters, values, strict=True)])


def prior_residuals(parameters: Sequence[Parameter], values: Point) -> Array:
    """Deviation of each parameter that has a prior from its mean, over its sd."""
    pairs = zip(parameters, values, strict=True)
    return np.array([(v - p.prior[0]) / p.prior[1] for p, v in pairs if p.prior is not None])


def cost(parameters: Sequence[Parameter], evaluation: Evaluation) -> float:
    """Sum of squares of residuals and priors; infinite without a result."""
    if not evaluation.good:
        return np.inf
    prior = prior_residuals(parameters, evaluation.values)
    return float(np.sum(evaluation.residuals**2) + np.sum(prior**2))


def best_of(parameters: Sequence[Parameter], history: Sequence[Evaluation]) -> Evaluation | None:
    """Evaluation of least cost; None if no point has a result."""
    good = [one for one in history if one.good]
    return min(good, key=lambda one: cost(parameters, one), default=None)


def jacobian(evaluator: Evaluator, values: Point) -> Array:
    """Change of the residuals (m, n) over the whole bounds of each parameter, from steps inside them.

    A step whose run has no result is taken to the other side; raises :class:`NumericalError` if that has none either.
    """
    parameters = evaluator.problem.parameters
    step = evaluator.problem.calibration.step
    here = positions_of(parameters, values)
    steps = np.diag(np.where(here + step <= 1.0, step, -step))
    first = evaluator.evaluate_points([point_at(parameters, here + one) for one in steps])
    middle = evaluator.evaluate_points([values])[0].residuals
    columns = []
    for k, evaluation in enumerate(first):
        if not evaluation.good:
            evaluation = evaluator.evaluate_points([point_at(parameters, here - steps[k])])[0]
        if not evaluation.good:
            raise NumericalError(f"no run near {parameters[k].name} = {values[k]:g} has a result: {evaluation.reason}")
        distance = positions_of(parameters, evaluation.values)[k] - here[k]
        columns.append((evaluation.residuals - middle) / distance)
    return np.stack(columns, axis=1)


def search_and_fit(evaluator: Evaluator) -> None:
    """Differential evolution (Storn and Price, 1997) over the bounds with a part of the runs, then least squares."""
    parameters, calibration = evaluator.problem.parameters, evaluator.problem.calibration
    tests, n = len(evaluator.problem.cases), len(parameters)
    generations = int(GLOBAL_SHARE * calibration.max_runs / (tests * MEMBERS * n)) - 1
    if generations < 1:
        least = int(2 * tests * MEMBERS * n / GLOBAL_SHARE) + 1
        raise RunLimitReached(
            f"max_runs = {calibration.max_runs}: differential-evolution needs at least {least} runs here"
        )

    def costs(positions: Any) -> Any:
        found = evaluator.evaluate_points([point_at(parameters, column) for column in np.atleast_2d(positions.T)])
        return np.array([cost(parameters, one) for one in found])

    start = positions_of(parameters, tuple(p.start for p in parameters))
    differential_evolution(
        costs, Bounds(np.zeros(n), np.ones(n)), maxiter=generations, popsize=MEMBERS, seed=calibration.seed,
        polish=False, init="latinhypercube", updating="deferred", vectorized=True, x0=start,
    )  # fmt: skip
    fit_best(evaluator)


def fit_best(evaluator: Evaluator) -> None:
    """Least squares from the best point so far; raises :class:`NumericalError` if no point has a result."""
    best = best_of(evaluator.problem.parameters, evaluator.history)
    if best is None:
        raise NumericalError(f"none of {len(evaluator.history)} points has a result: {evaluator.history[-1].reason}")
    fit(evaluator, best.values)


def fit(evaluator: Evaluator, start: Point | None = None) -> None:
    """Least squares from ``start``; raises :class:`NumericalError` if it has no result, or steps shrink to nothing."""
    parameters, tolerance = evaluator.problem.parameters, evaluator.problem.calibration.tolerance
    start = start or tuple(p.start for p in parameters)
    first = evaluator.evaluate_points([start])[0]
    if not first.good:
        raise NumericalError(f"the start has no result: {first.reason}")
    size = len(first.residuals) + len(prior_residuals(parameters, start))

    def residuals(positions: Array) -> Array:
        evaluation = evaluator.evaluate_points([point_at(parameters, positions)])[0]
        if not evaluation.good:
            return np.full(size, np.inf)  # rejects the step: a shorter one follows
        prior = prior_residuals(parameters, evaluation.values)
        if evaluation.deviations is not None and not len(prior) and np.abs(evaluation.deviations).max() <= tolerance:
            raise _TargetsMet
        return np.concatenate([evaluation.residuals, prior])

    def slopes(positions: Array) -> Array:
        values = point_at(parameters, positions)
        return np.vstack([jacobian(evaluator, values), prior_slopes(parameters, values)])

    try:
        found: Any = least_squares(
            residuals, np.clip(positions_of(parameters, start), 1e-9, 1.0 - 1e-9), jac=slopes, bounds=(0.0, 1.0),
            xtol=SMALL_STEP, ftol=SMALL_GAIN, max_nfev=evaluator.problem.calibration.max_runs,
        )  # fmt: skip
    except _TargetsMet:
        return
    if not found.success:
        raise NumericalError(f"least squares did not converge: {found.message}")


def prior_slopes(parameters: Sequence[Parameter], values: Point) -> Array:
    """Change of the priors' residuals (k, n) over the whole bounds of each parameter."""
    rows = []
    for k, (p, value) in enumerate(zip(parameters, values, strict=True)):
        if p.prior is not None:
            rows.append(np.eye(len(parameters))[k] * p.span(value) / p.prior[1])
    return np.array(rows).reshape(-1, len(parameters))


#: narrowest bracket, as a share of the bounds: if the target is not met in it, the result jumps
LEAST_BRACKET = 1e-5
#: distances from a bound without a result at which to try again, as shares of the bounds, and most tries inside
INWARD, MOST_LOST = (0.1, 0.2, 0.35), 5
MOST_STEPS = 60


class _NoResult(Exception):
    """Signal that a position has no result."""


class _Search:
    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator
        self._parameter = evaluator.problem.parameters[0]
        self._tolerance = evaluator.problem.calibration.tolerance
        self.good: dict[float, float] = {}

    def evaluate_points(self, positions: list[float]) -> list[Evaluation]:
        found = self._evaluator.evaluate_points([(self._parameter.value(p),) for p in positions])
        for position, evaluation in zip(positions, found, strict=True):
            if evaluation.deviations is not None:
                self.good[position] = float(evaluation.deviations[0])
        return found

    def deviation(self, position: float) -> float:
        """Deviation in sd at ``position``, 0 within the tolerance; raises :class:`_NoResult`."""
        position = float(position)
        if position not in self.good and not self.evaluate_points([position])[0].good:
            raise _NoResult
        value = self.good[position]
        return 0.0 if abs(value) <= self._tolerance else value

    def bound(self, end: float, first: Evaluation) -> float:
        """Position nearest to ``end``, 0 or 1, that has a result; ``first`` is the evaluation at ``end``."""
        if first.good:
            return end
        for share in INWARD:
            position = abs(end - share)
            if self.evaluate_points([position])[0].good:
                return position
        raise NumericalError(f"no run near the bound {self._parameter.value(end):g} has a result: {first.reason}")

    def bracket(self) -> tuple[float, float]:
        """Nearest two known positions between which the deviation changes sign."""
        known = sorted(self.good)
        pairs = [(a, b) for a, b in pairwise(known) if self.deviation(a) * self.deviation(b) <= 0.0]
        return min(pairs, key=lambda pair: pair[1] - pair[0])


def find_root(evaluator: Evaluator) -> None:
    """Find the root; raises :class:`NumericalError` if it is not enclosed, jumped over, or among lost runs."""
    search = _Search(evaluator)
    low, high = (
        search.bound(end, first) for end, first in zip((0.0, 1.0), search.evaluate_points([0.0, 1.0]), strict=True)
    )
    if search.deviation(low) * search.deviation(high) > 0.0:
        parameter, (first, last) = evaluator.problem.parameters[0], (search.good[low], search.good[high])
        ends = f"{first:+.3g} sd at {parameter.low:g}, {last:+.3g} sd at {parameter.high:g}"
        if abs(last - first) < evaluator.problem.calibration.noise:
            target = evaluator.problem.targets[0].label
            raise NumericalError(f"{parameter.name} has no influence: {target} deviates by {ends}")
        why = f"the bounds do not enclose the target, which deviates by {ends}"
        raise NumericalError(f"{parameter.where}: {why}: widen the bounds")
    for _ in range(MOST_LOST):
        a, b = search.bracket()
        tried: list[float] = []

        def deviation(position: float, tried: list[float] = tried) -> float:
            tried.append(float(position))
            return search.deviation(position)

        try:
            root = float(brentq(deviation, a, b, xtol=LEAST_BRACKET, maxiter=MOST_STEPS))
        except _NoResult:
            search.evaluate_points(
                [0.5 * (tried[-1] + end) for end in (a, b)]
            )  # both sides of the gap may have results
            continue
        if search.deviation(root) == 0.0:
            return
        parameter = evaluator.problem.parameters[0]
        raise NumericalError(f"the result jumps over the target at {parameter.name} = {parameter.value(root):.5g}")
    raise NumericalError(f"{MOST_LOST} runs between the bounds have no result")
