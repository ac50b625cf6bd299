"""Refusals of ``knittest resume``, what it admits by force, and what a full disk leaves behind; in this process."""

import errno
import json
import os
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from restart_cases import MACRO, checkpoint, numbers, results

from knittest.cli.main import run
from knittest.export.lock import RunLock
from knittest.laboratory.tensile.report import TensileReport
from knittest.runs.checkpoints import Checkpoints

QUICK = (*MACRO, "--quiet", "--threads", "1", "--set", "output.frames=3", "--set", "output.checkpoint_interval=0.02")


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A whole run and one stopped by a signal at its third checkpoint."""
    base = tmp_path_factory.mktemp("runs")
    assert run(["tensile", *QUICK, "--out", str(base / "whole")]) == 0
    with pytest.MonkeyPatch.context() as patch:
        stop_when(patch, lambda count, specimen: count == 3)
        assert run(["tensile", *QUICK, "--out", str(base / "stopped")]) == 75
    assert len(numbers(base / "stopped")) == 2
    return base


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch):
    """None of these tests looks at one."""
    monkeypatch.setattr(TensileReport, "pictures", lambda *_: None)


def stop_when(patch, when):
    """Send this process a signal after the checkpoint for which ``when(count, specimen)``."""
    write, seen = Checkpoints.write, []

    def stop(self, specimen, snapshot):
        write(self, specimen, snapshot)
        seen.append(1)
        if when(len(seen), specimen):
            os.kill(os.getpid(), signal.SIGTERM)

    patch.setattr(Checkpoints, "write", stop)


@pytest.fixture
def stopped(folders, tmp_path):
    return shutil.copytree(folders / "stopped", tmp_path / "run")


def listing(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def resume(folder, *options):
    return run(["resume", str(folder), "--quiet", "--threads", "1", *options])


def test_a_completed_run_says_so(folders, capsys):
    before = listing(folders / "whole")
    assert resume(folders / "whole") == 0
    assert "completed on" in capsys.readouterr().out
    assert listing(folders / "whole") == before


def change_config(folder, patch):
    text = (folder / "config.yaml").read_text()
    assert "damping: 0.5 " in text
    (folder / "config.yaml").write_text(text.replace("damping: 0.5 ", "damping: 0.6 "))


CHANGES = {
    "solver.damping was 0.5, is 0.6": change_config,
    "version was ": lambda folder, patch: patch.setattr("knittest.__version__", "9.9"),
    "cpu was ": lambda folder, patch: patch.setattr("knittest.export.identity.cpu_model", lambda: "another"),
    "cell was missing, is another": lambda folder, patch: patch.setattr(
        "knittest.export.identity.cell_of", lambda run: "another"
    ),
    "kernels was ": lambda folder, patch: patch.setattr("knittest.export.identity.kernel_digest", lambda: "new"),
}


@pytest.mark.parametrize("said", list(CHANGES))
def test_a_change_is_named_and_nothing_is_touched(stopped, monkeypatch, capsys, said):
    CHANGES[said](stopped, monkeypatch)
    before = listing(stopped)
    assert resume(stopped) == 2
    error = capsys.readouterr().err
    assert said in error and "--force" in error
    assert listing(stopped) == before


def test_force_goes_on_and_is_recorded(stopped, monkeypatch, folders):
    change_config(stopped, monkeypatch)
    assert resume(stopped, "--force") in (0, 3)
    notes = json.loads((stopped / "manifest.json").read_text())["resumed"][-1]
    assert notes["forced"] == ["solver.damping was 0.5, is 0.6"] and notes["at_ms"] > 0.0
    assert results(stopped) != results(folders / "whole")
    said = "resumed with --force although solver.damping was 0.5, is 0.6"
    assert said in json.loads((stopped / "summary.json").read_text())["warnings"]
    forced, whole = (
        np.loadtxt(folder / "energies.csv", delimiter=",", skiprows=1) for folder in (stopped, folders / "whole")
    )
    before = whole[:, 0] < notes["at_ms"]  # not run again with another damping
    assert before.sum() > 1 and np.array_equal(forced[before], whole[before])


def test_a_change_of_the_interval_is_no_change(stopped, folders):
    text = (stopped / "config.yaml").read_text()
    (stopped / "config.yaml").write_text(text.replace("checkpoint_interval: 0.02", "checkpoint_interval: 50"))
    assert resume(stopped) == 0
    assert results(stopped) == results(folders / "whole")


def test_no_checkpoint_that_verifies(stopped, capsys):
    for number in numbers(stopped):
        checkpoint(stopped, number).write_bytes(b"PK\x03\x04 no")
    assert resume(stopped) == 2
    assert "none of its 2 checkpoints can be read" in capsys.readouterr().err
    assert len(numbers(stopped)) == 2


def test_another_models_checkpoint(stopped, capsys):
    from knittest.export.files import read_arrays, write_arrays

    newest = checkpoint(stopped, numbers(stopped)[-1])
    state = read_arrays(newest)
    write_arrays(newest, state | {"model/nodes/position": np.zeros((3, 7))})
    assert resume(stopped) == 2
    assert "nodes/position has shape (3, 7), the model's (3, " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda p: None, "no config.yaml"),
        (lambda p: (p / "config.yaml").write_text("rig: ["), "manifest.json"),
        (lambda p: (p / "config-warp.yaml").write_text("rig: ["), "config-warp.yaml"),
    ],
)
def test_no_run_folder(tmp_path, capsys, make, said):
    make(tmp_path)
    assert resume(tmp_path) == 2
    assert said in capsys.readouterr().err


def test_a_run_in_use_and_a_folder_that_cannot_be_written(stopped, monkeypatch, capsys):
    before = listing(stopped)
    lock = RunLock(stopped)
    assert resume(stopped) == 4
    assert "in use by process" in capsys.readouterr().err
    lock.release()

    real = os.open

    def refuse(path, flags, *mode, **options):
        if flags & (os.O_RDWR | os.O_WRONLY):
            raise OSError(errno.EROFS, "Read-only file system")
        return real(path, flags, *mode, **options)

    with monkeypatch.context() as patch:
        patch.setattr(os, "open", refuse)
        assert resume(stopped) == 4
    assert "read-only" in capsys.readouterr().err
    assert listing(stopped) == before


def fail_from(patch, target, name, count):
    """Let a call raise a full disk from its ``count``-th use on."""
    real, seen = getattr(target, name), []

    def full(*arguments, **options):
        seen.append(1)
        if len(seen) >= count:
            raise OSError(errno.ENOSPC, "No space left on device")
        return real(*arguments, **options)

    patch.setattr(target, name, full)


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize(("target", "name"), [(np, "savez"), (os, "fsync"), (Path, "replace")])
def test_a_full_disk_keeps_the_old_checkpoint(stopped, folders, capsys, target, name, count):
    lock_and_manifest = {"savez": 0, "fsync": 2, "replace": 1}[name]
    with pytest.MonkeyPatch.context() as patch:
        fail_from(patch, target, name, lock_and_manifest + count)
        assert resume(stopped) == 4
    error = capsys.readouterr().err
    assert "the disk is full" in error and f"knittest resume {stopped}" in error
    assert not list(stopped.glob(".*.tmp*"))
    assert Checkpoints(stopped, {}, 1.0).find()
    assert resume(stopped) == 0
    assert results(stopped) == results(folders / "whole")


def test_an_ensemble_goes_on_with_the_next_specimen(tmp_path, monkeypatch):
    arguments = ["tensile", *QUICK, "--specimens", "3", "--set", "rig.max_strain=3"]
    assert run([*arguments, "--out", str(tmp_path / "whole")]) in (0, 3)
    with monkeypatch.context() as patch:
        stop_when(patch, lambda count, specimen: specimen == 1)
        assert run([*arguments, "--out", str(tmp_path / "run")]) == 75
    assert (tmp_path / "run" / "checkpoint-specimen-0000.npz").exists()
    assert resume(tmp_path / "run") in (0, 3)
    assert results(tmp_path / "run") == results(tmp_path / "whole")
    assert (tmp_path / "run" / "summary.json").read_text().count("values") > 0
    log = (tmp_path / "run" / "log.jsonl").read_text()
    assert [log.count(f'"event": "specimen", "number": {k}') for k in range(3)] == [1, 1, 1]
    assert [log.count(f'"event": "goes on", "number": {k}') for k in range(3)] == [0, 1, 0]


def test_both_directions_from_their_parent(tmp_path, monkeypatch, capsys):
    arguments = ["tensile", *QUICK, "--direction", "both", "--out", str(tmp_path / "both")]
    with monkeypatch.context() as patch:
        stop_when(patch, lambda count, specimen: True)
        assert run(arguments) == 75
    assert f"knittest resume {tmp_path / 'both'}" in capsys.readouterr().err
    assert not (tmp_path / "both" / "weft").exists()
    assert run(arguments) == 2
    assert "knittest resume" in capsys.readouterr().err
    assert resume(tmp_path / "both") == 0
    for direction in ("warp", "weft"):
        assert json.loads((tmp_path / "both" / direction / "manifest.json").read_text())["status"] == "completed"
    assert resume(tmp_path / "both") == 0
    assert capsys.readouterr().out.count("nothing to resume") == 2
