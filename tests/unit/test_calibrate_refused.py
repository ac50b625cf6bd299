"""Calibrations that lose trials, run out of runs or are refused: what they say and what they keep."""

from pathlib import Path

import pytest
from calibration_cases import BEND, TWO, WARP, WEFT, Pretending, calibrate, outcome, overhang, stiffness, values

from knittest.base.errors import InputError, ResourceError

RESULT = Path("runs/calibrate-c")


def lost_between(low: float, high: float, status: str = "timeout"):
    return lambda trial: status if low <= stiffness(trial) <= high else "completed"


@pytest.mark.parametrize("status", ["timeout", "failed", "refused", "crashed", "invalid", "error"])
def test_a_lost_trial_is_recorded_and_does_not_count(tmp_path, monkeypatch, status):
    calibrate(BEND, tmp_path, monkeypatch, Pretending())
    third = outcome(tmp_path)["evaluations"][2]["values"][0]
    (tmp_path / "b").mkdir()
    lost = Pretending(ends=lost_between(0.97 * third, 1.001 * third, status))
    assert calibrate(BEND, tmp_path / "b", monkeypatch, lost) == 0
    found = outcome(tmp_path / "b")
    assert abs(overhang(values(tmp_path / "b")[0]) - 171.0) <= 0.51
    (gone,) = [one for one in found["evaluations"] if one["reason"]]
    assert gone["values"] == [third] and gone["simulated"] is None
    assert gone["reason"] == f"bend {status}: {status} on purpose"
    assert found["runs_by_status"][status] == 1


def test_bounds_without_a_result_are_moved_and_no_result_around_the_root_leaves_no_fabric(tmp_path, monkeypatch):
    assert calibrate(BEND, tmp_path, monkeypatch, Pretending(ends=lost_between(0.0, 2.3, "failed"))) == 0
    assert abs(overhang(values(tmp_path)[0]) - 171.0) <= 0.51
    assert calibrate(BEND, tmp_path, monkeypatch, Pretending()) == 0 and (RESULT / "fabric.yaml").exists()
    wide = BEND.replace("high: 12", "high: 15")
    assert calibrate(wide, tmp_path, monkeypatch, Pretending(ends=lost_between(4.0, 6.5))) == 3
    assert (
        outcome(tmp_path)["status"] == "not converged"
        and "between the bounds have no result" in outcome(tmp_path)["reason"]
    )
    assert not (RESULT / "fabric.yaml").exists()


@pytest.mark.parametrize(
    ("results", "said"),
    [
        (lambda trial: {"overhang_mm": 100.0 + stiffness(trial)}, "c.yaml:4: the bounds do not enclose the target"),
        (lambda trial: {"overhang_mm": 100.0}, "fabric.macro.bending_stiffness.warp has no influence"),
        (
            lambda trial: {"overhang_mm": 100.0 if stiffness(trial) < 5.0 else 300.0},
            "jumps over the target at fabric.macro.bending_stiffness.warp = 5",
        ),
    ],
)
def test_a_target_out_of_reach_is_said(tmp_path, monkeypatch, results, said):
    assert calibrate(BEND, tmp_path, monkeypatch, Pretending(results)) == 3
    assert said in outcome(tmp_path)["reason"] and not (RESULT / "fabric.yaml").exists()


@pytest.mark.parametrize(("method", "least"), [("differential-evolution", 67), ("optuna", 40)])
def test_too_few_runs_for_a_search_are_said(tmp_path, monkeypatch, method, least):
    if method == "optuna":
        pytest.importorskip("optuna")
    pool = Pretending()
    assert calibrate(BEND + "max_runs: 3\n", tmp_path, monkeypatch, pool) == 3 and len(pool.asked) == 3
    assert outcome(tmp_path)["reason"] == "the search needs more than max_runs = 3 runs"
    lost = Pretending(ends=lambda trial: "failed")
    assert calibrate(f"{TWO}method: differential-evolution\nmax_runs: 150\n", tmp_path, monkeypatch, lost) == 3
    assert "points has a result: one failed" in outcome(tmp_path)["reason"]
    assert calibrate(f"{TWO}method: {method}\nmax_runs: 30\n", tmp_path, monkeypatch, Pretending()) == 3
    assert outcome(tmp_path)["reason"] == f"max_runs = 30: {method} needs at least {least} runs here"
    assert (RESULT / "convergence.png").exists()


