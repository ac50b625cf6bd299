"""Scatter by rounding in the regression's baseline."""

from pathlib import Path

import numpy as np
import pytest

from knittest.laboratory.restart import SPEED
from knittest.studies.regress.baseline import Curve, Entry
from knittest.studies.regress.cases import Case
from knittest.studies.regress.drift import RUNS, drift_of, pool_entries, rounding_trials
from knittest.studies.trials.trial import Record

FRAME = Case("picture-frame", "macro", "1", None, "quick", enlarges=True)
COUNT = "wrinkle_count_at_40deg"
X, Y = "frame_shear_angle_deg", "shear_force_n"


def entry(results, y=(0.0, 1.0, 2.0)) -> Entry:
    """An entry with a curve at 0, 1, 2 deg."""
    curve = Curve(x_name=X, y_name=Y, x=[0.0, 1.0, 2.0], y=list(y))
    return Entry(commit=None, date="", cpu="", elements=4, results=results, curve=curve)


def curve_of(folder: Path, x, y) -> Path:
    """A folder with a curve.csv of a frame."""
    folder.mkdir()
    np.savetxt(folder / "curve.csv", np.column_stack([x, y]), delimiter=",", header=f"{X},{Y}", comments="")
    return folder


def test_the_other_runs_differ_in_nothing_but_billionths_of_their_steps():
    trial = FRAME.trial()
    others = rounding_trials(FRAME, trial)
    own = trial.run.solver.safety
    assert len({one.key for one in [trial, *others]}) == RUNS
    assert [1.0 - one.run.solver.safety / own for one in others] == pytest.approx(1e-9 * np.arange(1, RUNS), rel=1e-6)
    assert all(one.run.model_copy(update={"solver": trial.run.solver}) == trial.run for one in others)
    assert rounding_trials(Case("tensile", "macro", "1", "warp", "quick"), trial) == []


def test_mean_and_standard_deviation_are_stored_and_what_one_run_lacks_is_not(tmp_path):
    """Of 1, 2, 6: mean 3, variance (4 + 1 + 9) / 2 = 7; of curves 0, 1, 2 and 0, 3, 6 and 0, 2, 4: sd 0, 1, 2."""
    run = FRAME.trial().run
    places = [
        (run, curve_of(tmp_path / "a", [0.0, 0.5, 3.0], [0.0, 1.5, 9.0])),
        (run, curve_of(tmp_path / "b", [0.0, 2.0], [0.0, 4.0])),
    ]
    found = pool_entries(entry({"a": 1.0, "b": 1.0}), [entry({"a": 2.0}), entry({"a": 6.0, "c": 0.0})], places, ())
    assert (found.runs, found.results, found.scatter) == (3, {"a": 3.0}, {"a": pytest.approx(7.0**0.5, rel=1e-5)})
    assert (found.sometimes, found.ranges) == (["b", "c"], {})
    assert found.curve is not None
    assert found.curve.y == pytest.approx([0.0, 2.0, 4.0]) and found.curve.scatter == pytest.approx([0.0, 1.0, 2.0])
    crests = [entry({COUNT: float(n), "a": 1.0}) for n in (3, 5, 4)]
    found = pool_entries(crests[0], crests[1:], places, (COUNT,))  # of crests the range, in place of their scatter
    assert (found.ranges, found.scatter, found.results[COUNT]) == ({COUNT: (3, 5)}, {"a": 0.0}, 4.0)


@pytest.mark.parametrize(("off", "passes"), [(0.49, True), (0.52, False), (-0.49, True), (-0.52, False)])
def test_a_point_of_a_curve_is_judged_by_its_own_scatter(tmp_path, off, passes):
    """At 1 deg five times 0.1 N, and 0.2 % of the 2 N: 0.504 N; at 2 deg, without scatter, 0.004 N."""
    stored = entry({"a": 1.0}).model_copy(update={"runs": RUNS})
    assert stored.curve is not None
    stored = stored.model_copy(update={"curve": stored.curve.model_copy(update={"scatter": [0.0, 0.1, 0.0]})})
    record = Record("k", "completed", summary={"results": {"a": 1.0}, "cost": {"elements": 4}})
    run = FRAME.trial().run
    here = curve_of(tmp_path / "here", [0.0, 1.0, 2.0], [0.0, 1.0 + off, 2.0])
    assert drift_of(FRAME, run, record, here, stored).passed == passes
    there = curve_of(tmp_path / "there", [0.0, 1.0, 2.0], [0.0, 1.0, 2.0 + 0.01 * np.sign(off)])
    (reason,) = drift_of(FRAME, run, record, there, stored).reasons
    assert f"{X} 2" in reason


def test_a_stored_run_that_lowers_its_speed_fails(tmp_path):
    """The speed is no number of the baseline: it is that of the run, unless the test restarted."""
    run, here = FRAME.trial().run, curve_of(tmp_path / "a", [0.0, 1.0, 2.0], [0.0, 1.0, 2.0])
    for share in (1.0, 0.5):
        summary = {"results": {"a": 1.0, SPEED: share * run.solver.speed}, "cost": {"elements": 4}}
        found = drift_of(FRAME, run, Record("k", "completed", summary=summary), here, entry({"a": 1.0}))
        assert found.passed == (share == 1.0)
    assert found.reasons[0].startswith(SPEED)
