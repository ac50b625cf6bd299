"""Means of few specimens: their deviation has the interval of the mean, and no verdict that others could turn."""

import math

import pytest

from knittest.base.result_rows import FEW, UNRESOLVED, mean_error, result_rows


def spread(mean: float, sd: float, count: int) -> dict:
    return {"mean": mean, "sd": sd, "values": [mean] * count}


def row(value: dict, kind: str = "predicted", **more) -> object:
    compared = {
        "quantity": "peak_force_n", "simulated": value["mean"], "experiment_mean": 5800.0, "experiment_sd": 400.0,
        "deviation_sd": (value["mean"] - 5800.0) / 400.0, "kind": kind, "source": "Table 3",
    }  # fmt: skip
    (found,) = result_rows({"results": {"peak_force_n": value}, "comparison": [compared], **more}, refused=False)
    return found


@pytest.mark.parametrize(("count", "factor"), [(2, 12.706), (3, 4.303), (8, 2.365)])
def test_half_the_interval_of_a_mean_is_that_of_students_t(count, factor):
    """Factors of the tables (95 %, two-sided)."""
    assert mean_error(spread(5.0, 2.0, count)) == pytest.approx(factor * 2.0 / math.sqrt(count), rel=1e-3)
    assert mean_error(5.0) == mean_error(None) == 0.0 and math.isnan(mean_error(spread(5.0, 2.0, 1)))


def test_two_specimens_that_scatter_get_no_verdict_and_no_sd():
    found = row({"mean": 6000.0, "sd": 917.0, "values": [5351.6, 6648.4]})
    assert found.simulated == "6000 (n 2: 5352, 6648)"
    assert (found.deviation, found.verdict) == ("+0.50 ± 20.60 sd", FEW)


def test_enough_specimens_get_one():
    assert row(spread(6000.0, 150.0, 8)).verdict == "within 1 sd"
    assert row(spread(6600.0, 150.0, 8)).verdict == "outside 1 sd"
    assert row(spread(6000.0, 500.0, 8)).verdict == FEW


def test_the_numerical_error_adds_to_it_and_is_named_where_it_is_enough():
    errors = {"numerical_error": {"peak_force_n": {"error": 260.0}}}
    assert row(spread(6000.0, 10.0, 8), **errors).verdict == UNRESOLVED
    errors["numerical_error"]["peak_force_n"]["error"] = 100.0
    found = row(spread(6000.0, 100.0, 8), **errors)
    assert found.verdict == "within 1 sd" and found.deviation == "+0.50 ± 0.46 sd"
    assert row(spread(6000.0, 250.0, 8), **errors).verdict == FEW


def test_an_input_is_returned_however_few_specimens_there_are():
    assert row({"mean": 6000.0, "sd": 917.0, "values": [5351.6, 6648.4]}, "input").verdict == "within 1 sd"
