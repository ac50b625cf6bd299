"""``knittest runs``: what it lists, and what it removes and never removes."""

import json
import sys
from datetime import datetime, timedelta

import pandas as pd
import pytest
from filelock import lock_descriptor
from report_sample import edit_json, write_run

from knittest.cli.main import run


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Folder with runs: one good, one refused, one old, both directions of a command, and a sweep."""
    monkeypatch.chdir(tmp_path)
    write_run(tmp_path / "runs/good")
    write_run(tmp_path / "runs/refused", failures=("kinetic energy 7 %",))
    write_run(tmp_path / "runs/old")
    edit_json(tmp_path / "runs/old/manifest.json", ended=(datetime.now().astimezone() - timedelta(days=8)).isoformat())
    for direction in ("warp", "weft"):
        write_run(tmp_path / "runs/both" / direction, direction=direction)
        (tmp_path / f"runs/both/config-{direction}.yaml").write_text("")
    write_run(tmp_path / "runs/sweep/trials/a")
    (tmp_path / "runs/sweep/ledger.jsonl").write_text("")
    return tmp_path / "runs"


def test_the_list(place, capsys):
    assert run(["runs"]) == 0
    lines = capsys.readouterr().out.splitlines()
    cells = {line.split()[0]: line for line in lines}
    assert lines[0].split() == ["run", "test", "fabric", "scale", "result", "MB", "passed", "date"]
    assert lines[1].startswith("old ") and lines[-1].startswith("6 runs, ")  # the oldest first
    assert {*cells} >= {"good", "refused", "both/warp", "both/weft", "sweep"} and "1 runs" in cells["sweep"]
    assert "peak force [N]: 5666" in cells["good"] and " yes " in cells["good"] and " macro " in cells["good"]
    assert "no: kinetic energy 7 %" in cells["refused"]
    assert run(["runs", "both", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["runs"]
    assert [one["path"] for one in found] == ["runs/both/warp", "runs/both/weft"] and found[0]["bytes"] > 1000
    assert run(["runs", "--failed"]) == 0 and capsys.readouterr().out.splitlines()[-1].startswith("1 run, ")


@pytest.mark.parametrize(
    ("options", "gone"),
    [
        (["--failed"], {"refused"}),
        (["--older-than", "7d"], {"old"}),
        (["--older-than", "2w"], set()),
        (["--older-than", "0h"], {"good", "refused", "old", "both"}),
        (["both"], {"both"}),
        (["both/warp", "runs/good"], {"good"}),
        (["both", "--failed"], set()),
    ],
)
def test_what_is_asked_for_is_removed(place, options, gone):
    before = {path.name for path in place.iterdir()}
    assert run(["runs", "--remove", "--yes", *options]) == 0
    assert before - {path.name for path in place.iterdir()} == gone
    assert (place / "both/warp").exists() == ("both/warp" not in options and "both" not in gone)
    assert (place / "sweep/trials/a/manifest.json").exists()


@pytest.mark.parametrize(("answer", "left"), [("n\n", True), ("y\n", False)])
def test_it_asks(place, monkeypatch, tmp_path, answer, left):
    (tmp_path / "answer").write_text(answer)
    with (tmp_path / "answer").open() as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        assert run(["runs", "--remove", "good"]) == 0
    assert (place / "good").exists() == left
    assert run(["runs", "--remove"]) == 2


def test_what_is_no_run_or_in_use_stays(place, tmp_path, capsys):
    kept = tmp_path / "kept.txt"
    kept.write_text("mine")
    (place / "link").symlink_to("good")
    assert run(["runs", "--remove", "link", "--yes"]) == 2 and "is a link" in capsys.readouterr().err
    (place / "mine").mkdir()
    (place / "mine/manifest.json").write_text('{"name": "an extension of a browser", "status": ""}')
    assert run(["runs", "--remove", "mine", "--yes"]) == 2 and "not a run folder" in capsys.readouterr().err
    assert run(["runs", "--remove", "sweep", "--yes"]) == 2 and (place / "sweep/trials/a").is_dir()
    (place / "old/notes.txt").write_text("mine")
    assert run(["runs", "--remove", "old", "--yes"]) == 2
    assert "because notes.txt is not a file of a run" in capsys.readouterr().err and (place / "old/curve.csv").exists()
    (place / "good/frames").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/frame.vtu").write_text("")
    edit_json(place / "good/manifest.json", status="running", ended=None, exit_code=None)
    with (place / "good/run.lock").open("w") as lock:
        lock_descriptor(lock.fileno())
        assert run(["runs", "good"]) == 0 and " running " in capsys.readouterr().out
        assert run(["runs", "--remove", "good", "--yes"]) == 4 and (place / "good/curve.csv").exists()
        assert run(["runs", "--remove", "--older-than", "0h", "--yes"]) == 2  # of the notes
        assert (place / "good/curve.csv").exists() and not (place / "refused").exists()
    assert run(["runs", "good"]) == 0 and " killed " in capsys.readouterr().out
    assert run(["runs", "--remove", "good", "--yes"]) == 0 and not (place / "good").exists()
    assert (tmp_path / "elsewhere/frame.vtu").exists()


def test_tables_become_a_workbook(place, capsys):
    (place / "both/warp/head.csv").write_text("# kind: measured\nx,y\n1,2\n")
    assert run(["export", "xlsx", "runs/both"]) == 0
    assert capsys.readouterr().out == "runs/both/tables.xlsx\n"
    sheets = pd.read_excel(place / "both/tables.xlsx", sheet_name=None, engine="calamine")
    assert {"results", "warp curve", "weft energies", "warp head"} <= {*sheets}
    curve = pd.read_csv(place / "both/warp/curve.csv")
    pd.testing.assert_frame_equal(sheets["warp curve"], curve, check_dtype=False)
    results = sheets["results"]
    assert results.loc[results.quantity == "peak force [N]", "simulated"].tolist() == [5666.25, 5666.25]
    assert str(sheets["warp head"].columns[0]) == "# kind: measured"
    assert run(["export", "xlsx", "runs/both", "--out", "a.csv"]) == 2


def test_a_workbook_without_openpyxl_says_what_to_install(place, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    assert run(["export", "xlsx", "runs/good"]) == 2
    assert "pip install 'knittest[xlsx]'" in capsys.readouterr().err
