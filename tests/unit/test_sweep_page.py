"""The page of a sweep: its runs with states, reasons and links, numbers as in its table, damage named."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from html_page import HtmlPage, near

from knittest.base.errors import ResourceError
from knittest.base.figure import new_figure
from knittest.cli.main import run
from knittest.config.aliases import OldNameWarning
from knittest.report_page.files import Reader
from knittest.report_page.pictures import compress_picture
from knittest.studies.batch import command, page
from knittest.studies.batch.command import BatchOptions, run_batch
from knittest.studies.batch.picture import _draw_experiment, _Group, _scale, results_to_draw
from knittest.studies.batch.plan import SweptField
from knittest.studies.trials.trial import Record, record_of

SWEEP = """
base: {variant: 1, scale: macro, preset: quick, direction: warp}
grid: {rig.width: [20, 30, 40, 50]}
"""
DRAW_IN = "fabric.knitting.loop_shortening"
REFUSED = "kinetic energy over work 9 % is above 5 %"


class Pretending:
    """Trials whose peak force is ten times the width; that of 30 is refused, that of 40 dies, then the disk is full."""

    def run(self, trials, place, limit, options, watch):
        for trial in trials:
            width, folder = trial.run.rig.width, place(trial)
            if width == 50.0:
                raise ResourceError("the disk is full")
            folder.mkdir(parents=True, exist_ok=True)
            if width == 20.0:
                (folder / "report.html").write_text("<!doctype html>")
            row = {"quantity": "peak_force_n", "simulated": 10.0 * width, "experiment_mean": 400.0,
                   "experiment_sd": 50.0, "deviation_sd": -4.0, "kind": "predicted", "source": "Table 3"}  # fmt: skip
            refused = [REFUSED] if width == 30.0 else []
            summary = {"results": {"peak_force_n": 10.0 * width}, "comparison": [] if refused else [row],
                       "refused": refused, "quality": {}, "cost": {"cpu_s": 1.5}}  # fmt: skip
            dead = Record(trial.key, "crashed", "its process died: <b>signal 9</b>")
            yield dead if width == 40.0 else record_of(trial.key, summary)

    def close(self):
        pass


@pytest.fixture
def batch(tmp_path, monkeypatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "_pool", lambda _: Pretending())
    Path("s.yaml").write_text(SWEEP)
    with pytest.raises(ResourceError, match="the disk is full"):
        run_batch(Path("s.yaml"), BatchOptions(quiet=True), lambda _: False)
    return Path("runs/batch-s")


def page_of(path: Path) -> HtmlPage:
    page = HtmlPage(path)
    page.check()
    return page


def test_a_sweep_has_its_runs_with_states_reasons_links_picture_and_command(batch):
    page = page_of(batch / "report.html")
    states = page.tables(page.section("summary"))["Runs by state"]
    assert {row[0]: row[1] for row in states[1:]} == {"completed": "1", "refused": "1", "crashed": "1", "open": "1"}
    text = page.text(page.section("summary"))
    assert "Not finished; runs left: 1." in text and "2 of 4 runs have no valid result" in text
    ((_, reasons),) = page.tables(page.section("reasons")).items()
    assert reasons[1:] == [["2", "refused", REFUSED], ["3", "crashed", "its process died: <b>signal 9</b>"]]
    ((_, runs),) = page.tables(page.section("runs")).items()
    assert runs[0] == ["run", "state", "rig.width [mm]", "peak force [N]"]
    assert runs[1] == ["1", "completed", "20", "200 -4.00 sd, predicted"]
    assert runs[2] == ["2", "refused", "30", "300 refused"]
    assert [row[3] for row in runs[3:]] == ["-", "-"]
    assert near(200.0, page.numbers(page.section("runs")))
    table = pd.read_csv(batch / "results.csv")
    links = [a.get("href") for a in page.section("runs").iter("a")]
    assert links == [f"{table.folder[0]}/report.html", f"{table.folder[1]}/", f"{table.folder[2]}/"]
    assert [e.get("src") for e in page.all("img")] == [compress_picture((batch / "overview.png").read_bytes())]
    text = page.text(page.section("repeat"))
    assert "knittest batch sweep.yaml" in text and "grid: {rig.width: [20, 30, 40, 50]}" in text
    assert "No trial has a manifest." in text


def test_report_writes_it_again_and_elsewhere_with_links_that_hold(batch, capsys):
    before = (batch / "report.html").read_bytes()
    assert run(["report", str(batch)]) == 0
    assert (batch / "report.html").read_bytes() == before and str(batch / "report.html") in capsys.readouterr().out
    Path("mail: it").mkdir()
    assert run(["report", str(batch), "--out", "mail: it/sweep.html"]) == 0
    page = page_of(Path("mail: it/sweep.html"))
    assert next(a.get("href") for a in page.section("runs").iter("a")).startswith("../runs/batch-s/trials/")
    Path("notes.txt").write_text("mine")
    assert run(["report", str(batch), "--out", "notes.txt"]) == 2 and Path("notes.txt").read_text() == "mine"


def test_a_sweep_of_an_earlier_version_keeps_the_column_of_a_renamed_field(tmp_path):
    (tmp_path / "sweep.yaml").write_text("base: {variant: 1}\ngrid: {solver.max_force_free: [9, 8]}\n")
    table = {"run": [1], "status": ["not run"], "solver.max_force_free": [9.0], "force_n": [2.5]}
    pd.DataFrame(table).to_csv(tmp_path / "results.csv", index=False)
    with pytest.warns(OldNameWarning):
        swept, read = (part(Reader(tmp_path)) for part in (page._swept_fields, page._table))
    assert [field.name for field in swept] == ["solver.max_force_free_overlap"]
    assert read["solver.max_force_free_overlap"].tolist() == [9.0] and "force_n" in read


def test_damage_costs_its_own_part_only(batch):
    (batch / "sweep.yaml").write_text("base: {\n")
    (batch / "overview.png").write_bytes(b"no picture")
    assert run(["report", str(batch)]) == 0
    page = page_of(batch / "report.html")
    assert "Missing or not readable: sweep.yaml" in page.text(page.section("summary"))
    assert "overview.png: not a PNG picture" in page.text()
    ((_, runs),) = page.tables(page.section("runs")).items()
    assert runs[0] == ["run", "state", "peak force [N]"] and len(runs) == 5
    (batch / "results.csv").write_text("")
    assert run(["report", str(batch)]) == 0
    assert "results.csv: cannot be read" in page_of(batch / "report.html").text()
    (batch / "results.csv").write_text("run,status,folder\n1,completed,..\n2,odd,trials/none\n")
    assert run(["report", str(batch)]) == 0
    page = page_of(batch / "report.html")
    assert "results.csv: no column reason, test" in page.text() and not list(page.section("runs").iter("a"))


@pytest.mark.filterwarnings("error")  # of pandas: an empty column of numbers
def test_an_empty_column_stays_blank_and_of_very_many_runs_failed_ones_come_first(batch):
    (batch / "results.csv").write_text("run,status,reason,test,folder\n1,completed,,,\n2,completed,,,\n")
    assert run(["report", str(batch)]) == 0
    page = page_of(batch / "report.html")
    assert "nan" not in page.text(page.section("runs")).lower()
    rows = "\n".join(f"{k},{'failed' if k > 990 else 'completed'},why,tensile,{k}" for k in range(1, 1001))
    (batch / "results.csv").write_text(f"run,status,reason,test,rig.width\n{rows}\n")
    assert run(["report", str(batch)]) == 0
    page = page_of(batch / "report.html")
    ((caption, runs),) = page.tables(page.section("runs")).items()
    assert caption.startswith("300 of 1000 runs")
    assert [row[0] for row in runs[1:12]] == [*map(str, range(991, 1001)), "1"]


def test_a_page_that_cannot_be_written_costs_nothing_else(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "_pool", lambda _: Pretending())
    Path("s.yaml").write_text(SWEEP.replace("[20, 30, 40, 50]", "[20]"))
    Path("runs/batch-s/report.html").mkdir(parents=True)
    Path("runs/batch-s/sweep.yaml").write_text("")
    assert run_batch(Path("s.yaml"), BatchOptions(quiet=True), lambda _: False).exit_code == 0
    assert "complete, but report.html could not be written" in capsys.readouterr().err
    assert Path("runs/batch-s/results.csv").exists()


@pytest.mark.parametrize("listed", ["[null, 1.0, 2.5]", "[null, 1, 2]"])
def test_what_is_not_given_stands_as_null_in_table_page_and_picture(tmp_path, monkeypatch, listed):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command, "_pool", lambda _: Pretending())
    Path("s.yaml").write_text(
        f"base: {{variant: 1, scale: meso, direction: warp, set: {{rig.width: 25}}}}\ngrid: {{{DRAW_IN}: {listed}}}"
    )
    assert run_batch(Path("s.yaml"), BatchOptions(quiet=True, parquet=True), lambda _: False).exit_code == 0
    folder = Path("runs/batch-s")
    said = listed.strip("[]").split(", ")
    assert list(pd.read_csv(folder / "results.csv", dtype=str, keep_default_na=False)[DRAW_IN]) == said
    for table in (pd.read_csv(folder / "results.csv"), pd.read_parquet(folder / "results.parquet")):
        assert np.array_equal(table[DRAW_IN].to_numpy(float), [np.nan, *map(float, said[1:])], equal_nan=True)
    page = page_of(folder / "report.html")
    ((_, runs),) = page.tables(page.section("runs")).items()
    assert [row[2] for row in runs[1:]] == ["null", *(f"{float(one):g}" for one in said[1:])]
    assert (folder / "overview.png").is_file()


def test_the_picture_has_places_for_null_forces_per_width_and_experiments_without_scatter():
    values = pd.Series(["null", 1.0, 2.5], dtype=object)
    assert list(_scale(values, SweptField(DRAW_IN, False, False)).places(values)) == [0.0, 1.0, 2.0]
    table = pd.DataFrame({"peak_force_n": [100.0, 200.0], "peak_force_n_per_mm": [10.0, 10.0]})
    assert results_to_draw(table) == ["peak_force_n_per_mm"]
    assert results_to_draw(table.assign(peak_force_n=[100.0, 100.0])) == ["peak_force_n", "peak_force_n_per_mm"]
    assert results_to_draw(table[["peak_force_n"]]) == ["peak_force_n"]
    axes = new_figure(1, 1).add_subplot()
    _draw_experiment(
        axes, _Group("", "k", pd.DataFrame({"a_experiment_mean": [1.0], "a_experiment_sd": [np.nan]})), "a"
    )
    assert len(axes.lines) == 1 and not axes.patches
