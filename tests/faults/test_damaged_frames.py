"""Every later checkpoint needs every frame: one damaged file of a frame takes none of them away."""

import numpy as np
import pytest
from restart_cases import checkpoint

from knittest.base.errors import InputError
from knittest.runs.checkpoints import Checkpoints
from knittest.solve.state import Snapshot

FRAMES = (1, 2, 2, 3, 3)


def snapshot(frames: int, time: float) -> Snapshot:
    state = {"n_frames": np.array(frames), "run/time": np.array(time)}
    return Snapshot(state, [{"position": np.full(5, float(k))} for k in range(frames)])


@pytest.fixture
def folder(tmp_path):
    """Five checkpoints were written, the newest two are kept; both need all three frames."""
    store = Checkpoints(tmp_path, {"version": "1"}, 1.0)
    for time, frames in enumerate(FRAMES, 1):
        store.write(0, snapshot(frames, float(time)))
    return tmp_path


def names(folder, frame: int) -> list[str]:
    return sorted(path.name for path in folder.glob(f"checkpoint-frame-0000-{frame:04d}*"))


def found(folder) -> tuple[Checkpoints, list[str]]:
    said: list[str] = []
    store = Checkpoints(folder, {"version": "1"}, 1.0, tell=said.append)
    assert store.find() == [{"version": "1"}]
    return store, said


@pytest.mark.parametrize("frame", [0, 1, 2])
@pytest.mark.parametrize("damage", ["flipped", "gone"])
@pytest.mark.parametrize("which", [0, 1])
def test_one_damaged_frame_loses_no_checkpoint(folder, frame, damage, which):
    path = folder / names_of(frame)[which]
    whole = path.read_bytes()
    path.unlink()
    if damage == "flipped":
        path.write_bytes(whole[:200] + bytes([whole[200] ^ 1]) + whole[201:])
    store, said = found(folder)
    newest = store.newest_checkpoint(0)
    assert newest is not None and newest[1].time == store.reached == 5.0
    assert [float(f["position"][0]) for f in newest[1].frames] == [0.0, 1.0, 2.0]
    assert [path.name in text for text in said] == [True, True] * (which == 0)  # a copy is looked at when it is needed
    store.remove_unused()
    assert checkpoint(folder, 5).exists() and checkpoint(folder, 4).exists()
    if which == 0 or damage == "gone":
        store.write(0, snapshot(3, 6.0))  # and it is whole again
        assert path.read_bytes() == whole


def names_of(frame: int) -> list[str]:
    """The file of a frame, and its copy."""
    return [f"checkpoint-frame-0000-{frame:04d}.npz", f"checkpoint-frame-0000-{frame:04d}-copy.npz"]


def test_without_file_and_copy_the_checkpoint_before_it_serves(folder):
    store = Checkpoints(folder, {"version": "1"}, 1.0)
    store.write(0, snapshot(4, 6.0))
    for name in names_of(3):
        (folder / name).write_bytes(b"no")
    store, said = found(folder)
    assert store.reached == 5.0
    assert any("the previous checkpoint is tried" in text for text in said)
    store.remove_unused()
    assert names(folder, 3) == [] and len(names(folder, 2)) == 2


def test_without_both_nothing_is_made_up(folder):
    for name in names_of(0):
        (folder / name).write_bytes(b"no")
    with pytest.raises(InputError, match="none of its 2 checkpoints"):
        Checkpoints(folder, {"version": "1"}, 1.0).find()


def test_all_go_with_the_specimen(folder):
    Checkpoints(folder, {}, 1.0).write_finished(0, {"n_frames": np.array(0)})
    assert [path.name for path in folder.glob("checkpoint-*")] == ["checkpoint-specimen-0000.npz"]
