"""Metrics of a simulated curve against a reference, and its rating after ISO/TS 18571:2014; knows nothing of models."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.result_rows import number_of, of_nominal_size
from knittest.base.summary import ComparisonRow, Value
from knittest.config.base import likely_unit
from knittest.experiment.curves import START, ReferenceCurve
from knittest.experiment.tables import PublishedValue
from knittest.materials.trellis import ANGLE

Array = NDArray[np.float64]

# Objective rating of a curve after ISO/TS 18571:2014: corridor, phase, magnitude, slope.
#
# Scores are 1 for equal curves and 0 beyond the standard's limits; the overall rating weighs them 0.4, 0.2, 0.2, 0.2.
# The standard is written for time histories sampled at 10 kHz; here the points of a common strain grid take that place,
# which is why the tool speaks of an ISO/TS 18571-type rating.
#
# Agrees to rounding with the package ``objective-rating-metrics`` of TU Graz
# (tests/verification/test_rating_outside.py), which also settles what the wording leaves open: where warping paths cost
# the same, the curve waits before the reference does, and both before they go together. One choice is our own:
# correlations that agree to 12 digits count as equal, so that the shift of straight lines, which fit at every shift, is
# zero and not left to rounding.

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


#: points of the common grid on the overlap
GRID = 201
#: a simulated peak or strain this many times the reference's, or the other way round, is in another unit
FAR = 20.0
#: units by column
UNITS = {"strain_pct": "%", "force_n": "N", "shear_angle_deg": "deg", "normalised_shear_force_n_per_mm": "N/mm"}
STRAIN = "strain_pct"
#: ways of a clamp, and of an inlay's free end
TRAVELS = ("displacement_mm", "tail_travel_mm")
#: columns of a run's curve that mean the same as a reference's
SAME = {"force_n": ("force_n", "force_mean_n"), "shear_angle_deg": ("frame_shear_angle_deg",)}
#: shear angles at which forces are compared [deg]
ANGLES = (5.0, 10.0, 20.0, 30.0, 40.0)
#: share of either curve that the common range may leave out of a rating
LEFT_OUT = 0.1
#: kinds of references that nothing is rated against, and why
UNRATED = {
    "reconstructed": "the shape of the reference is reconstructed, not measured",
    "input": "the reference is an input of the model, which only returns it",
    "tuned": "a model parameter was fitted to the reference or selected with it",
}
#: errors of a curve by their keys, and what they are called; one of a pull is a level, where its peak lies is chance
ERRORS = {
    "peak_error_pct": "peak force", "fracture_strain_error_pct": "strain at the peak",
    "static_error_pct": "largest force of the first half", "kinetic_error_pct": "mean force of the second half",
}  # fmt: skip
#: digits kept behind the point
DIGITS = 4


def compare_results(
    results: Mapping[str, Value], rows: Sequence[PublishedValue], kinds: Mapping[str, str], given: Collection[str] = ()
) -> list[ComparisonRow]:
    """One row a published value that the run has a result for: deviation in percent and in the experiment's standard
    deviations, NaN where it states none. The result is that of the nominal size, by the factors of the row.

    ``kinds`` says of each quantity whether the simulated number was predicted, tuned on this row, or input. Quantities
    that the run was ``given`` as such have no deviation.
    """
    found = [_result_row(results[row.quantity], row, kinds[row.quantity]) for row in rows if row.quantity in results]
    for row in found:
        if row["quantity"] in given:
            row["deviation_sd"] = row["deviation_pct"] = math.nan
            row["given"] = True
    return found


def _result_row(value: Value, row: PublishedValue, kind: str) -> ComparisonRow:
    modelled, number = number_of(value), number_of(of_nominal_size(value, row.factors))
    simulated = math.nan if number is None else number
    found: ComparisonRow = {
        "quantity": row.quantity,
        "simulated": simulated,
        "experiment_mean": row.mean,
        "experiment_sd": row.sd,
        "deviation_sd": (simulated - row.mean) / row.sd if row.sd > 0.0 else math.nan,
        "deviation_pct": 100.0 * (simulated / row.mean - 1.0) if row.mean else math.nan,
        "kind": kind,
        "source": row.table,
    }
    if row.scaled:
        found["scaled"] = row.scaled
    if row.factors:
        found["modelled"] = math.nan if modelled is None else modelled
        found["factors"] = list(row.factors)
    return found


def compare_columns(columns: Mapping[str, np.ndarray], reference: ReferenceCurve, reach: str = "") -> dict[str, object]:
    """:func:`compare_curves` on the columns of a curve.csv that ``reference`` is about; raises InputError if it lacks
    them. ``reach`` as there.

    A tensile curve counts up to its peak; of a frame that turns, only what is sheared for the first time.
    """
    x, y = (columns[name] for name in columns_of(columns, reference))
    first = np.append(True, x[1:] > np.maximum.accumulate(x)[:-1])
    if reference.x_name == STRAIN:
        first[int(np.argmax(y)) + 1 :] = False
    return compare_curves(x[first], y[first], reference, reach)


def columns_of(columns: Iterable[str], reference: ReferenceCurve) -> tuple[str, str]:
    """Names among ``columns`` of a curve for x and y of ``reference``; raises :class:`InputError` without any."""
    names = list(columns)
    return column_of(names, reference.x_name, reference), column_of(names, reference.y_name, reference)


def column_of(names: Sequence[str], wanted: str, reference: ReferenceCurve) -> str:
    """The one of ``names`` that holds what ``reference`` calls ``wanted``; raises :class:`InputError` without any."""
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

    ``x``, ``y`` (n,) in the units of the reference, x rising; shear counts from :data:`START` on. Says what it was
    judged against. Curves that share no range, have too few points, are constant or in other units are "not
    comparable", with the reason, without numbers. A rating that would mislead is None, and ``no_rating`` says why, and
    with which field ``reach`` of the rig a longer run would reach the end of the reference.

    >>> x = np.linspace(0.0, 2.0, 50)
    >>> strips = ReferenceCurve("measured", x, 3000.0 * x, None, "strain_pct", "force_n", "five strips")
    >>> found = compare_curves(x, 2700.0 * x, strips)
    >>> found["peak_error_pct"], found["fracture_strain_error_pct"], found["rating"]["grade"]
    (-10.0, 0.0, 'excellent')
    """
    judged = {"judged_against": reference.source, "reference_kind": reference.kind}
    if reference.note:
        judged["note"] = reference.note
    if reference.x_name == ANGLE:
        x, y, reference = _after_start(x, y, reference)
    reason = _hindrance(x, y, reference)
    if reason:
        return judged | {"comparable": False, "reason": reason}
    low, high = max(x[0], reference.x[0]), min(x[-1], reference.x[-1])
    grid = np.linspace(low, high, GRID)
    simulated, measured = np.interp(grid, x, y), np.interp(grid, reference.x, reference.mean)
    rmse = np.sqrt(np.mean((simulated - measured) ** 2))
    peak = float(measured.max()) if reference.x_name in (ANGLE, *TRAVELS) else reference.peak[1]
    if reference.x_name == ANGLE:
        found = _at_angles(grid, simulated, measured, reference)
    else:
        found = _levels(x, y, reference, low, high) if reference.x_name in TRAVELS else _at_peaks(x, y, reference)
    return judged | {
        "comparable": True,
        f"range_{reference.x_name}": [_rounded(low), _rounded(high)],
        **found,
        f"rmse_{reference.y_name}": _rounded(rmse),
        "rmse_pct_of_peak": _rounded(100.0 * rmse / peak),
        **_rated(simulated, measured, _unrated(x, y, reference, reach)),
    }


