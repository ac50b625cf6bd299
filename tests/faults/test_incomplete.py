"""A run that a check of its numbers ends early keeps its curve, pictures and a page, all marked as incomplete."""

import json

import numpy as np
import pandas as pd
import pytest

from knittest.base.errors import NumericalError
from knittest.cli.main import run as knittest
from knittest.laboratory.compaction import test as compaction
from knittest.laboratory.pull_out import test as pull_out
from knittest.runs import execute
from knittest.solve import simulation

ROWS = 60
#: row at which a test ends early, and time [ms] from which on it counts
ENDED = {"pull-out": 250, "compaction": 250, "cell": 60}
REST = {"pull-out": pull_out.REST, "compaction": compaction.REST}
COMMAND = ["tensile", "--variant", "1", "--scale", "macro", "--preset", "quick", "--direction", "warp", "--quiet"]


WHY = "the energy balance is off by 12 %"


def end_at(patch, row):
    """Let a check of the numbers end every run at its ``row``."""

    def stop(run):
        if len(run.rows) == row:
            raise NumericalError(WHY)

    patch.setattr(simulation, "check_balance", stop)


@pytest.fixture
def ended(tmp_path, monkeypatch, capfd):
    """Folder of a run that ends at row :data:`ROWS`; then nothing ends it any more."""
    with monkeypatch.context() as spoilt:
        end_at(spoilt, ROWS)
        assert knittest([*COMMAND, "--out", str(tmp_path / "r")]) == NumericalError.exit_code
    assert f"the curve up to then is in {tmp_path / 'r'}" in capfd.readouterr().err
    return tmp_path / "r"


def test_it_keeps_its_curve_its_pictures_and_a_page_until_it_is_resumed(ended):
    names = {path.name for path in ended.iterdir()}
    assert {f"{name}.incomplete.csv" for name in ("curve", "energies", "contacts")} <= names
    assert {"curve.incomplete.png", "deformed.incomplete.png", "frames.pvd", "report.html"} <= names
    assert not names & {"summary.json", "comparison.json", "curve.csv", "energies.csv", "curve.png", "deformed.png"}
    manifest = json.loads((ended / "manifest.json").read_text())
    assert (manifest["status"], manifest["exit_code"]) == ("failed", NumericalError.exit_code)
    curve, energies = (pd.read_csv(ended / f"{name}.incomplete.csv") for name in ("curve", "energies"))
    assert len(energies) == ROWS and np.all(np.diff(curve["strain_pct"]) > 0.0) and curve["force_n"].iloc[-1] > 0.0
    page = (ended / "report.html").read_text()
    assert f"This run failed: {WHY}" in page and "incomplete" in page and "deformed.incomplete.png" in page
    assert knittest(["resume", str(ended), "--quiet"]) in (0, NumericalError.exit_code)
    names = {path.name for path in ended.iterdir()}
    assert {"summary.json", "curve.csv", "deformed.png", "report.html"} <= names
    assert not [name for name in names if "incomplete" in name]


def test_a_run_that_ends_before_its_first_row_keeps_nothing(tmp_path, monkeypatch):
    def stop(run, work, released):
        if len(run.model.mesh.cells) > 100:  # not in the warm-up
            raise NumericalError("the motion blows up")

    monkeypatch.setattr(simulation, "check_motion", stop)
    assert knittest([*COMMAND, "--out", str(tmp_path / "r")]) == NumericalError.exit_code
    assert {path.name for path in (tmp_path / "r").iterdir()} <= {"manifest.json", "config.yaml", "log.jsonl"} | {
        path.name for path in (tmp_path / "r").glob("checkpoint-*")
    }


def test_both_directions_have_one_page_where_one_of_them_ends_early(tmp_path, monkeypatch):
    end_at(monkeypatch, ROWS)
    command = [part for part in COMMAND if part not in ("--direction", "warp")]
    assert knittest([*command, "--out", str(tmp_path / "r")]) == NumericalError.exit_code
    assert WHY in (tmp_path / "r" / "report.html").read_text()


@pytest.mark.parametrize(
    ("command", "columns"),
    [
        (["pull-out", "--direction", "warp", "--set", "rig.width=18", "--set", "rig.length=12"], {"tail_travel_mm"}),
        (["compaction", "--set", "rig.side=6"], {"thickness_mm"}),
        (["cell", "--path", "shear"], {"conjugate_force"}),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_a_part_has_the_columns_of_its_test_and_begins_where_that_does(tmp_path, monkeypatch, command, columns):
    """The stage before the initial equilibrium is not part of the curve."""
    end_at(monkeypatch, ENDED[command[0]])
    folder = tmp_path / "r"
    options = ["--variant", "1", "--preset", "quick", "--quiet", "--no-pictures", "--out", str(folder)]
    assert knittest([*command, *options]) == NumericalError.exit_code
    curve = pd.read_csv(folder / "curve.incomplete.csv")
    assert columns <= set(curve.columns) and len(curve) > 1
    if command[0] != "cell":
        assert curve["time_ms"].iloc[0] >= REST[command[0]]


def test_a_disk_that_fails_leaves_the_reason_of_the_run(tmp_path, monkeypatch, capfd):
    def full(*_):
        raise OSError("no space left on device")

    end_at(monkeypatch, ROWS)
    monkeypatch.setattr(execute, "write_incomplete", full)
    assert knittest([*COMMAND, "--out", str(tmp_path / "r")]) == NumericalError.exit_code
    assert WHY in capfd.readouterr().err
    assert "no space left on device" in (tmp_path / "r" / "log.jsonl").read_text()
