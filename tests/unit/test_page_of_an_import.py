"""The page of a fabric of one's own: sources once and where they belong, short paths; patterns of a shell."""

from dataclasses import replace
from pathlib import Path

import pytest
from report_sample import write_run
from test_lab_frame import frame_file
from test_lab_import import specimens

from knittest.base.errors import InputError
from knittest.cli.main import run
from knittest.experiment.comparison import compare_results
from knittest.experiment.lab_table import ReadOptions
from knittest.laboratory.picture_frame.lab_files import LAB as FRAME_LAB
from knittest.laboratory.tensile.lab_files import LAB as TENSILE
from knittest.report_page.blocks import Table
from knittest.report_page.files import ComparedRow
from knittest.report_page.folders import find_runs
from knittest.report_page.loaded_run import load_run
from knittest.report_page.parameters import parameters
from knittest.report_page.results import results
from knittest.runs.run_files import references_of

OUT = Path("data/mine")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A run of shells of a fabric with strips of 25 mm along the warp and a frame of its own."""
    monkeypatch.chdir(tmp_path)
    TENSILE.write(specimens(25.0), OUT, "warp", ["a.csv", "b.csv"])
    FRAME_LAB.write(FRAME_LAB.read(frame_file(tmp_path / "frame.csv"), ReadOptions()), OUT, "", ["frame.csv"])
    assert run(["new", "mine", "--from", str(OUT)]) == 0
    return write_run(tmp_path / "r", variant="mine")


def test_the_source_of_scaled_rows_stands_once(folder):
    loaded = load_run(folder)
    scaled = references_of(loaded.run, ()).rows
    found = compare_results({"peak_force_n": 5e3, "fracture_strain_pct": 1.6}, scaled, dict.fromkeys(
        (row.quantity for row in scaled), "input"))  # fmt: skip
    rows = [ComparedRow(**row) for row in found]
    loaded = replace(loaded, summary=loaded.summary.model_copy(update={"comparison": rows}))
    assert [row.scaled for row in rows] == ["scaled from 25 to 50 mm", ""]
    table = next(b for b in results(loaded).blocks if isinstance(b, Table))
    assert table.caption.count("2 strips of 25 mm") == 1 and "instead of" not in table.caption
    experiments = [row[2] for row in table.rows]  # the scaling is small print, which wraps
    assert "scaled from 25 to 50 mm" in [cell.note for cell in experiments]
    assert not any("instead" in cell.text for cell in experiments)


def test_a_curve_stands_under_its_own_source_with_a_short_path(folder):
    tables = {b.caption.partition(":")[0]: b for b in parameters(load_run(folder)).blocks if isinstance(b, Table)}
    measured = {row[0].text: row for row in tables["Measured"].rows}
    assert measured["macro.tension.warp"][1].text == "data/mine/warp/tension.csv"
    assert "2 strips of 25 mm" in measured["macro.tension.warp"][2].text
    assert measured["macro.shear"][1].text == "data/mine/picture-frame/shear.csv"
    assert "macro.tension.weft" in {row[0].text for row in tables["Assumed"].rows}  # another fabric's, by its head
    assert "fabric.macro.tension.warp" not in {row[0].text for row in tables["Fabric"].rows}


def test_a_pattern_that_names_the_files_of_a_run_means_the_run(folder, tmp_path):
    both = tmp_path / "runs"
    for direction in ("warp", "weft"):
        write_run(both / direction, variant="mine", direction=direction)
        (both / f"config-{direction}.yaml").write_text("x")
    named, notes = find_runs(sorted(both.glob("*")))
    assert [one.path.name for one in named] == ["warp", "weft"] and all(one.named for one in named) and not notes
    inside, _ = find_runs(sorted((both / "warp").glob("*")))
    assert [one.path for one in inside] == [both / "warp"]


def test_a_folder_of_curves_is_no_run_and_says_where_it_goes(folder, tmp_path):
    for path in (OUT / "warp", OUT / "warp/corridor.csv"):
        with pytest.raises(InputError, match=r"run folder.*; to compare a run with measured curves: knittest compare"):
            find_runs([folder, path])
    (tmp_path / "notes.txt").write_text("x")
    with pytest.raises(InputError, match=r"is a file, expected a run folder$"):
        find_runs([tmp_path / "notes.txt"])
