"""Objective rating of a curve after ISO/TS 18571:2014: corridor, phase, magnitude, slope.

Scores are 1 for equal curves and 0 beyond the standard's limits; the overall rating weighs them 0.4, 0.2, 0.2, 0.2. The
standard is written for time histories sampled at 10 kHz; here the points of a common strain grid take that place, which
is why the tool speaks of an ISO/TS 18571-type rating.

Agrees to rounding with the package ``objective-rating-metrics`` of TU Graz (tests/verification/test_rating_outside.py),
which also settles what the wording leaves open: where warping paths cost the same, the curve waits before the reference
does, and both before they go together. One choice is our own: correlations that agree to 12 digits count as equal, so
that the shift of straight lines, which fit at every shift, is zero and not left to rounding.
"""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

INNER, OUTER, CORRIDOR_POWER = 0.05, 0.5, 2
MAX_SHIFT = 0.2
WARP_WINDOW, MAX_MAGNITUDE = 0.1, 0.5
SLOPE_WINDOW, MAX_SLOPE = 9, 2.0
WEIGHTS = {"corridor": 0.4, "phase": 0.2, "magnitude": 0.2, "slope": 0.2}
GRADES = ((0.94, "excellent"), (0.80, "good"), (0.58, "fair"))


def rate(curve: Array, reference: Array) -> dict[str, float]:
    """All scores [-] of ``curve`` against ``reference``, both (n,) on one equally spaced grid.

    >>> x = np.linspace(0.0, 1.0, 201)
    >>> {name: round(score, 2) for name, score in rate(1.02 * x**2, x**2).items()}
    {'corridor': 1.0, 'phase': 1.0, 'magnitude': 0.99, 'slope': 0.99, 'overall': 1.0}
    """
    shift = best_shift(curve, reference)
    shifted, kept = aligned(curve, reference, shift)
    scores = {
        "corridor": corridor_score(curve, reference),
        "phase": max(1.0 - abs(shift) / (MAX_SHIFT * len(curve)), 0.0),
        "magnitude": magnitude_score(shifted, kept),
        "slope": slope_score(shifted, kept),
    }
    return scores | {"overall": sum(WEIGHTS[name] * score for name, score in scores.items())}


def grade(overall: float) -> str:
    """Grade of an overall rating: excellent, good, fair or poor.

    >>> grade(0.95), grade(0.5)
    ('excellent', 'poor')
    """
    return next((name for limit, name in GRADES if overall > limit), "poor")


def corridor_score(curve: Array, reference: Array) -> float:
    """Mean share by which the curve lies between the outer corridor (0) and the inner one (1)."""
    scale = float(np.abs(reference).max())
    distance = np.abs(curve - reference) / scale
    return float(np.mean(np.clip((OUTER - distance) / (OUTER - INNER), 0.0, 1.0) ** CORRIDOR_POWER))


def aligned(curve: Array, reference: Array, shift: int) -> tuple[Array, Array]:
    """Overlapping parts of both after moving ``curve`` by ``shift`` points to the left."""
    n = len(curve)
    if shift >= 0:
        return curve[shift:], reference[: n - shift]
    return curve[: n + shift], reference[-shift:]


def best_shift(curve: Array, reference: Array) -> int:
    """Shift [points], within a fifth of the range, at which the correlation coefficient of the overlap is largest.

    The smallest shift of equally good ones, to the left before to the right.
    """
    limit = int(MAX_SHIFT * len(curve))
    order = sorted(range(-limit, limit + 1), key=lambda m: (abs(m), -m))
    return max(order, key=lambda m: round(_correlation(*aligned(curve, reference, m)), 12))


def _correlation(a: Array, b: Array) -> float:
    """Correlation coefficient; of a constant, which has none, -1: the worst."""
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / norm if norm > 0.0 else -1.0


def magnitude_score(curve: Array, reference: Array) -> float:
    """Score of the difference that remains after dynamic time warping within a tenth of the range."""
    i, j = _warping_path(curve, reference)
    error = float(np.abs(curve[i] - reference[j]).sum() / np.abs(reference[j]).sum())
    return float(np.clip((MAX_MAGNITUDE - error) / MAX_MAGNITUDE, 0.0, 1.0))


def _warping_path(a: Array, b: Array) -> tuple[list[int], list[int]]:
    """Indices of the cheapest warping path by squared difference, in a band around the diagonal."""
    n = len(a)
    band = math.ceil(WARP_WINDOW * n) - 1
    cost = np.full((n + 1, n + 1), np.inf)
    cost[0, 0] = 0.0
    for i in range(1, n + 1):
        for j in range(max(1, i - band), min(n, i + band) + 1):
            before = min(cost[i - 1, j - 1], cost[i - 1, j], cost[i, j - 1])
            cost[i, j] = (a[i - 1] - b[j - 1]) ** 2 + before
    i = j = n
    left, right = [], []
    while i > 0 and j > 0:
        left.append(i - 1)
        right.append(j - 1)
        steps = ((cost[i - 1, j], i - 1, j), (cost[i, j - 1], i, j - 1), (cost[i - 1, j - 1], i - 1, j - 1))
        _, i, j = min(steps, key=lambda step: step[0])
    return left, right


def slope_score(curve: Array, reference: Array) -> float:
    """Score of the difference of slopes, each averaged over nine points, over fewer towards the ends."""
    slopes = _smoothed(np.gradient(curve)), _smoothed(np.gradient(reference))
    total = float(np.abs(slopes[1]).sum())
    error = float(np.abs(slopes[0] - slopes[1]).sum()) / total if total > 0.0 else np.inf
    return float(np.clip((MAX_SLOPE - error) / MAX_SLOPE, 0.0, 1.0))


def _smoothed(values: Array) -> Array:
    """Means over windows centred on each point; they shrink to 7, 5, 3 and 1 points at the ends."""
    last = len(values) - 1
    reach = [min(SLOPE_WINDOW // 2, k, last - k) for k in range(last + 1)]
    return np.array([values[k - r : k + r + 1].mean() for k, r in enumerate(reach)])