def _after_start(
    x: np.ndarray, y: np.ndarray, reference: ReferenceCurve
) -> tuple[np.ndarray, np.ndarray, ReferenceCurve]:
    """Both curves of shear from :data:`START` on; as they are where one ends before."""
    if min(x[-1], reference.x[-1]) <= START:
        return x, y, reference
    at, of = (np.append(START, a[a > START]) if a[0] < START else a for a in (x, reference.x))
    mean = np.interp(of, reference.x, reference.mean)
    sd = None if reference.sd is None else np.interp(of, reference.x, reference.sd)
    return at, np.interp(at, x, y), replace(reference, x=of, mean=mean, sd=sd)


def _rated(simulated: np.ndarray, measured: np.ndarray, reason: str) -> dict[str, object]:
    """The rating of two curves on one grid, or for which ``reason`` none is given."""
    if reason:
        return {"rating": None, "no_rating": reason}
    scores = rate(simulated, measured)
    return {"rating": {k: _rounded(v) for k, v in scores.items()} | {"grade": grade(scores["overall"])}}


def _unrated(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve, reach: str) -> str:
    """Reason why a rating would say nothing, or too much; empty if one may be given.

    A strip's curve counts up to its peak, that of a frame or of a strip between plates up to its end.
    """
    if reference.kind in UNRATED:
        return UNRATED[reference.kind]
    if reference.doubt:
        return reference.doubt
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


