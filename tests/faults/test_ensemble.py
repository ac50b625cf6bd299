"""Specimens of an ensemble of yarns, side by side, disturbed and gone on with."""

import json
import os
import shutil
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from restart_cases import MESO, OFTEN, finish, results, run, start
from trial_cases import gone

from knittest.cli.main import run as main
from knittest.export.files import read_arrays, write_arrays

#: specimens that take some seconds each
THREE = ("tensile", *MESO, *OFTEN, "--set", "solver.speed=0.1", "--specimens", "3")
QUIET = ("--quiet", "--no-pictures", "--threads")


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """An ensemble whose specimens ran one after the other."""
    folder = tmp_path_factory.mktemp("alone") / "run"
    code, said = run(*THREE, "--out", str(folder))
    assert code in (0, 3), said
    return folder


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """An ensemble that a Ctrl-C stopped when its first two specimens had checkpoints."""
    folder = tmp_path_factory.mktemp("stopped") / "run"
    process = begun(folder)
    process.send_signal(signal.SIGINT)
    code, said = finish(process)
    assert code == 75 and f"stopped by SIGINT; continue with: knittest resume {folder}" in said
    assert under_way(folder) == {0, 1} and not list(folder.glob(".*.tmp*"))
    return folder


@pytest.fixture
def left(stopped, tmp_path):
    return shutil.copytree(stopped, tmp_path / "run")


def begun(folder):
    """The process of an ensemble of which two specimens have checkpoints; tried again where a busy machine ran one of
    them to its end before the other began.
    """
    for _ in range(5):
        process = start(*THREE, "--out", str(folder), threads=2)
        ends = time.monotonic() + 240.0
        while process.poll() is None and time.monotonic() < ends and under_way(folder) <= {0, 1}:
            if under_way(folder) == {0, 1}:
                return process
            time.sleep(0.005)
        workers = children(process) if process.poll() is None else []
        process.kill()
        said = process.communicate()
        assert all(map(gone, workers)), said
        shutil.rmtree(folder)
    raise AssertionError(f"never two specimens at a time: {said}")


def under_way(folder) -> set[int]:
    """Specimens that have a checkpoint."""
    return {int(path.name.split("-")[1]) for path in folder.glob("checkpoint-[0-9]*.npz")}


def children(process) -> list[int]:
    """Process ids of those that run the specimens of ``process``."""
    found = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    return [int(pid) for pid in found if "trials.work" in Path(f"/proc/{pid}/cmdline").read_text()]


def values(folder):
    """Results of an ensemble, specimen by specimen."""
    return json.loads((folder / "summary.json").read_text())["results"]


def logged(folder, event) -> list[dict]:
    lines = [json.loads(text) for text in (folder / "log.jsonl").read_text().splitlines()]
    return [line for line in lines if line["event"] == event]


def assert_same(folder, alone):
    assert results(folder) == results(alone) and values(folder) == values(alone)
    assert sorted(line["number"] for line in logged(folder, "specimen")) == [0, 1, 2]


def test_side_by_side_they_end_with_the_same_bits_and_leave_nothing(alone, tmp_path):
    code, said = run(*THREE, "--out", str(tmp_path / "run"), threads=2)
    assert code in (0, 3), said
    assert_same(tmp_path / "run", alone)
    assert {path.name for path in (tmp_path / "run").iterdir()} == {path.name for path in alone.iterdir()}


@pytest.mark.parametrize("threads", [1, 2])
def test_stopped_each_goes_on_from_its_checkpoint_whatever_the_threads(alone, left, threads):
    kept = {k: max(float(read_arrays(path)["run/time"]) for path in left.glob(f"checkpoint-000{k}-*")) for k in (0, 1)}
    code, said = run("resume", str(left), threads=threads)
    assert code in (0, 3), said
    assert {line["number"]: line["at_ms"] for line in logged(left, "goes on")} == kept and min(kept.values()) > 0.0
    assert_same(left, alone)
    assert not list(left.glob("*checkpoint*"))


def test_a_change_since_the_checkpoint_of_any_specimen_is_refused_and_goes_by_force(left, monkeypatch, capsys):
    before = {path: path.read_bytes() for path in left.rglob("*") if path.is_file()}
    monkeypatch.setattr("knittest.export.identity.kernel_digest", lambda: "new")
    assert main(["resume", str(left), *QUIET, "2"]) == 2
    assert "kernels was " in capsys.readouterr().err
    monkeypatch.undo()
    newest = max(left.glob("checkpoint-0001-*.npz"))  # of one specimen only
    state = read_arrays(newest)
    identity = json.loads(str(state["identity"])) | {"version": "9.9"}
    write_arrays(newest, state | {"identity": np.array(json.dumps(identity))})
    assert main(["resume", str(left), *QUIET, "2"]) == 2
    assert "version was 9.9, is " in capsys.readouterr().err
    newest.write_bytes(before[newest])
    assert {path: path.read_bytes() for path in left.rglob("*") if path.is_file()} == before


def test_a_killed_process_is_told_of_and_its_specimen_goes_on(alone, tmp_path):
    folder = tmp_path / "run"
    process = begun(folder)
    os.kill(children(process)[0], signal.SIGKILL)
    code, said = finish(process)
    assert code in (0, 3), said
    (told,) = [line for line in said.splitlines() if "SIGKILL" in line]
    (line,) = logged(folder, "said")
    name = f"specimen {line['number'] + 1} of 3 (warp)"
    assert told == f"knittest: {name}: its process was killed by SIGKILL; trying again"
    assert [one["number"] for one in logged(folder, "goes on")] == [line["number"]]
    assert_same(folder, alone)


def test_killed_the_specimens_save_themselves_and_hold_the_folder_until_then(alone, tmp_path):
    folder = tmp_path / "run"
    process = begun(folder)
    workers = children(process)
    os.kill(workers[0], signal.SIGSTOP)  # one that takes its time
    process.kill()
    finish(process)
    code, said = run("resume", str(folder), threads=2)
    assert code == 4 and "in use by process" in said
    os.kill(workers[0], signal.SIGCONT)
    assert all(gone(pid) for pid in workers)
    code, said = run(*THREE, "--out", str(folder), threads=2)
    assert code == 2 and "contains checkpoint-" in said
    assert run("resume", str(folder), threads=2)[0] in (0, 3)
    assert {line["number"] for line in logged(folder, "goes on")} == {0, 1}
    assert_same(folder, alone)


def test_a_specimen_whose_checkpoints_are_lost_is_run_again_and_the_others_go_on(alone, left):
    for path in left.glob("checkpoint-0001-*.npz"):
        path.write_bytes(b"no")
    code, said = run("resume", str(left), threads=2)
    assert code in (0, 3) and "no file of specimen 2 can be read; the specimen is run again" in said
    assert [line["number"] for line in logged(left, "goes on")] == [0]
    assert_same(left, alone)
