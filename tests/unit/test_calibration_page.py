"""The page of a calibration: parameters, targets, points and files as calibration.json has them, damage named."""

import json
from pathlib import Path

import pytest
from calibration_cases import BEND, Pretending, calibrate, outcome
from html_page import HtmlPage, near

from knittest.cli.main import run
from knittest.report_page.pictures import compress_picture

FOLDER = Path("runs/calibrate-c")


def page_of(path: Path = FOLDER / "report.html") -> HtmlPage:
    page = HtmlPage(path)
    page.check()
    return page


@pytest.fixture
def found(tmp_path, monkeypatch) -> dict:
    assert calibrate(BEND, tmp_path, monkeypatch, Pretending()) == 0
    return outcome(tmp_path)


def test_parameters_targets_points_picture_and_files_are_on_the_page(found):
    page, (row,) = page_of(), found["parameters"]
    ((_, (header, cells)),) = page.tables(page.section("parameters")).items()
    assert header == ["parameter", "found (tuned)", "95 % interval", "before", "bounds", "sensitivity [sd]"]
    assert cells[0] == "fabric.macro.bending_stiffness.warp"
    assert cells[1] == f"{row['value']:.5g} N mm" and near(row["value"], page.numbers(page.section("parameters")))
    assert cells[2] == "{:.4g} to {:.4g}".format(*row["interval_95"])
    assert cells[3] == "5.05 derived" and row["before"] == 5.05 and cells[4] == "2 to 12"
    (warning,) = found["warnings"]
    assert f"Warning: {warning}." in page.text(page.section("summary"))
    (row,) = found["targets"]
    _, cells = page.tables(page.section("targets"))["Targets, at the values that were found"]
    assert cells[1:] == [f"{row['simulated']:.1f}", "171 ± 51", f"{row['deviation_sd']:+.3f} sd", "tuned"]
    assert cells[0].endswith(f"test bend: {row['source']}")
    ((_, points),) = page.tables(page.section("points")).items()
    assert len(points) - 1 == len(found["evaluations"])
    state = [line[1] for line in points[1:]]
    best = [one["values"] == [found["parameters"][0]["value"]] for one in found["evaluations"]]
    assert state == ["found" if one else "ran" for one in best] and sum(best) == 1
    assert points[1][3].startswith(f"{found['evaluations'][0]['simulated'][0]:.1f}")
    assert [e.get("src") for e in page.all("img")] == [compress_picture((FOLDER / "convergence.png").read_bytes())]
    saved = {a.get("download") for a in page.section("repeat").iter("a") if a.get("download")}
    assert saved == {"calibration.yaml", "fabric.yaml"}
    assert "knittest calibrate calibration.yaml" in page.text() and "source: tuned" in page.text()
    before = (FOLDER / "report.html").read_bytes()
    assert run(["report", str(FOLDER)]) == 0 and (FOLDER / "report.html").read_bytes() == before


def test_other_rows_of_the_experiment_have_their_kind(found):
    best = next(o for o in found["evaluations"] if o["values"] == [found["parameters"][0]["value"]])
    trial = FOLDER / "trials" / best["trials"]["bend"]
    trial.mkdir()
    name = "bending_stiffness_eq2_n_mm_per_width"
    row = {"quantity": name, "experiment_mean": 5.0, "experiment_sd": 0.6, "deviation_sd": 0.5}
    results = {"overhang_mm": 171.0, name: 5.3, "residual": 1e-9}
    (trial / "summary.json").write_text(json.dumps({"results": results, "comparison": [row | {"kind": "predicted"}]}))
    (trial / "manifest.json").write_text(json.dumps({"version": "9.9", "status": "completed"}))
    assert run(["report", str(FOLDER)]) == 0
    page = page_of()
    rows = page.tables(page.section("targets"))["Other rows of the experiment that these tests have"][1:]
    assert rows == [["B by Eq. 2, per width [N mm] test bend", "5.30", "5.00 ± 0.60", "+0.50 sd", "predicted"]]
    assert [a.get("href") for a in page.section("points").iter("a")] == [f"trials/{trial.name}/"]
    assert ["knittest", "9.9"] in page.tables(page.section("repeat"))["Provenance of 1 run folders"]


@pytest.mark.filterwarnings("error")  # of matplotlib: the picture of no value
def test_one_that_did_not_converge_says_so_with_the_reason_of_every_point(tmp_path, monkeypatch):
    pool = Pretending(ends=lambda trial: "failed")
    assert calibrate(BEND, tmp_path, monkeypatch, pool) == 3
    page, data = page_of(), outcome(tmp_path)
    assert f"Not converged: {data['reason']}" in page.text(page.section("summary"))
    ((_, points),) = page.tables(page.section("points")).items()
    assert points[1][1] == "no result bend failed: failed on purpose"
    assert "fabric.yaml" not in page.text(page.section("repeat"))


def test_damage_costs_its_own_part_only(found):
    data = found | {"evaluations": [{"number": "x"}], "targets": [{"target": "<script>", "test": "bend"}]}
    (FOLDER / "calibration.json").write_text(json.dumps(data))
    (FOLDER / "convergence.png").unlink()
    assert run(["report", str(FOLDER)]) == 0
    page = page_of()
    said = page.text(page.section("summary"))
    assert "Missing or not readable: calibration.json: evaluations" in said
    assert "convergence.png: no such file" in page.text(page.section("convergence"))
    assert "5.05 derived" in page.text(page.section("parameters"))
    assert "<script>" in page.text(page.section("targets"))
    (FOLDER / "calibration.json").write_text("{")
    assert run(["report", str(FOLDER)]) == 0
    assert "calibration.json: cannot be read" in page_of().text()
