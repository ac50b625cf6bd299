"""Numerical errors of a verified run: summary, verdicts, terminal, page, and what is left to do."""

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from html_page import HtmlPage
from report_sample import edit_json, write_run

from knittest.base.errors import InputError, ResourceError
from knittest.base.interrupts import Interrupts
from knittest.base.result_rows import UNRESOLVED, result_rows, verdict_of
from knittest.config.loading import resolve
from knittest.laboratory.numerical_error import NOT_ESTIMATED, UNFINISHED, error_notes
from knittest.laboratory.restart import SPEED
from knittest.report_page.page import write_report
from knittest.runs.options import RunOptions
from knittest.runs.terminal_output import error_lines, results_table
from knittest.studies import command, verify
from knittest.studies.trials.trial import Record, trial_of
from knittest.studies.verify import first_specimen_run, needs_verification, read_outcome, verify_outcome

VERIFY = {"sets": ["output.verify=true"]}
PEAK, STRAIN = 5666.25, 1.578125
COST = {"wall_s": 2.0, "cpu_s": 3.5}


def repeats(monkeypatch: pytest.MonkeyPatch, *changed: Any) -> list[Any]:
    """Let the repeats, half and mesh, end with ``changed``: factors on the results, or a status without any."""
    asked: list[Any] = []

    def run(trials: Any, outcome: Any, options: Any) -> dict[str, Record]:
        now = changed[len(asked) : len(asked) + len(trials)]
        asked.extend(trials)
        records = {}
        for trial, change in zip(trials, now, strict=True):
            if isinstance(change, str):
                records[trial.key] = Record(trial.key, change, "why")  # type: ignore[arg-type]
            else:
                results = {"peak_force_n": change * PEAK, "fracture_strain_pct": change * STRAIN}
                records[trial.key] = Record(trial.key, "completed", "", {"results": results, "cost": COST})
        return records

    monkeypatch.setattr(verify, "_records", run)
    return asked


def verified_run(folder: Path, monkeypatch: pytest.MonkeyPatch, *changed: Any, **chosen: Any) -> Any:
    write_run(folder, **(VERIFY | {"preset": "quick"} | chosen))
    repeats(monkeypatch, *changed)
    run = resolve(config=folder / "config.yaml")
    return verify_outcome(read_outcome(run, folder), RunOptions(quiet=True), Interrupts())


def test_the_summary_carries_changes_error_and_what_was_repeated(tmp_path: Path, monkeypatch: Any) -> None:
    outcome = verified_run(tmp_path / "r", monkeypatch, 0.99, 1.02)
    summary = json.loads((tmp_path / "r" / "summary.json").read_text())
    assert summary == outcome.summary
    peak = summary["numerical_error"]["peak_force_n"]
    assert peak["half_speed_pct"] == pytest.approx(-1.0) and peak["coarser_mesh_pct"] == pytest.approx(2.0)
    factor = 3.0 / ((5.0 / 3.0) ** 2 - 1.0)
    assert peak["error"] == pytest.approx((4.0 * 0.01 + factor * 0.02) * PEAK)
    half, mesh = summary["verification"]["half_speed"], summary["verification"]["mesh"]
    assert (half["setting"], half["value"], half["other_value"]) == ("solver.speed", "0.5 m/s", "0.25 m/s")
    assert (mesh["value"], mesh["other_value"], mesh["status"], mesh["cpu_s"]) == ("10 mm", "16.7 mm", "completed", 3.5)
    assert mesh["folder"].startswith("verify/trials/") and not needs_verification(tmp_path / "r", outcome.run)
    per_yarn = summary["numerical_error"]["force_per_yarn_n"]
    assert per_yarn["error"] is None and per_yarn["reason"] == "no number at half the speed"


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        (("refused", 1.0), "solver.speed 0.25 m/s: refused: why"),
        ((1.0, "failed", "refused"), "model.macro.element_size 6.25 mm: refused: why"),
        ((1.0, "error"), "model.macro.element_size 16.7 mm: error: why"),
    ],
)
def test_a_repeat_without_result_leaves_no_error_but_its_reason(
    tmp_path: Path, monkeypatch: Any, changed: tuple[Any, ...], reason: str
) -> None:
    outcome = verified_run(tmp_path / "r", monkeypatch, *changed)
    peak = outcome.summary["numerical_error"]["peak_force_n"]
    assert peak["error"] is None and peak["reason"] == reason
    row = result_rows(outcome.summary, refused=False)[0]
    assert row.simulated == "5666" and row.verdict == "within 1 sd, numerical error unknown"
    assert any(reason in line for line in error_lines([outcome]))
    text = HtmlPage(tmp_path / "r" / "report.html").text()
    assert "not available" in text and reason in text


