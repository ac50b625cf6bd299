"""One parameter, one target: a root between two bounds, by the method of Brent (1973)."""

from itertools import pairwise

from scipy.optimize import brentq

from knittest.base.errors import NumericalError
from knittest.studies.calibrate.evaluate import Evaluation, Evaluator

#: a bracket this narrow, as a share of the bounds, holds a jump if the target is not met in it
NARROWEST = 1e-5
#: where to look instead when there is no number at a bound, as a share of the bounds, and how often inside
INWARD, MOST_LOST = (0.1, 0.2, 0.35), 5
MOST_STEPS = 60


class _Lost(Exception):
    """Signal that there is no number at a position."""


class _Search:
    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator
        self._parameter = evaluator.problem.parameters[0]
        self._tolerance = evaluator.problem.calibration.tolerance
        self.good: dict[float, float] = {}

    def many(self, positions: list[float]) -> list[Evaluation]:
        found = self._evaluator.many([(self._parameter.value(p),) for p in positions])
        for position, evaluation in zip(positions, found, strict=True):
            if evaluation.deviations is not None:
                self.good[position] = float(evaluation.deviations[0])
        return found

    def deviation(self, position: float) -> float:
        """Deviation in sd at ``position``, 0 within the tolerance; raises :class:`_Lost`."""
        position = float(position)
        if position not in self.good and not self.many([position])[0].good:
            raise _Lost
        value = self.good[position]
        return 0.0 if abs(value) <= self._tolerance else value

    def bound(self, end: float, first: Evaluation) -> float:
        """The position nearest to ``end``, 0 or 1, at which there is a number; ``first`` is what came of ``end``."""
        if first.good:
            return end
        for share in INWARD:
            position = abs(end - share)
            if self.many([position])[0].good:
                return position
        raise NumericalError(f"no run near the bound {self._parameter.value(end):g} gives a number: {first.reason}")

    def bracket(self) -> tuple[float, float]:
        """The narrowest two positions known between which the deviation changes sign."""
        known = sorted(self.good)
        pairs = [(a, b) for a, b in pairwise(known) if self.deviation(a) * self.deviation(b) <= 0.0]
        return min(pairs, key=lambda pair: pair[1] - pair[0])


def find_root(evaluator: Evaluator) -> None:
    """Evaluate points until the target is met within the tolerance; they are in the history of ``evaluator``.

    Raises :class:`NumericalError` where the bounds do not enclose the target, or it is jumped over, or too many runs
    inside the bounds give no number.
    """
    search = _Search(evaluator)
    low, high = (search.bound(end, first) for end, first in zip((0.0, 1.0), search.many([0.0, 1.0]), strict=True))
    if search.deviation(low) * search.deviation(high) > 0.0:
        raise NumericalError(_not_enclosed(evaluator, search.good[low], search.good[high]))
    for _ in range(MOST_LOST):
        a, b = search.bracket()
        tried: list[float] = []

        def deviation(position: float, tried: list[float] = tried) -> float:
            tried.append(float(position))
            return search.deviation(position)

        try:
            root = float(brentq(deviation, a, b, xtol=NARROWEST, maxiter=MOST_STEPS))
        except _Lost:
            search.many([0.5 * (tried[-1] + end) for end in (a, b)])  # there may be numbers on both sides of the hole
            continue
        if search.deviation(root) == 0.0:
            return
        raise NumericalError(f"the target is jumped over at {evaluator.problem.parameters[0].value(root):.5g}")
    raise NumericalError(f"{MOST_LOST} times a run between the bounds gave no number")


def _not_enclosed(evaluator: Evaluator, at_low: float, at_high: float) -> str:
    parameter = evaluator.problem.parameters[0]
    ends = f"{at_low:+.3g} sd at {parameter.low:g}, {at_high:+.3g} sd at {parameter.high:g}"
    if abs(at_high - at_low) < evaluator.problem.calibration.noise:
        return f"{parameter.name} does not matter: {evaluator.problem.targets[0].label} is off by {ends}"
    return f"{parameter.where}: the bounds do not enclose the target, which is off by {ends}: widen them"
