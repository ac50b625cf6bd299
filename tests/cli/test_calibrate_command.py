"""``knittest calibrate`` with real runs: the shipped examples."""

import json

import pytest

from knittest.base.files import configs_dir
from knittest.cli.main import run

EXAMPLES = configs_dir() / "calibrations"


def test_the_shipped_friction_gives_the_shipped_coefficient(tmp_path, capsys):
    command = ["calibrate", str(EXAMPLES / "v1-friction.yaml"), "--out", str(tmp_path / "f"), "--workers", "1"]
    assert run(command) == 0
    one = json.loads((tmp_path / "f/calibration.json").read_text())
    assert one["parameters"][0]["value"] == pytest.approx(0.075, rel=0.01) and one["runs"] <= 5
    assert one["targets"][0]["simulated"] * 2000.0 == pytest.approx(300.0, abs=0.02 * 20.0)
    said = capsys.readouterr()
    assert "point 1: " in said.err and f"converged ({one['runs']} runs)" in said.out
    ran = (tmp_path / "f/ledger.jsonl").read_bytes()
    assert run([*command, "--quiet"]) == 0
    assert (tmp_path / "f/ledger.jsonl").read_bytes() == ran and capsys.readouterr() == ("", "")


@pytest.mark.full
def test_the_shipped_bending_gives_the_shipped_stiffness(tmp_path):
    """At reduced size: a narrow strip of larger shells, and bounds nearer by; its formula is in the unit tests."""
    text = (EXAMPLES / "v1-warp-bending.yaml").read_text()
    small = "rig.mode: overhang, model.macro.element_size: 12, rig.width: 12, rig.length: 200"
    small = text.replace("rig.mode: overhang", small).replace("low: 2, high: 12", "low: 4.9, high: 5.3")
    (tmp_path / "b.yaml").write_text(small)
    assert run(["calibrate", str(tmp_path / "b.yaml"), "--out", str(tmp_path / "b"), "--workers", "1", "--quiet"]) == 0
    one = json.loads((tmp_path / "b/calibration.json").read_text())
    assert one["parameters"][0]["value"] == pytest.approx(5.05, rel=0.03) and one["runs"] <= 5
    assert abs(one["targets"][0]["deviation_sd"]) <= 0.01