def test_a_finer_mesh_takes_the_place_of_a_coarser_one_that_is_refused(tmp_path: Path, monkeypatch: Any) -> None:
    outcome = verified_run(tmp_path / "r", monkeypatch, 1.0, "refused", 0.99)
    mesh, peak = outcome.summary["verification"]["mesh"], outcome.summary["numerical_error"]["peak_force_n"]
    assert (mesh["finer"], mesh["ratio"], mesh["instead_of"]) == (True, 1.6, "16.7 mm: refused: why")
    assert peak["finer_mesh_pct"] == pytest.approx(-1.0) and "coarser_mesh_pct" not in peak
    assert peak["error"] == pytest.approx(3.0 * 1.6**2 / (1.6**2 - 1.0) * 0.01 * PEAK)
    assert any("in place of 16.7 mm: refused: why" in line for line in error_lines([outcome]))
    most = {"sets": ["output.verify=true", "model.meso.elements_per_loop=256", "model.meso.elements_per_wave=64"]}
    outcome = verified_run(tmp_path / "m", monkeypatch, 1.0, "refused", scale="meso", **most)  # no finer mesh fits
    peak = outcome.summary["numerical_error"]["peak_force_n"]
    assert peak["error"] is None and "192 and 48: refused: why" in peak["reason"]


def test_a_crash_is_tried_again_and_a_refusal_is_not(tmp_path: Path, monkeypatch: Any) -> None:
    assert needs_verification(tmp_path / "a", verified_run(tmp_path / "a", monkeypatch, 1.0, "crashed").run)
    assert needs_verification(tmp_path / "t", verified_run(tmp_path / "t", monkeypatch, "blocked", 1.0).run)
    assert not needs_verification(tmp_path / "s", verified_run(tmp_path / "s", monkeypatch, "timeout", 1.0).run)
    assert not needs_verification(
        tmp_path / "b", verified_run(tmp_path / "b", monkeypatch, 1.0, "refused", "refused").run
    )
    refused = verified_run(tmp_path / "r", monkeypatch, failures=("kinetic energy",))
    assert "numerical_error" not in refused.summary and error_lines([refused]) == []
    assert not needs_verification(tmp_path / "r", refused.run)


def test_of_an_ensemble_the_first_specimen_is_repeated(tmp_path: Path, monkeypatch: Any) -> None:
    write_run(tmp_path / "r", specimens=3, preset="quick", **VERIFY)
    asked = repeats(monkeypatch, 1.0, 1.1)
    run = resolve(config=tmp_path / "r" / "config.yaml")
    outcome = verify_outcome(read_outcome(run, tmp_path / "r"), RunOptions(quiet=True), Interrupts())
    assert [(t.run.variability.specimens, t.run.variability.mode, t.run.output.verify) for t in asked] == [
        (1, "random", False)
    ] * 2
    row = result_rows(outcome.summary, refused=False)[0]
    assert row.simulated.endswith("numerical ± 956") and "(n 3)" in row.simulated
    assert "numerical error: of the first specimen only" in error_lines([outcome])
    results = json.loads((tmp_path / "r" / "summary.json").read_text())["results"]
    results[SPEED] = {"mean": 0.4, "sd": 0.1, "values": [0.3, 0.4, 0.5]}
    edit_json(tmp_path / "r" / "summary.json", results=results)
    asked = repeats(monkeypatch, 1.0, 1.1)
    verify_outcome(read_outcome(run, tmp_path / "r"), RunOptions(quiet=True), Interrupts())
    assert [t.run.solver.speed for t in asked] == [0.15, 0.3]


