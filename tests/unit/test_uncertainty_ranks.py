"""A sample without the columns of Sobol's indices, and the regression of ranks on it."""

from pathlib import Path

import numpy as np
import pytest
from calibration_cases import Pretending
from html_page import HtmlPage
from uncertainty_cases import STUDY, outcome, shearing, study, values, variable

from knittest.studies.uncertainty.indices import no_regression_reason, rank_regression
from knittest.studies.uncertainty.problem import design

RESULT = Path("runs/uncertainty-u")
FRICTION, DEGREE = "fabric.contact.friction_coefficient", "fabric.knitting.degree_of_set"


def test_a_regression_of_ranks_finds_the_shares_of_any_rising_function():
    drawn = design(3, 128, 4)[:2].reshape(-1, 3)
    found = rank_regression(drawn, np.exp(9.0 * (4.0 * drawn[:, 0] - 2.0 * drawn[:, 1])), 1)
    assert found.coefficient == pytest.approx([np.sqrt(0.8), -np.sqrt(0.2), 0.0], abs=0.03)
    assert found.explained > 0.95
    for value, low, high in zip(found.coefficient, *found.interval, strict=True):
        assert low - 0.02 <= value <= high + 0.02 and high - low < 0.15
    hump = rank_regression(drawn, -np.abs(drawn[:, 2] - 0.5), 1)
    assert hump.explained < 0.1  # neither rises nor falls: it says that it explains nothing


def test_points_without_a_number_are_left_out_of_a_regression_and_too_few_have_none():
    drawn = design(3, 16, 4)[:2].reshape(-1, 3)
    values_ = drawn @ [4.0, -2.0, 0.0]
    gone = np.where(np.arange(32) % 3 == 0, np.nan, values_)
    assert rank_regression(drawn, gone, 1).coefficient == pytest.approx([0.9, -0.45, 0.0], abs=0.1)
    assert no_regression_reason(drawn, gone) == "" and no_regression_reason(drawn, np.zeros(32)) != ""
    assert no_regression_reason(drawn, np.where(np.arange(32) < 8, values_, np.nan)).startswith(
        "8 points have a result"
    )


def test_a_sample_runs_two_parts_only_and_ranks_what_ran(tmp_path, monkeypatch):
    def some(trial):
        return {} if values(trial)[1] < 0.6 else shearing(trial)

    assert study(STUDY + "design: sample\n", tmp_path, monkeypatch, Pretending(some), drawn=True) == 3
    found = outcome(tmp_path)
    assert (found["points"], found["runs"], found["design"]) == (32, 64, "sample")
    ratio = variable(tmp_path, "V2/V1 force, 10")
    assert 20 < ratio["count"] < 32 and 0.8 < ratio["explained"] <= 1.0
    by = {one["parameter"]: one for one in ratio["indices"]}
    assert by[DEGREE]["first"] > 0.5 > abs(by[FRICTION]["first"]) - 0.4 and by[DEGREE]["total"] is None
    page = HtmlPage(tmp_path / RESULT / "report.html")
    page.check()
    said = page.text(page.section("indices"))
    assert "Rank regression" in said and "(R2 " in said and "total" not in said
    assert variable(tmp_path, "V2 onset")["no_indices"] == "the quantity does not change over the prior"