def _at_peaks(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve) -> dict[str, object]:
    """Both peaks, and how far they are apart."""
    end, peak = int(np.argmax(y)), reference.peak
    return {
        "simulated_peak": _point(reference, x[end], y[end]),
        "reference_peak": _point(reference, *peak),
        "peak_error_pct": _rounded(100.0 * (y[end] / peak[1] - 1.0)),
        "fracture_strain_error_pct": _rounded(100.0 * (x[end] / peak[0] - 1.0)),
    }


def _levels(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve, low: float, high: float) -> dict[str, object]:
    """Both levels of a pull between ``low`` and ``high``: the largest force of the first half, mean of the second."""
    half = 0.5 * (low + high)
    late = np.linspace(half, high, GRID)
    levels = {
        name: (float(force[(travel >= low) & (travel <= half)].max()), float(np.interp(late, travel, force).mean()))
        for name, travel, force in (("simulated", x, y), ("reference", reference.x, reference.mean))
    }
    found: dict[str, object] = {
        f"{name}_levels": dict(zip(("static_n", "kinetic_n"), map(_rounded, both), strict=True))
        for name, both in levels.items()
    }
    errors = [
        _rounded(100.0 * (one / other - 1.0)) if other else None for one, other in zip(*levels.values(), strict=True)
    ]
    return found | dict(zip(("static_error_pct", "kinetic_error_pct"), errors, strict=True))


def _at_angles(grid: np.ndarray, simulated: np.ndarray, measured: np.ndarray, ref: ReferenceCurve) -> dict[str, object]:
    """Both forces at the angles that both curves cover, and where the first of them ends: a shear curve has no peak."""
    found = {}
    for angle in (*(a for a in ANGLES if grid[0] <= a < grid[-1]), float(grid[-1])):
        one, other = (float(np.interp(angle, grid, v)) for v in (simulated, measured))
        error = _rounded(100.0 * (one / other - 1.0)) if other else None
        forces = (float(f"{force:.5g}") for force in (one, other))
        found[f"{angle:.4g}"] = dict(zip(("simulated", "reference", "error_pct"), (*forces, error), strict=True))
    return {f"{ref.y_name}_at_deg": found}


def _point(reference: ReferenceCurve, x: float, y: float) -> dict[str, float]:
    return {reference.x_name: _rounded(x), reference.y_name: _rounded(y)}


def _rounded(value: float) -> float:
    return round(float(value), DIGITS) + 0.0  # no -0.0


def _hindrance(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve) -> str:
    """Reason why two curves cannot be compared; empty if they can."""
    for name, values in (("simulated", y), ("reference", reference.mean)):
        if len(values) < 3:
            return f"the {name} curve has {len(values)} points"
        if not np.ptp(values) > 0.0:
            return f"the {name} curve is constant"
    if min(x[-1], reference.x[-1]) <= max(x[0], reference.x[0]):
        return "the curves have no common range"
    return _other_units(x, y, reference)


def _other_units(x: np.ndarray, y: np.ndarray, reference: ReferenceCurve) -> str:
    """Peaks, or their places, that lie so far apart that one of them is in another unit; empty if none."""
    end, peak = int(np.argmax(y)), reference.peak
    if reference.x_name in (ANGLE, *TRAVELS):  # up to where the shorter one ends
        last = min(x[-1], reference.x[-1])
        end, peak = (
            int(np.searchsorted(x, last, side="right")) - 1,
            (last, float(np.interp(last, reference.x, reference.mean))),
        )
    found = []
    for name, simulated, measured in zip((reference.x_name, reference.y_name), (x[end], y[end]), peak, strict=True):
        if not simulated / FAR < measured < simulated * FAR:
            unit = UNITS.get(name, "")
            guess = likely_unit(measured, unit, (simulated / 5.0, simulated * 5.0))
            found.append(
                f"{name} at the peak is {measured:g} {unit} in the reference{guess}, {simulated:.4g} in the run"
            )
    return f"the units seem to differ: {'; '.join(found)}" if found else ""
