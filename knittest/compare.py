"""Metrics of a simulated curve against a reference; knows nothing of models."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import PublishedValue
from knittest.rating import grade, rate

#: points of the common grid on the overlap
GRID = 201


def compare_results(
    results: Mapping[str, float], rows: Sequence[PublishedValue], kinds: Mapping[str, str]
) -> list[dict[str, Any]]:
    """One row a published value that the run has a result for: deviation in the experiment's standard deviations.

    ``kinds`` says of each quantity whether the simulated number was predicted, tuned on this row, or input.
    """
    return [
        {
            "quantity": row.quantity,
            "simulated": results[row.quantity],
            "experiment_mean": row.mean,
            "experiment_sd": row.sd,
            "deviation_sd": (results[row.quantity] - row.mean) / row.sd,
            "kind": kinds[row.quantity],
            "source": row.table,
        }
        for row in rows
        if row.quantity in results
    ]


def compare_curves(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve) -> dict[str, Any]:
    """Peak, fracture strain, RMSE and ISO/TS 18571-type rating of y(x) on the range both curves cover.

    ``x``, ``y`` (n,) in the units of the reference. Says what it was judged against. Curves that share no
    range, have too few points or are constant are "not comparable", with the reason, and get no numbers.
    """
    judged = {"judged_against": reference.source, "reference_kind": reference.kind}
    reason = _hindrance(x, y, reference)
    if reason:
        return judged | {"comparable": False, "reason": reason}
    low, high = max(x[0], reference.x[0]), min(x[-1], reference.x[-1])
    grid = np.linspace(low, high, GRID)
    simulated, measured = np.interp(grid, x, y), np.interp(grid, reference.x, reference.mean)
    scores = rate(simulated, measured)
    top, end = int(np.argmax(reference.mean)), int(np.argmax(y))
    rmse = float(np.sqrt(np.mean((simulated - measured) ** 2)))
    return judged | {
        "comparable": True,
        "range": [float(low), float(high)],
        "peak_error_pct": 100.0 * float(y[end] / reference.mean[top] - 1.0),
        "fracture_strain_error_pct": 100.0 * float(x[end] / reference.x[top] - 1.0),
        "rmse": rmse,
        "rmse_pct_of_peak": 100.0 * rmse / float(reference.mean[top]),
        "rating": scores | {"grade": grade(scores["overall"])},
    }


def _hindrance(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve) -> str:
    """Why two curves cannot be compared; empty if they can."""
    for name, values in (("simulated", y), ("reference", reference.mean)):
        if len(values) < 3:
            return f"the {name} curve has {len(values)} points"
        if not np.ptp(values) > 0.0:
            return f"the {name} curve is constant"
    if min(x[-1], reference.x[-1]) <= max(x[0], reference.x[0]):
        return "the curves share no range"
    return ""
