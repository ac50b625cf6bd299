"""Metrics of a simulated curve against a reference, and its rating after ISO/TS 18571:2014; knows nothing of models."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.result_rows import number_of, to_nominal_size
from knittest.base.summary import ComparisonRow, Value
from knittest.config.base import likely_unit
from knittest.experiment.curves import START, ReferenceCurve
from knittest.experiment.tables import PublishedValue
from knittest.materials.trellis import ANGLE

Array = NDArray[np.float64]

# Objective rating of a curve after ISO/TS 18571:2014: corridor, phase, magnitude, slope.
#
# Scores are 1 for equal curves and 0 beyond the limits of the standard, which is written for time histories at 10 kHz.
# Here the points are a common strain grid, hence an ISO/TS 18571-type rating.
#
# It agrees to rounding with the package ``objective-rating-metrics`` of TU Graz (test_rating_outside.py), also for
# warping paths of equal cost: the curve waits first, then the reference, then both advance. Own choice: correlations
# that agree to 12 digits count as equal, so that straight lines have no shift.

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
    shifted, kept = align_curves(curve, reference, shift)
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


def align_curves(curve: Array, reference: Array, shift: int) -> tuple[Array, Array]:
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

    def correlation(shift: int) -> float:
        a, b = (part - part.mean() for part in align_curves(curve, reference, shift))
        norm = float(np.linalg.norm(a) * np.linalg.norm(b))
        return round(float(a @ b) / norm if norm > 0.0 else -1.0, 12)  # a constant has none: -1, the worst

    return max(order, key=correlation)


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
    slope, wanted = _smooth(np.gradient(curve)), _smooth(np.gradient(reference))
    total = float(np.abs(wanted).sum())
    error = float(np.abs(slope - wanted).sum()) / total if total > 0.0 else np.inf
    return float(np.clip((MAX_SLOPE - error) / MAX_SLOPE, 0.0, 1.0))


def _smooth(values: Array) -> Array:
    """Means over windows centred on each point; they shrink to 7, 5, 3 and 1 points at the ends."""
    last = len(values) - 1
    reach = [min(SLOPE_WINDOW // 2, k, last - k) for k in range(last + 1)]
    return np.array([values[k - r : k + r + 1].mean() for k, r in enumerate(reach)])


#: points of the common grid on the overlap
GRID = 201
#: factor between simulated and reference peak or strain beyond which the units differ
FAR = 20.0
#: units by column
UNITS = {"strain_pct": "%", "force_n": "N", "shear_angle_deg": "deg", "normalised_shear_force_n_per_mm": "N/mm"}
STRAIN = "strain_pct"
#: travel of a clamp, and of the free end of an inlay
TRAVELS = ("displacement_mm", "tail_travel_mm")
#: columns of a run's curve that mean the same as a reference's
SAME = {"force_n": ("force_n", "force_mean_n"), "shear_angle_deg": ("frame_shear_angle_deg",)}
#: shear angles at which forces are compared [deg]
ANGLES = (5.0, 10.0, 20.0, 30.0, 40.0)
#: largest share of either curve outside the common range for a rating
LEFT_OUT = 0.1
#: kinds of references without a rating, with the reason
UNRATED = {
    "reconstructed": "the shape of the reference is reconstructed, not measured",
    "input": "the reference is an input of the model, which only returns it",
    "tuned": "a model parameter was fitted to the reference or selected with it",
}
#: names of the errors of a curve; a pull has levels, because the position of its peak is random
ERRORS = {
    "peak_error_pct": "peak force", "fracture_strain_error_pct": "strain at the peak",
    "static_error_pct": "largest force of the first half", "kinetic_error_pct": "mean force of the second half",
}  # fmt: skip
#: digits kept behind the point
DIGITS = 4


def compare_results(
    results: Mapping[str, Value], rows: Sequence[PublishedValue], kinds: Mapping[str, str], given: Collection[str] = ()
) -> list[ComparisonRow]:
    """Compare ``results`` with published ``rows``: deviation in percent and in standard deviations of the experiment.

    Results are scaled to the nominal size by the factors of the row. ``kinds`` states for each quantity whether it was
    predicted, tuned on this row, or input. Quantities ``given`` to the run have no deviation.
    """
    found = [_result_row(results[row.quantity], row, kinds[row.quantity]) for row in rows if row.quantity in results]
    for row in found:
        if row["quantity"] in given:
            row["deviation_sd"] = row["deviation_pct"] = math.nan
            row["given"] = True
    return found


def _result_row(value: Value, row: PublishedValue, kind: str) -> ComparisonRow:
    modelled, number = number_of(value), number_of(to_nominal_size(value, row.factors))
    simulated = math.nan if number is None else number
    found: ComparisonRow = {
        "quantity": row.quantity, "simulated": simulated, "experiment_mean": row.mean, "experiment_sd": row.sd,
        "deviation_sd": (simulated - row.mean) / row.sd if row.sd > 0.0 else math.nan,
        "deviation_pct": 100.0 * (simulated / row.mean - 1.0) if row.mean else math.nan,
        "kind": kind, "source": row.table,
    }  # fmt: skip
    if row.scaled:
        found["scaled"] = row.scaled
    if row.factors:
        found["modelled"] = math.nan if modelled is None else modelled
        found["factors"] = list(row.factors)
    return found


def compare_columns(columns: Mapping[str, np.ndarray], reference: ReferenceCurve, reach: str = "") -> dict[str, object]:
    """:func:`compare_curves` on the columns of a curve.csv; raises :class:`InputError` for a missing one.

    A tensile curve counts up to its peak, a cyclic frame with its first loading only.
    """
    x, y = (columns[name] for name in columns_of(columns, reference))
    first = np.append(True, x[1:] > np.maximum.accumulate(x)[:-1])
    if reference.x_name == STRAIN:
        first[int(np.argmax(y)) + 1 :] = False
    return compare_curves(x[first], y[first], reference, reach)


def columns_of(columns: Iterable[str], reference: ReferenceCurve) -> tuple[str, str]:
    """Return the names among ``columns`` for x and y of ``reference``; raises :class:`InputError` without any."""
    names = list(columns)
    return column_of(names, reference.x_name, reference), column_of(names, reference.y_name, reference)


def column_of(names: Sequence[str], wanted: str, reference: ReferenceCurve) -> str:
    """Return the one of ``names`` for the column ``wanted`` of ``reference``; raises InputError without any."""
    name = next((n for n in (*SAME.get(wanted, ()), wanted) if n in names), None)
    if name is None:
        known = [*names, *(w for w, same in SAME.items() if any(n in names for n in same))]
        raise InputError(
            f"{reference.source}: {wanted}: the run's curve has no such column; "
            f"expected one of {', '.join(sorted(set(known)))}"
        )
    return name


def compare_curves(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve, reach: str = "") -> dict[str, object]:
    """Peak or values at angles, RMSE and ISO/TS 18571-type rating of y(x) on the range both curves cover.

    ``x``, ``y`` (n,) are in the units of the reference, x rising; shear counts from :data:`START` on. Curves without a
    common range, with few points, constant or in other units are not comparable; the result has the reason. A
    misleading rating is None; ``no_rating`` has the reason, and the field ``reach`` of the rig for a longer run.

    >>> x = np.linspace(0.0, 2.0, 50)
    >>> strips = ReferenceCurve("measured", x, 3000.0 * x, None, "strain_pct", "force_n", "five strips")
    >>> found = compare_curves(x, 2700.0 * x, strips)
    >>> found["peak_error_pct"], found["fracture_strain_error_pct"], found["rating"]["grade"]
    (-10.0, 0.0, 'excellent')
    """
    head = {"compared_with": reference.source, "reference_kind": reference.kind}
    if reference.note:
        head["note"] = reference.note
    if reference.x_name == ANGLE and min(x[-1], reference.x[-1]) > START:
        at, of = (np.append(START, a[a > START]) if a[0] < START else a for a in (x, reference.x))
        mean = np.interp(of, reference.x, reference.mean)
        sd = None if reference.sd is None else np.interp(of, reference.x, reference.sd)
        x, y, reference = at, np.interp(at, x, y), replace(reference, x=of, mean=mean, sd=sd)
    if reason := _find_obstacle(x, y, reference):
        return head | {"comparable": False, "reason": reason}
    low, high = max(x[0], reference.x[0]), min(x[-1], reference.x[-1])
    grid = np.linspace(low, high, GRID)
    simulated, measured = np.interp(grid, x, y), np.interp(grid, reference.x, reference.mean)
    rmse = np.sqrt(np.mean((simulated - measured) ** 2))
    peak = float(measured.max()) if reference.x_name in (ANGLE, *TRAVELS) else reference.peak[1]
    if reference.x_name == ANGLE:
        found = _compare_at_angles(grid, simulated, measured, reference)
    else:
        found = (
            _compare_levels(x, y, reference, low, high)
            if reference.x_name in TRAVELS
            else _compare_peaks(x, y, reference)
        )
    rating: dict[str, object] = {"rating": None, "no_rating": _reason_for_no_rating(x, y, reference, reach)}
    if not rating["no_rating"]:
        scores = rate(simulated, measured)
        rating = {"rating": {k: _round(v) for k, v in scores.items()} | {"grade": grade(scores["overall"])}}
    return head | {
        "comparable": True,
        f"range_{reference.x_name}": [_round(low), _round(high)],
        **found,
        f"rmse_{reference.y_name}": _round(rmse),
        "rmse_pct_of_peak": _round(100.0 * rmse / peak),
        **rating,
    }


def _reason_for_no_rating(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve, reach: str) -> str:
    """Return the reason why a rating would be misleading; empty if there is none. Tensile curves end at their peak."""
    if reason := UNRATED.get(reference.kind, reference.doubt):
        return reason
    curves = {"simulated": (x, y), "reference": (reference.x, reference.mean)}
    peaked = reference.x_name == STRAIN
    ends = {name: a[int(np.argmax(b))] if peaked else a[-1] for name, (a, b) in curves.items()}
    common = min(ends.values()) - max(x[0], reference.x[0])
    for name, (a, _) in curves.items():
        left_out = 1.0 - max(common, 0.0) / (ends[name] - a[0]) if ends[name] > a[0] else 1.0
        if left_out > LEFT_OUT:
            limit = f"(limit {100.0 * LEFT_OUT:g} %)"
            outside = f"{100.0 * left_out:.0f} % of the {name} curve is outside the common range {limit}"
            longer = reach and name == "reference" and ends[name] > x[-1]
            return f"{outside}; rerun with --set {reach}={ends[name]:.4g}" if longer else outside
    return ""


def _compare_peaks(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve) -> dict[str, object]:
    end, peak = int(np.argmax(y)), reference.peak
    names = (reference.x_name, reference.y_name)
    return {
        "simulated_peak": dict(zip(names, map(_round, (x[end], y[end])), strict=True)),
        "reference_peak": dict(zip(names, map(_round, peak), strict=True)),
        "peak_error_pct": _round(100.0 * (y[end] / peak[1] - 1.0)),
        "fracture_strain_error_pct": _round(100.0 * (x[end] / peak[0] - 1.0)),
    }


def _compare_levels(
    x: np.ndarray, y: np.ndarray, reference: ReferenceCurve, low: float, high: float
) -> dict[str, object]:
    """Compare the levels of a pull from ``low`` to ``high``: largest force of the first half, mean of the second."""
    half = 0.5 * (low + high)
    late = np.linspace(half, high, GRID)
    levels = {
        name: (float(force[(travel >= low) & (travel <= half)].max()), float(np.interp(late, travel, force).mean()))
        for name, travel, force in (("simulated", x, y), ("reference", reference.x, reference.mean))
    }
    found: dict[str, object] = {
        f"{name}_levels": dict(zip(("static_n", "kinetic_n"), map(_round, both), strict=True))
        for name, both in levels.items()
    }
    errors = [
        _round(100.0 * (one / other - 1.0)) if other else None for one, other in zip(*levels.values(), strict=True)
    ]
    return found | dict(zip(("static_error_pct", "kinetic_error_pct"), errors, strict=True))


def _compare_at_angles(
    grid: np.ndarray, simulated: np.ndarray, measured: np.ndarray, ref: ReferenceCurve
) -> dict[str, object]:
    """Compare the forces at angles that both curves cover, and at the end of the shorter one: shear has no peak."""
    found = {}
    for angle in (*(a for a in ANGLES if grid[0] <= a < grid[-1]), float(grid[-1])):
        one, other = (float(np.interp(angle, grid, v)) for v in (simulated, measured))
        error = _round(100.0 * (one / other - 1.0)) if other else None
        forces = (float(f"{force:.5g}") for force in (one, other))
        found[f"{angle:.4g}"] = dict(zip(("simulated", "reference", "error_pct"), (*forces, error), strict=True))
    return {f"{ref.y_name}_at_deg": found}


def _round(value: float) -> float:
    return round(float(value), DIGITS) + 0.0  # no -0.0


def _find_obstacle(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve) -> str:
    """Return the reason why two curves cannot be compared; empty if they can."""
    for name, values in (("simulated", y), ("reference", reference.mean)):
        if len(values) < 3:
            return f"the {name} curve has {len(values)} points"
        if not np.ptp(values) > 0.0:
            return f"the {name} curve is constant"
    if min(x[-1], reference.x[-1]) <= max(x[0], reference.x[0]):
        return "the curves have no common range"
    end, peak = int(np.argmax(y)), reference.peak
    if reference.x_name in (ANGLE, *TRAVELS):  # up to where the shorter one ends
        last = min(x[-1], reference.x[-1])
        end = int(np.searchsorted(x, last, side="right")) - 1
        peak = last, float(np.interp(last, reference.x, reference.mean))
    found = []  # peaks, or their positions, so far apart that their units must differ
    for name, simulated, measured in zip((reference.x_name, reference.y_name), (x[end], y[end]), peak, strict=True):
        if not simulated / FAR < measured < simulated * FAR:
            unit = UNITS.get(name, "")
            guess = likely_unit(measured, unit, (simulated / 5.0, simulated * 5.0))
            found.append(
                f"{name} at the peak is {measured:g} {unit} in the reference{guess}, {simulated:.4g} in the run"
            )
    return f"the units seem to differ: {'; '.join(found)}" if found else ""