@pytest.mark.parametrize("number", [1, 3], ids=["finite difference", "step"])
def test_least_squares_goes_round_what_gives_no_number(tmp_path, monkeypatch, number):
    calibrate(TWO, tmp_path, monkeypatch, Pretending())
    gone = outcome(tmp_path)["evaluations"][number]["values"]
    (tmp_path / "b").mkdir()
    lost = Pretending(ends=lambda trial: "failed" if stiffness(trial) == gone[0] else "completed")
    assert calibrate(TWO, tmp_path / "b", monkeypatch, lost) == 0
    found = outcome(tmp_path / "b")
    assert values(tmp_path / "b") == pytest.approx([WARP, WEFT], rel=0.02 * 3 * 51 / 171)
    assert gone in [one["values"] for one in found["evaluations"] if one["reason"]]


def test_no_room_ends_it_and_keeps_what_is_finished(tmp_path, monkeypatch):
    full = Pretending(ends=lambda trial: "blocked" if 2.0 < stiffness(trial) < 12.0 else "completed")
    with pytest.raises(ResourceError, match="finished runs are kept"):
        calibrate(BEND, tmp_path, monkeypatch, full)
    pool = Pretending()
    assert calibrate(BEND, tmp_path, monkeypatch, pool) == 0 and pool.asked[0] == full.asked[2]


def test_a_result_that_the_test_does_not_have_is_refused(tmp_path, monkeypatch):
    text = BEND.replace("quantity: overhang_mm", "quantity: overhnag, value: 1, sd: 1")
    with pytest.raises(InputError, match=r"c.yaml:8: quantity = overhnag: the test has no such result \(known: over"):
        calibrate(text, tmp_path, monkeypatch, Pretending())


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("low: 2, high: 12", "low: 12, high: 2", "c.yaml:4: parameters.fabric.macro.bending_stiffness.warp.high = 2: "),
        ("low: 2,", "low: 1e-5,", "c.yaml:4: fabric.macro.bending_stiffness.warp = 1e-05: implausible"),
        ("stiffness.warp", "stifness.warp", 'unknown field (did you mean "fabric.macro.bending_stiffness.warp"?)'),
        ("spacing: log", "also: [fabric.macro.bending_stiffness.warp]", "given twice"),
        ("spacing: log", "mean: 5", "parameters.fabric.macro.bending_stiffness.warp.sd: missing"),
        ("quantity: overhang_mm", "quantity: peak_force", "c.yaml:8: quantity = peak_force: no row of variant 1 warp"),
        ("quantity: overhang_mm", "quantity: bending_stiffness_eq2_n_mm_per_width", "states no scatter: add sd"),
        ("quantity: overhang_mm", "curve: none.csv", "c.yaml:8: curve: "),
        ("test: bend,", "test: bnd,", "c.yaml:8: test = bnd: no such test in this file (known: bend)"),
        ("variant: 1", "variant: 9", "c.yaml:2: --variant 9: unknown fabric"),
        ("variant: 1", "fabric: none.yaml", "c.yaml:2: no such file"),
        ("tolerance: 0.01", "storage: sqlite", "only method = optuna uses a database"),
        ("targets:", "  spare: {test: friction}\ntargets:", "tests.spare: no target belongs to this test"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_with_its_line_before_anything_runs(tmp_path, monkeypatch, old, new, said):
    pool = Pretending()
    with pytest.raises(InputError) as error:
        calibrate(BEND.replace(old, new), tmp_path, monkeypatch, pool)
    assert said in str(error.value) and pool.asked == [] and not (tmp_path / "runs").exists()
