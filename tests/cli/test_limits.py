"""A limit looser than the preset's through the commands: exit code, summary, page, and the run folder's own config."""

import json
from pathlib import Path

from knittest.cli.main import run

STRIP = ["tensile", "--scale", "macro", "--direction", "warp", "--no-frames", "--quiet"]
FAST = ["--variant", "1", "--preset", "quick", "--set", "solver.speed=30"]
LOOSE = ["--set", "solver.max_kinetic_ratio=100", "--set", "solver.max_energy_error=10"]


def left_by(folder: Path) -> tuple[dict, str]:
    """Summary and page of a run folder."""
    return json.loads((folder / "summary.json").read_text()), (folder / "report.html").read_text()


def test_widened_gates_refuse_are_marked_and_stay_so_in_the_folders_config(tmp_path: Path) -> None:
    """The strip at 30 m/s is far from quasi-static; it ran with "passed" and exit code 0 while its limits were wide."""
    folder = tmp_path / "a"
    assert run([*STRIP, *FAST, *LOOSE, "--out", str(folder)]) == 3
    summary, page = left_by(folder)
    assert [(one["name"], one["value"], one["preset"], one["accepted"]) for one in summary["limits"]] == [
        ("solver.max_kinetic_ratio", 100.0, 5.0, False),
        ("solver.max_energy_error", 10.0, 2.0, False),
    ]
    assert summary["comparison"] == [] and sum("--accept-limits" in reason for reason in summary["refused"]) == 2
    assert "Relaxed limit: solver.max_kinetic_ratio = 100 % (preset 5 %), not accepted" in page
    assert json.loads((folder / "manifest.json").read_text())["exit_code"] == 3
    again = [*STRIP, "--config", str(folder / "config.yaml")]
    assert run([*again, "--out", str(tmp_path / "b")]) == 3
    assert len(left_by(tmp_path / "b")[0]["limits"]) == 2


def test_accepted_limits_count_and_are_recorded_and_do_not_pass_on(tmp_path: Path) -> None:
    calm, folder = ["--variant", "1", "--preset", "quick", "--set", "solver.max_penetration=26"], tmp_path / "a"
    assert run([*STRIP, *calm, "--accept-limits", "--out", str(folder)]) == 0
    summary, page = left_by(folder)
    assert [one["accepted"] for one in summary["limits"]] == [True] and summary["comparison"]
    assert any("accepted by --accept-limits" in text for text in summary["warnings"])
    assert "accepted by --accept-limits" in page and "accept_limits: true" in (folder / "config.yaml").read_text()
    assert run([*STRIP, "--config", str(folder / "config.yaml"), "--out", str(tmp_path / "b")]) == 3
    assert not left_by(tmp_path / "b")[0]["limits"][0]["accepted"]
