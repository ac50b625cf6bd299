"""The numerical error of results, from the same run at half its speed and on another mesh.

Roache's grid convergence index of two solutions (1994, J. Fluids Eng. 116, 405): with element lengths, speeds or
residuals that differ by the factor r and an error of order p, the finer solution is off by |change| / (r^p - 1) and the
coarser one by r^p times as much; two solutions do not show their order, so a safety factor of 3 goes on it. Both are
biases: they are added, not squared.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from knittest.base.kinds import Parts
from knittest.base.summary import NumericalError
from knittest.config.run import Run
from knittest.laboratory.halving import change, diagnostic

#: results, None where there is no number
Numbers = Mapping[str, float | None]
RunT = TypeVar("RunT", bound=Run)

#: of two solutions (Roache 1994); with it the index covers orders down to 0.4 of halves and 0.9 to 1 of meshes
SAFETY = 3.0
#: order of inertia in the speed, and of shells and beams in their length
ORDER = 2.0
#: the half is the better one of the two, so the reported one is the coarser
HALF_FACTOR = SAFETY * 2.0**ORDER / (2.0**ORDER - 1.0)
#: why a result that the run does not have has no error
NO_NUMBER = "the run has no number"


class Corrections(Generic[RunT]):
    """Known errors of the results of a test: none, unless its folder says otherwise."""

    def exact(self, run: RunT, results: Numbers) -> Numbers:
        """Correct ``results`` for what a search within a tolerance left open, so that two runs can be compared."""
        return results

    def rested(self, run: RunT, results: Numbers) -> Numbers:
        """Correct them as well for what the criterion of rest left open."""
        return self.exact(run, results)


#: of every test; each takes runs of its own kind, which only their name tells
CORRECTIONS: Mapping[str, Corrections[Any]] = Parts(
    lambda kind: kind.load("corrections")() if kind.corrections else Corrections()
)


@dataclass(frozen=True)
class Repeat:
    """Results of a repeated run, empty where it has none: then ``reason`` says why."""

    results: Numbers
    reason: str = ""

    def of(self, quantity: str) -> float | None:
        """The result, None where there is no finite one."""
        return _finite(self.results.get(quantity))


def mesh_factor(ratio: float, finer: bool) -> float:
    """Error of the reported result over its change on a mesh with elements ``ratio`` times as long, or as short if
    ``finer``; never less than that of first order, which the index of a mesh more than twice as coarse is.
    """
    grown = ratio**ORDER
    if finer:
        return SAFETY * grown / (grown - 1.0)
    return max(SAFETY / (grown - 1.0), 1.0 / (ratio - 1.0))


def numerical_errors(
    results: Numbers, half: Repeat, mesh: Repeat, ratio: float, finer: bool
) -> dict[str, NumericalError]:
    """Changes [%] and error, in its own unit, of every result that is no diagnostic: summary.json's block.

    An error that cannot be told is None, with the reason; never 0.
    """
    found = {}
    for quantity in (q for q in results if q not in diagnostic()):
        value, slow, other = _finite(results[quantity]), half.of(quantity), mesh.of(quantity)
        speed, there = _percent(value, slow), _percent(value, other)
        row: NumericalError = {"half_speed_pct": speed, "coarser_mesh_pct": there, "error": None}
        if finer:
            row = {"half_speed_pct": speed, "finer_mesh_pct": there, "error": None}
        if value is None or slow is None or other is None:
            row["reason"] = _why(value, slow, half, mesh)
        else:
            row["error"] = HALF_FACTOR * abs(slow - value) + mesh_factor(ratio, finer) * abs(other - value)
        found[quantity] = row
    return found


def _why(value: float | None, slow: float | None, half: Repeat, mesh: Repeat) -> str:
    if value is None:
        return NO_NUMBER
    at, repeat = ("at half the speed", half) if slow is None else ("on the other mesh", mesh)
    return repeat.reason or f"no number {at}"


def _percent(value: float | None, other: float | None) -> float | None:
    return _finite(100.0 * change(value, other))


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
