"""Sensitivities of benchmarks: powers are found again, changes are those that are named, refusals are marked."""

import numpy as np
import pandas as pd
import pytest

from benchmarks.sensitivities import FACTORS, LOOPS, PARAMETERS, ROUNDING, TESTS, sensitivities, sweeps_of
from knittest.base.kinds import kinds


def powers(refused: int = -1) -> pd.DataFrame:
    """Runs of a result that goes with the 0th, 1st, 2nd ... power of the parameters; one that a gate ``refused``."""
    factors = [1.0] * (1 + len(ROUNDING))
    for number in range(len(PARAMETERS)):
        factors += [factor**number for factor in FACTORS]
    status = ["refused" if row == refused else "completed" for row in range(len(factors))]
    return pd.DataFrame({"status": status, "result": 3.0 * np.array(factors)})


def test_a_power_law_gives_its_powers():
    slopes, noise = sensitivities(powers(), "result")
    assert [one.value for one in slopes] == pytest.approx(list(range(len(PARAMETERS)))) and noise == 0.0
    assert [str(one) for one in slopes[:2]] == ["+0.00", "+1.00"]


def test_a_pair_with_a_refused_run_stands_in_brackets_and_a_lost_one_is_a_dash():
    table = powers(refused=1 + len(ROUNDING) + 3)
    slopes, _ = sensitivities(table, "result")
    assert [str(one) for one in slopes[:3]] == ["+0.00", "(+1.00)", "+2.00"]
    table.loc[1 + len(ROUNDING), "result"] = np.nan
    assert str(sensitivities(table, "result")[0][0]) == "-"


def test_rounding_is_told_by_runs_that_are_otherwise_equal():
    table = powers()
    table.loc[:2, "result"] = [3.0, 3.0 * np.exp(0.02), 3.0 * np.exp(-0.02)]
    assert sensitivities(table, "result")[1] == pytest.approx(0.02 * np.sqrt(2.0) / np.log(1.5))


@pytest.mark.parametrize("test", TESTS)
def test_each_run_changes_one_parameter_of_the_shipped_fabric(test):
    (name, points), (other, draw_ins) = sweeps_of(test)
    start, own = points[0], [one for one in PARAMETERS if one.start is None]
    assert (name, other, len(points)) == (test, f"{test}-draw-in", 1 + len(ROUNDING) + 2 * len(own))
    for number, one in enumerate(own):
        for point, factor in zip(points[3 + 2 * number : 5 + 2 * number], FACTORS, strict=True):
            changed = {field: value / start[field] for field, value in point.items() if value != start[field]}
            if one.rest:
                assert changed == {f"{LOOPS}.degree_of_set.value": pytest.approx((1.0 - 0.1 * factor) / 0.9)}
            else:
                assert changed == {field: pytest.approx(factor**power) for field, power in one.powers.items()}
    assert [list(point.values()) for point in draw_ins] == [[1.2], [0.8]]
    assert set(TESTS[test].results) <= set(kinds()[test].labels)
