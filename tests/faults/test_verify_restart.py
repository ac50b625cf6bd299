"""Runs with --verify as processes: the error covers what is known exactly; killed among its repeats, a run goes on."""

import json
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from restart_cases import finish, results, resumed_at, start

#: a strip of 5 by 14 shells
STRIP = (
    "tensile", "--variant", "1", "--scale", "macro", "--preset", "quick", "--direction", "warp",
    "--set", "rig.gauge_length=140", "--set", "output.frames=2",
)  # fmt: skip
SLOW = ("--set", "output.checkpoint_interval=0.02", "--set", "solver.speed=0.2")


def summary(folder: Path) -> Any:
    return json.loads((folder / "summary.json").read_text())


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A verified strip, slow enough to be killed, in one go."""
    folder = tmp_path_factory.mktemp("whole") / "run"
    assert finish(start(*STRIP, *SLOW, "--verify", "--out", str(folder), threads=2))[0] == 0
    return folder


def test_the_error_covers_the_peak_that_the_shells_were_given(tmp_path: Path) -> None:
    """A curve is their input, and the strip ends where it does; the bits are those of a run that is not verified."""
    code, said = finish(start(*STRIP, "--verify", "--out", str(tmp_path / "v"), threads=2))
    assert code == 0, said
    assert finish(start(*STRIP, "--out", str(tmp_path / "plain"), threads=2))[0] == 0
    assert results(tmp_path / "v") == results(tmp_path / "plain")
    assert "numerical_error" not in summary(tmp_path / "plain")
    found = summary(tmp_path / "v")
    exact = next(r["experiment_mean"] for r in found["comparison"] if r["quantity"] == "peak_force_n")
    off = abs(found["results"]["peak_force_n"] - exact)
    error = found["numerical_error"]["peak_force_n"]["error"]
    assert off <= error <= 0.05 * exact
    assert {r["status"] for r in found["verification"].values() if isinstance(r, dict)} == {"completed"}
    assert len(list((tmp_path / "v" / "verify" / "trials").iterdir())) == 2


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_run_stopped_among_its_repeats_goes_on_to_the_same_errors(
    tmp_path: Path, whole: Path, number: signal.Signals
) -> None:
    folder = tmp_path / "run"
    process = start(*STRIP, *SLOW, "--verify", "--out", str(folder), threads=2)
    while not list(folder.glob("verify/trials/*/checkpoint-0000-0002.npz")):  # the first may be of time 0
        assert process.poll() is None, process.communicate()
        time.sleep(0.005)
    process.send_signal(number)
    code, said = finish(process)
    assert code == (75 if number == signal.SIGTERM else -signal.SIGKILL), said
    assert number == signal.SIGKILL or f"continue with: knittest resume {folder}" in said
    assert json.loads((folder / "manifest.json").read_text())["status"] == "completed"
    assert "numerical_error" not in summary(folder)
    code, said = finish(start("resume", str(folder), threads=2))
    assert code == 0, said
    assert summary(folder)["numerical_error"] == summary(whole)["numerical_error"] and results(folder) == results(whole)
    assert any(at > 0.0 for trial in folder.glob("verify/trials/*") for at in resumed_at(trial))
