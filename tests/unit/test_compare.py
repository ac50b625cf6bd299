"""Metrics against closed forms: equal curves, pure scale, pure shift, curves that cannot be compared."""

import numpy as np
import pytest

from knittest.experiment.comparison import (
    best_shift,
    compare_curves,
    compare_results,
    corridor_score,
    grade,
    magnitude_score,
    rate,
    slope_score,
)
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import PublishedValue

X = np.linspace(0.0, 1.6, 201)
Y = 5800.0 * (X / 1.6) ** 2


def reference(x=X, y=Y, kind="measured"):
    return ReferenceCurve(kind, x, y, None, "strain_pct", "force_n", "test")


@pytest.mark.parametrize("factor", [1.1, 0.8])
def test_equal_and_scaled_curves(factor):
    """A constant reference T and a curve f T: corridor ((0.5 - |f-1|)/0.45)^2, magnitude 1 - |f-1|/0.5."""
    assert list(rate(Y, Y).values()) == pytest.approx([1.0] * 5) and grade(rate(Y, Y)["overall"]) == "excellent"
    flat = np.full(101, 7.0)
    assert corridor_score(factor * flat, flat) == pytest.approx(((0.5 - abs(factor - 1.0)) / 0.45) ** 2)
    assert magnitude_score(factor * flat, flat) == pytest.approx(1.0 - abs(factor - 1.0) / 0.5)
    line = np.linspace(0.0, 3.0, 101)
    assert slope_score(1.5 * line, line) == pytest.approx(1.0 - 0.5 / 2.0)


@pytest.mark.parametrize("shift", [12, -7])
def test_pure_shift_is_found_and_costs_only_phase(shift):
    t = np.arange(300)
    pulse = lambda at: np.exp(-(((t - at) / 20.0) ** 2))  # noqa: E731
    assert best_shift(pulse(150 + shift), pulse(150)) == shift
    scores = rate(pulse(150 + shift), pulse(150))
    assert scores["phase"] == pytest.approx(1.0 - abs(shift) / 60.0)
    assert scores["magnitude"] == pytest.approx(1.0, abs=1e-6)


def test_peak_and_rmse_of_a_scaled_curve():
    result = compare_curves(X, 1.1 * Y, reference(kind="reconstructed"))
    assert result["peak_error_pct"] == pytest.approx(10.0)
    assert result["fracture_strain_error_pct"] == pytest.approx(0.0)
    assert result["rmse_force_n"] == pytest.approx(0.1 * np.sqrt(np.mean(Y**2)))
    assert result["reference_kind"] == "reconstructed"


def test_a_stated_peak_is_judged_where_the_mean_curve_ends_before_it():
    cut = ReferenceCurve("measured", X[:180], Y[:180], None, "strain_pct", "force_n", "test", (1.6, 5800.0))
    result = compare_curves(X, Y, cut)
    assert result["reference_peak"] == {"strain_pct": 1.6, "force_n": 5800.0}
    assert (result["peak_error_pct"], result["fracture_strain_error_pct"], result["rmse_force_n"]) == (0.0, 0.0, 0.0)
    assert result["range_strain_pct"] == pytest.approx([0.0, X[179]])


PEAK = "at the peak is"


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        (X[:1], Y[:1], "1 points"),
        (X, np.full_like(Y, 3.0), "constant"),
        (X + 5.0, Y, "no common range"),
        (0.01 * X, Y, f"strain_pct {PEAK} 0.016 % in the reference (it looks like a fraction: 1.6 %), 1.6 in the run"),
        (X, 1e-3 * Y, f"force_n {PEAK} 5.8 N in the reference (it looks like kN: 5800 N), 5800 in the run"),
        (0.01 * X, 1e-3 * Y, "kN: 5800 N"),
        (X, 1e6 * Y, f"force_n {PEAK} 5.8e+09 N in the reference, 5800 in the run"),
    ],
)
def test_not_comparable_is_said_and_never_scored(x, y, words):
    result = compare_curves(X, Y, reference(x, y))
    assert result["comparable"] is False and words in result["reason"] and "rating" not in result


@pytest.mark.parametrize(("sd", "n", "deviation"), [(0.0, 1, np.nan), (461.0, 16, 1.0)])
def test_results_are_counted_in_standard_deviations_if_there_are_any(sd, n, deviation):
    rows = [PublishedValue("peak_force_n", 5820.0, sd, n, "N", "Table 3")]
    (row,) = compare_results({"peak_force_n": 6281.0}, rows, {"peak_force_n": "predicted"})
    assert row["deviation_sd"] == pytest.approx(deviation, nan_ok=True)
