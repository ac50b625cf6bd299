"""A run stopped at any moment goes on to the bits of a run that was left alone."""

import json
import os
import random
import shutil
import signal
import time

import numpy as np
import pytest
from restart_cases import CASES, MACRO, MESO, OFTEN, checkpoint, finish, numbers, results, resumed_at, run, start, stop

from knittest.base.errors import ResourceError
from knittest.base.interrupts import Interrupted, Interrupts
from knittest.export.files import Damaged, read_arrays, write_arrays
from knittest.runs.checkpoints import Checkpoints
from knittest.solve.state import Snapshot


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Results of each case, run in one go."""
    done = {}

    def of(case):
        if case not in done:
            folder = tmp_path_factory.mktemp(case) / "run"
            code, error = run("tensile", *CASES[case], *OFTEN, "--out", str(folder))
            assert code in (0, 3), error  # a strip this small is no tensile test, and says so
            assert not list(folder.glob("checkpoint-*"))
            done[case] = results(folder)
        return done[case]

    return of


@pytest.mark.parametrize("case", list(CASES))
def test_kill_at_random_moments(tmp_path, whole, case):
    folder, dice = tmp_path / "run", random.Random(case)
    process = start("tensile", *CASES[case], *OFTEN, "--out", str(folder))
    while not (folder / "config.yaml").exists():
        time.sleep(0.002)
    process.kill()  # nothing but a config so far
    assert finish(process)[0] == -signal.SIGKILL
    for _ in range(2 if case == "meso" else 1):
        process = start("resume", str(folder))
        assert stop(process, folder, signal.SIGKILL, delay=dice.uniform(0.0, 0.03))[0] == -signal.SIGKILL
        assert len(numbers(folder)) <= 3  # two, and a third for the moment between writing and removing
    code, error = run("resume", str(folder), threads=2)
    assert code in (0, 3), error
    assert results(folder) == whole(case)
    anew, *again = resumed_at(folder)
    assert anew == 0.0 and again and sorted(set(again)) == again and again[0] > 0.0  # further on each time
    assert not list(folder.glob("*checkpoint-*"))


def test_signals_save_and_say_how_to_go_on(tmp_path, whole):
    folder = tmp_path / "a run"
    first = ["tensile", *MESO, "--set", "output.checkpoint_interval=1000", "--set", "output.frames=3"]
    process = start(*first, "--out", str(folder))
    while not list(folder.glob("log.jsonl")):
        time.sleep(0.002)
    for k, signals in enumerate(((signal.SIGTERM,), (signal.SIGINT, signal.SIGINT), (signal.SIGUSR1, signal.SIGTERM))):
        time.sleep(0.3)  # anywhere: still preparing, or in the simulation
        began = time.monotonic()
        for number in signals:
            process.send_signal(number)
            time.sleep(0.05)  # the second one finds the process saving, telling or ending
        code, error = finish(process)
        assert (code, time.monotonic() - began < 5.0) == (75, True), error
        assert f"stopped by {signals[0].name}; continue with: knittest resume '{folder}'" in error
        assert "Traceback" not in error
        ended = json.loads((folder / "manifest.json").read_text())
        assert (ended["status"], ended["exit_code"]) == ("interrupted", 75)
        process = start("tensile", "--resume", str(folder))
        while (folder / "log.jsonl").read_text().count("resumed") <= k:
            time.sleep(0.002)
    code, error = finish(process)
    assert code in (0, 3), error
    assert results(folder) == whole("meso")


def test_a_signal_in_the_simulation_writes_a_checkpoint(tmp_path, whole):
    folder = tmp_path / "run"
    process = start("tensile", *MACRO, *OFTEN, "--out", str(folder))
    code, error = stop(process, folder, signal.SIGTERM, checkpoints=3)
    assert code == 75, error
    kept = numbers(folder)
    assert len(kept) == 2
    assert float(read_arrays(checkpoint(folder, kept[-1]))["run/time"]) > 0.0
    newest = checkpoint(folder, kept[-1])
    newest.write_bytes(newest.read_bytes()[:-100])  # and the newest is lost on the way
    code, error = run("resume", str(folder))
    assert code in (0, 3), error
    assert f"{newest.name} cannot be read" in error and "previous checkpoint" in error
    assert [at > 0.0 for at in resumed_at(folder)] == [True]
    assert results(folder) == whole("macro")


def test_two_threads_give_the_bits_of_one(tmp_path, whole):
    code, error = run("tensile", *MESO, *OFTEN, "--out", str(tmp_path / "run"), threads=2)
    assert code in (0, 3), error
    assert results(tmp_path / "run") == whole("meso")


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "pickle", "edited"])
def test_damage_is_seen(tmp_path, damage):
    path = tmp_path / "checkpoint-0001.npz"
    write_arrays(path, {"a": np.arange(1000.0), "b": np.array("text"), "none": np.zeros((3, 0))})
    assert set(read_arrays(path)) == {"a", "b", "none"}
    content = bytearray(path.read_bytes())
    if damage == "cut":
        path.write_bytes(content[: len(content) // 2])
    elif damage == "flip":
        content[len(content) // 2] ^= 1
        path.write_bytes(content)
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "pickle":
        np.savez(path, a=np.array([{"evil": 1}], dtype=object), sha256=np.array("0"))
    else:
        np.savez(path, a=np.arange(1000.0) + 1.0, sha256=read_arrays_checksum(path))
    with pytest.raises(Damaged, match=r"checkpoint-0001\.npz"):
        read_arrays(path)
    shutil.rmtree(tmp_path)
    with pytest.raises(ResourceError):
        read_arrays(path)


def read_arrays_checksum(path):
    with np.load(path, allow_pickle=False) as archive:
        return archive["sha256"]


def test_a_signal_does_not_wait_for_the_interval(tmp_path):
    snapshot = Snapshot({"n_frames": np.array(0)}, [])
    with Interrupts() as interrupts:
        store = Checkpoints(tmp_path, {}, 1000.0, interrupts)
        with pytest.raises(Interrupted, match="stopped by SIGUSR1"), store.hold_signals(0) as keeper:
            keeper.resume_from()
            keeper.visit(lambda: snapshot)
            os.kill(os.getpid(), signal.SIGUSR1)  # only noted: a simulation runs
            assert numbers(tmp_path) == []
            keeper.visit(lambda: snapshot)
    assert numbers(tmp_path) == [1]


def test_a_signal_that_a_library_turns_into_its_own_error():
    with (
        Interrupts() as interrupts,
        pytest.raises(Interrupted, match="stopped by SIGTERM"),
        interrupts.translate_errors(),
    ):
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        except KeyboardInterrupt as error:
            raise ImportError("initialization failed") from error
    with Interrupts() as interrupts, pytest.raises(ImportError), interrupts.translate_errors():
        raise ImportError("a defect")


@pytest.mark.full
def test_a_run_that_compiles_has_the_bits_of_one_that_loads(tmp_path, monkeypatch, whole):
    monkeypatch.setenv("KNITTEST_CACHE_DIR", str(tmp_path / "cache"))
    code, error = run("tensile", *MESO, *OFTEN, "--out", str(tmp_path / "run"))
    assert code in (0, 3), error
    assert results(tmp_path / "run") == whole("meso")
