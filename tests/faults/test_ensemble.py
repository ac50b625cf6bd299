"""Specimens of an ensemble of yarns, side by side."""

import json
import signal
import time

import pytest
from restart_cases import MESO, OFTEN, finish, numbers, results, run, start

from knittest.base.errors import NumericalError
from knittest.cli.main import run as main
from knittest.export.folder import SPECIMENS
from knittest.studies.trials import ensemble
from knittest.studies.trials.record import Record

#: specimens that take some seconds each
THREE = ("tensile", *MESO, *OFTEN, "--set", "solver.speed=0.2", "--specimens", "3")


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """An ensemble whose specimens ran one after the other."""
    folder = tmp_path_factory.mktemp("alone") / "run"
    code, said = run(*THREE, "--out", str(folder))
    assert code in (0, 3), said
    return folder


def stopped(folder, *signals):
    """Exit code and words of an ensemble that was stopped once two of its specimens have checkpoints."""
    process = start(*THREE, "--out", str(folder), threads=2)
    ends = time.monotonic() + 120.0
    while sum(bool(numbers(one)) for one in folder.glob(f"{SPECIMENS}/*")) < 2:
        assert process.poll() is None and time.monotonic() < ends, process.communicate()
        time.sleep(0.01)
    for number in signals:
        process.send_signal(number)
    return finish(process)


def values(folder):
    """Results of an ensemble, specimen by specimen."""
    return json.loads((folder / "summary.json").read_text())["results"]


def test_side_by_side_they_end_with_the_same_bits_and_leave_nothing(alone, tmp_path):
    code, said = run(*THREE, "--out", str(tmp_path / "run"), threads=2)
    assert code in (0, 3), said
    assert results(tmp_path / "run") == results(alone) and values(tmp_path / "run") == values(alone)
    assert {path.name for path in (tmp_path / "run").iterdir()} == {path.name for path in alone.iterdir()}
    log = (tmp_path / "run/log.jsonl").read_text()
    assert [log.count(f'"number": {k}') for k in range(3)] == [1, 1, 1]


def test_stopped_they_go_on_each_from_its_checkpoint(alone, tmp_path):
    folder = tmp_path / "run"
    code, said = stopped(folder, signal.SIGINT)
    assert code == 75 and f"knittest resume {folder}" in said
    assert sum(bool(numbers(one)) for one in folder.glob(f"{SPECIMENS}/*")) == 2
    code, said = run("resume", str(folder), threads=2)
    assert code in (0, 3), said
    assert results(folder) == results(alone) and values(folder) == values(alone)
    assert not (folder / SPECIMENS).exists()


def test_killed_they_save_themselves_and_no_new_run_takes_their_folder(alone, tmp_path):
    folder = tmp_path / "run"
    assert stopped(folder, signal.SIGKILL)[0] == -signal.SIGKILL
    ends = time.monotonic() + 60.0
    while list(folder.glob(f"{SPECIMENS}/*/run.lock")) and time.monotonic() < ends:
        time.sleep(0.05)
    assert {json.loads(path.read_text())["status"] for path in folder.glob(f"{SPECIMENS}/*/manifest.json")} == {
        "interrupted"
    }
    code, said = run(*THREE, "--out", str(folder), threads=2)
    assert code == 2 and f"holds {SPECIMENS}" in said
    assert run("resume", str(folder), threads=2)[0] in (0, 3)
    assert results(folder) == results(alone)


def test_what_ends_a_specimen_ends_the_command(tmp_path, monkeypatch):
    """Its processes are ended, and the error is that of the specimen."""
    ended = []

    class Failing:
        def __init__(self, workers, threads):
            assert (workers, threads) == (2, 1)

        def run(self, trials, place, *rest):
            yield Record(trials[1].key, "failed", "node 7 flew off")

        def close(self):
            ended.append(True)

    monkeypatch.setattr(ensemble, "LocalPool", Failing)
    code = main([*THREE, "--threads", "2", "--quiet", "--no-pictures", "--out", str(tmp_path / "run")])
    assert code == NumericalError.exit_code and ended == [True]
    assert "node 7 flew off" in json.loads((tmp_path / "run/manifest.json").read_text())["message"]
