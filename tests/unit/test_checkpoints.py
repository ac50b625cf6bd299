"""Checkpoints of several specimens in one folder: each has its own, and all are looked at."""

import errno

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.runs import opened_run
from knittest.runs.checkpoints import Checkpoints, SpecimenKeeper
from knittest.solve.state import Snapshot


def snapshot(time: float, frames: int = 1) -> Snapshot:
    state = {"n_frames": np.array(frames), "run/time": np.array(time)}
    return Snapshot(state, [{"position": np.full(3, time)} for _ in range(frames)])


@pytest.fixture
def folder(tmp_path):
    """Specimen 0 is finished, 1 and 2 are under way, and 2 was begun by another version."""
    store = Checkpoints(tmp_path, {"version": "1"}, 1.0)
    store.write(0, snapshot(3.0))
    for time in (4.0, 5.0, 6.0):
        store.write(1, snapshot(time))
    Checkpoints(tmp_path, {"version": "2"}, 1.0).write(2, snapshot(2.0))
    store.write_finished(0, {"n_frames": np.array(0)})
    return tmp_path


def names(folder) -> set[str]:
    return {path.name for path in folder.glob("checkpoint-*") if "frame" not in path.name}


def test_each_keeps_its_newest_two_and_resumes_from_its_own(folder):
    kept = {"checkpoint-0001-0002.npz", "checkpoint-0001-0003.npz", "checkpoint-0002-0001.npz"}
    assert names(folder) == kept | {"checkpoint-specimen-0000.npz"}
    assert len(list(folder.glob("checkpoint-frame-*"))) == 4
    store = Checkpoints(folder, {"version": "1"}, 1.0)
    for specimen, time in ((1, 6.0), (2, 2.0)):
        with store.hold_signals(specimen) as keeper:
            found = keeper.resume_from()
        assert found is not None and found.time == time and float(found.frames[0]["position"][0]) in (4.0, 2.0)
    with store.hold_signals(3) as keeper:
        assert keeper.resume_from() is None
    assert [store.is_finished(k) for k in range(3)] == [True, False, False]


def test_a_change_since_any_of_them_is_refused(folder):
    store = Checkpoints(folder, {"version": "1"}, 1.0)
    found = store.find()
    assert found == [{"version": "1"}, {"version": "1"}, {"version": "2"}] and store.reached == 6.0
    with pytest.raises(InputError, match="version was 2, is 1; undo the changes, or resume with --force"):
        opened_run._check_changes(folder, found, {"version": "1"}, force=False)
    assert opened_run._check_changes(folder, found, {"version": "1"}, force=True) == ["version was 2, is 1"]
    assert opened_run._check_changes(folder, found[:2], {"version": "1"}, force=False) == []


def test_one_that_cannot_be_read_is_told_of_and_removed_and_the_others_stay(folder):
    said: list[str] = []
    for path in [*folder.glob("checkpoint-0001-*"), folder / "checkpoint-specimen-0000.npz"]:
        path.write_bytes(b"no")
    (folder / ".checkpoint-0002-0002.7.tmp.npz").write_bytes(b"half")
    store = Checkpoints(folder, {"version": "1"}, 1.0, tell=said.append)
    assert store.find() == [{"version": "2"}]
    assert [text.rpartition("no file of ")[2] for text in said if "no file of" in text] == [
        "specimen 1 can be read; the specimen is run again", "specimen 2 can be read; the specimen is run again",
    ]  # fmt: skip
    store.remove_unused()
    assert names(folder) == {"checkpoint-0002-0001.npz"} and not list(folder.glob(".*"))
    assert {path.name[:21] for path in folder.glob("checkpoint-frame-*")} == {"checkpoint-frame-0002"}


def test_checkpoints_of_an_earlier_layout_are_not_passed_over(folder):
    """Beside specimens that are finished either: the one under way would begin anew."""
    (folder / "checkpoint-0007.npz").write_bytes(b"of version 0.2.0")
    with pytest.raises(InputError, match=r"checkpoint-0007\.npz was written by an earlier version"):
        Checkpoints(folder, {}, 1.0).find()


@pytest.mark.parametrize("damage", ["folder", "input/output error"])
def test_the_older_one_is_used_where_the_newest_cannot_be_read(folder, monkeypatch, damage):
    newest, told = folder / "checkpoint-0001-0003.npz", []
    if damage == "folder":
        newest.unlink()
        newest.mkdir()
    else:
        read = type(newest).read_bytes

        def fail(path):
            if path == newest:
                raise OSError(errno.EIO, "Input/output error")
            return read(path)

        monkeypatch.setattr(type(newest), "read_bytes", fail)
    store = Checkpoints(folder, {"version": "1"}, 1.0, tell=told.append)
    store.find()
    assert store.reached == 5.0 and "checkpoint-0001-0003.npz cannot be read" in told[0]
    store.remove_unused()
    assert not newest.exists() and (damage != "folder" or len(list(folder.glob("*-not-a-file-*"))) == 1)
    monkeypatch.undo()
    store.write(1, snapshot(7.0))
    assert store.newest_checkpoint(1)[1].time == 7.0


def test_short_memory_is_no_damage(folder, monkeypatch):
    """A file that cannot be read now must not be removed as damaged."""

    def fail(*_, **__):
        raise MemoryError

    monkeypatch.setattr(np, "load", fail)
    with pytest.raises(MemoryError):
        Checkpoints(folder, {"version": "1"}, 1.0).find()


def test_a_specimen_that_restarts_forgets_its_frames_and_keeps_its_speed(tmp_path):
    store = Checkpoints(tmp_path, {"version": "1"}, 1e-9)
    keeper = store.hold_signals(0)
    with keeper as first:
        first.visit(lambda: snapshot(3.0, frames=2))
        assert SpecimenKeeper(store, 0).speed_share() == 1.0
        first.restarts(0.25)
        assert not list(tmp_path.glob("checkpoint-*"))
        first.visit(lambda: snapshot(1.0))
    assert SpecimenKeeper(store, 0).speed_share() == 0.25
    assert SpecimenKeeper(store, 0).resume_from().time == 1.0
