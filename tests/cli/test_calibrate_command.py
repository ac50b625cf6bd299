"""``knittest calibrate`` with real runs: the shipped examples, an interruption, bad commands."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from knittest.base.files import PACKAGE, configs_dir
from knittest.cli.main import run

EXAMPLES = configs_dir() / "calibrations"


def found(folder: Path) -> dict:
    return json.loads((folder / "calibration.json").read_text())


def logged(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for path in folder.glob("trials/*/log.jsonl") for line in path.open()]


def events(folder: Path) -> list[str]:
    return [line["event"] for line in logged(folder)]


def test_the_shipped_friction_gives_the_shipped_coefficient(tmp_path, capsys):
    command = ["calibrate", str(EXAMPLES / "v1-friction.yaml"), "--out", str(tmp_path / "f"), "--workers", "1"]
    assert run(command) == 0
    one = found(tmp_path / "f")
    assert one["parameters"][0]["value"] == pytest.approx(0.075, rel=0.01) and one["runs"] <= 5
    assert one["targets"][0]["simulated"] * 2000.0 == pytest.approx(300.0, abs=0.02 * 20.0)
    said = capsys.readouterr()
    assert "point 1: " in said.err and f"converged ({one['runs']} runs)" in said.out
    ran = events(tmp_path / "f")
    assert run([*command, "--quiet"]) == 0
    assert events(tmp_path / "f") == ran and capsys.readouterr() == ("", "")


@pytest.mark.full
def test_the_shipped_bending_gives_the_shipped_stiffness(tmp_path):
    """At reduced size: a narrow strip of larger shells, and bounds nearer by; its formula is in the unit tests."""
    text = (EXAMPLES / "v1-warp-bending.yaml").read_text()
    small = "rig.mode: overhang, model.macro.element_size: 12, rig.width: 12, rig.length: 200"
    small = text.replace("rig.mode: overhang", small).replace("low: 2, high: 12", "low: 4.9, high: 5.3")
    (tmp_path / "b.yaml").write_text(small)
    assert run(["calibrate", str(tmp_path / "b.yaml"), "--out", str(tmp_path / "b"), "--workers", "1", "--quiet"]) == 0
    one = found(tmp_path / "b")
    assert one["parameters"][0]["value"] == pytest.approx(5.05, rel=0.03) and one["runs"] <= 5
    assert abs(one["targets"][0]["deviation_sd"]) <= 0.01


def test_the_same_command_goes_on_after_ctrl_c(tmp_path):
    often = "preset: quick, set: {solver.speed: 0.8, output.checkpoint_interval: 0.05}"
    text = (EXAMPLES / "v1-friction.yaml").read_text().replace("preset: quick", often)
    (tmp_path / "c.yaml").write_text(text)
    command = [sys.executable, "-m", "knittest.cli.main", "calibrate", "c.yaml", "--workers", "1"]
    environment = os.environ | {"PYTHONPATH": str(PACKAGE.parent)}
    ledger = tmp_path / "runs/calibrate-c/ledger.jsonl"

    process = subprocess.Popen(command, cwd=tmp_path, env=environment, stderr=subprocess.PIPE, text=True)
    kept = "trials/*/checkpoint-[0-9]*.npz"
    while process.poll() is None and not (ledger.exists() and ledger.read_text() and [*ledger.parent.glob(kept)]):
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    assert "run the same command again to resume" in process.communicate(timeout=120)[1] and process.returncode == 75
    before = ledger.read_text().splitlines()
    assert subprocess.run(command, cwd=tmp_path, env=environment, timeout=300, check=False).returncode == 0
    after = ledger.read_text().splitlines()
    assert after[: len(before)] == before and len(after) == found(ledger.parent)["runs"] == 3
    assert events(ledger.parent).count("started") == 3
    assert [line["at_ms"] > 0.0 for line in logged(ledger.parent) if line["event"] == "resumed"] == [True]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.yaml"], "none.yaml: no such file"),
        (["c.yaml", "--workers", "0"], "0 is not in the range"),
        (["c.yaml", "--out", "c.yaml"], "is a file, expected a folder"),
        (["bad.yaml"], "bad.yaml:6: parameters.rig.kinetic_coefficient.high = 0.3: must be greater than low = 0.4"),
    ],
)
def test_bad_commands_run_nothing(tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    text = (EXAMPLES / "v1-friction.yaml").read_text()
    Path("c.yaml").write_text(text)
    Path("bad.yaml").write_text(text.replace("low: 0.02", "low: 0.4"))
    assert run(["calibrate", *arguments]) == 2
    assert said in capsys.readouterr().err and not Path("runs").exists()