def test_a_repeat_that_lowered_its_speed_is_none(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr(verify, "has_configured_speed", lambda run, results: run.solver.speed > 0.3)
    outcome = verified_run(tmp_path / "r", monkeypatch, 1.0, 1.1)
    peak = outcome.summary["numerical_error"]["peak_force_n"]
    assert peak["error"] is None and peak["reason"] == "solver.speed 0.25 m/s: restarted at a lower speed"


@pytest.mark.parametrize(
    ("deviation", "error", "verdict"),
    [
        (0.5, 0.0, "within 1 sd"), (0.5, 0.49, "within 1 sd"), (-0.5, 0.6, UNRESOLVED), (1.2, 0.1, "outside 1 sd"),
        (-1.2, 0.3, UNRESOLVED), (0.0, 1.5, UNRESOLVED), (3.0, 1.9, "outside 1 sd"),
    ],
)  # fmt: skip
def test_a_verdict_stands_only_where_the_error_does_not_cross_the_border(
    deviation: float, error: float, verdict: str
) -> None:
    assert verdict_of(deviation, error) == verdict


def test_the_deviation_carries_the_error_in_sd(tmp_path: Path, monkeypatch: Any) -> None:
    outcome = verified_run(tmp_path / "r", monkeypatch, 0.98, 1.0)
    row = next(r for r in outcome.summary["comparison"] if r["quantity"] == "peak_force_n")
    told = 4.0 * 0.02 * PEAK / row["experiment_sd"]
    rows = [{**r, "kind": "predicted", "assumed": []} for r in outcome.summary["comparison"]]
    predicted = replace(outcome, summary={**outcome.summary, "comparison": rows})
    (shown,) = [r for r in results_table([predicted]) if r[1] == "peak force [N]"]
    assert shown[2] == "5666 ± 453" and shown[4] == f"{row['deviation_sd']:+.2f} ± {told:.2f} sd"
    assert shown[-1] == UNRESOLVED and f"{told:.2f}" == "0.98"
    (given,) = [r for r in results_table([outcome]) if r[1] == "peak force [N]"]
    assert given[4:] == (shown[4], "input", "within 1 sd")  # the model returns it, however well


def test_a_deviation_from_one_specimen_carries_the_error_in_percent(tmp_path: Path, monkeypatch: Any) -> None:
    summary = dict(verified_run(tmp_path / "r", monkeypatch, 0.98, 1.0).summary)
    summary["comparison"] = [{**row, "deviation_sd": None} for row in summary["comparison"]]
    row = next(r for r in summary["comparison"] if r["quantity"] == "peak_force_n")
    off, told = 100.0 * (PEAK / row["experiment_mean"] - 1.0), 8.0 * PEAK / row["experiment_mean"]
    assert result_rows(summary, refused=False)[0].deviation == f"{off:+.1f} ± {told:.1f} %"
    outcome = verified_run(tmp_path / "s", monkeypatch, 1.00001, 1.0)
    rows = {row.quantity: row.simulated for row in result_rows(outcome.summary, refused=False)}
    assert rows["peak_force_n"] == "5666 ± 0.23" and rows["fracture_strain_pct"] == "1.58 ± 6.3e-05"


def test_a_run_that_was_not_repeated_says_so_once(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "r")
    outcome = read_outcome(resolve(config=folder / "config.yaml"), folder)
    assert error_lines([outcome, outcome]) == [NOT_ESTIMATED]
    write_report(folder)
    page = HtmlPage(folder / "report.html")
    assert page.text().count("not estimated") == 1 and "not estimated (--verify)" in page.text()
    asked = write_run(tmp_path / "asked", **VERIFY)
    assert UNFINISHED[1:] in HtmlPage(write_report(asked)).text()
    assert error_notes({"refused": []}, asked=True) == [UNFINISHED]
    rows = {"a": {"error": None, "reason": "the run has no number"}, "b": {"error": None, "reason": "torn"}}
    told = {"refused": [], "results": {}, "verification": {"specimen": 1}, "numerical_error": rows}
    assert error_notes(told) == ["numerical error: not available: torn"]


def test_the_page_shows_every_change_and_the_border(tmp_path: Path, monkeypatch: Any) -> None:
    verified_run(tmp_path / "r", monkeypatch, 0.98, 1.01)
    page = HtmlPage(tmp_path / "r" / "report.html")
    page.check()
    tables = page.tables(page.section("run-1-results"))
    (errors,) = [rows for caption, rows in tables.items() if caption.startswith("Numerical error")]
    assert errors[1][:3] == ["peak force [N]", "-2.00 %", "+1.00 %"] and errors[1][3].startswith("± ")
    (results,) = [rows for caption, rows in tables.items() if caption.startswith("Results ± numerical error")]
    assert results[1][1].startswith("5666 ± ") and results[1][3].endswith("sd within 1 sd")


def test_resume_verifies_a_completed_run_that_was_not(tmp_path: Path, monkeypatch: Any) -> None:
    folder = write_run(tmp_path / "r", preset="quick", **VERIFY)
    asked = repeats(monkeypatch, 1.0, 1.0)
    with pytest.raises(InputError, match="--against"):
        command.resume_command(folder, RunOptions(quiet=True, against=(Path("x.csv"),)))
    assert command.resume_command(folder, RunOptions(quiet=True)) == 0 and len(asked) == 2
    assert "numerical_error" in json.loads((folder / "summary.json").read_text())
    assert command.resume_command(folder, RunOptions(quiet=True)) == 0 and len(asked) == 2


def test_a_full_disk_among_the_repeats_says_how_to_go_on(tmp_path: Path, monkeypatch: Any) -> None:
    folder = write_run(tmp_path / "r", preset="quick", **VERIFY)

    def full(trials: Any, outcome: Any, options: Any) -> Any:
        (folder / "verify").mkdir()
        (folder / "verify" / "ledger.jsonl").touch()
        raise ResourceError("the disk is full")

    monkeypatch.setattr(verify, "_records", full)
    with pytest.raises(ResourceError, match=f"continue with: knittest resume {folder}"):
        command.resume_command(folder, RunOptions(quiet=True))


def test_a_damaged_summary_is_an_error_of_input(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "r", **VERIFY)
    run = resolve(config=folder / "config.yaml")
    edit_json(folder / "summary.json", quality={"ke_over_ie_max": None, "more": 1})
    quality = read_outcome(run, folder).quality
    assert math.isnan(quality.ke_over_ie_max) and quality.failures == ()
    (folder / "summary.json").write_text('{"results": {}}')
    with pytest.raises(InputError, match="no cost"):
        needs_verification(folder, run)
    (folder / "summary.json").write_text("{")
    with pytest.raises(InputError, match="not the summary"):
        read_outcome(run, folder)


def test_a_trial_is_one_run() -> None:
    run = resolve(test="tensile", variant="1", direction="warp", **VERIFY)
    with pytest.raises(InputError, match=r"output\.verify"):
        trial_of(run)
    assert trial_of(first_specimen_run(run)).run.output == run.output.model_copy(update={"verify": False})


def test_the_option_asks_for_it(monkeypatch: Any) -> None:
    from knittest.cli.main import run

    handed = SimpleNamespace()
    monkeypatch.setattr(
        "knittest.studies.command.run_command", lambda runs, options: setattr(handed, "runs", runs) or 0
    )
    for kind in ("tensile", "picture-frame", "cantilever", "friction", "forming"):
        assert run([kind, "--variant", "1", "--verify"]) == 0
        assert all(one.output.verify for one in handed.runs)
        assert run([kind, "--variant", "1"]) == 0
        assert not any(one.output.verify for one in handed.runs)
    assert run(["tensile", "--resume", "x", "--verify"]) == 2
