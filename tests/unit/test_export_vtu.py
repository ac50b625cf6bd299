"""Frames read back as written, failed elements included."""

import errno
from pathlib import Path
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from export_sample import beam_history, shell_history

from knittest.base.errors import ResourceError
from knittest.export.meshes import write_frames


@pytest.mark.parametrize(("history", "cell"), [(beam_history(), "line"), (shell_history(), "quad")])
def test_frames_read_back(tmp_path: Path, history, cell: str) -> None:
    collection = write_frames(tmp_path, history)
    entries = ElementTree.parse(collection).getroot().findall("Collection/DataSet")
    assert [float(entry.get("timestep")) for entry in entries] == [frame.time for frame in history.frames]
    for entry, frame in zip(entries, history.frames, strict=True):
        read = meshio.read(tmp_path / entry.get("file"))
        np.testing.assert_array_equal(read.points, frame.position)
        np.testing.assert_array_equal(read.cells_dict[cell], history.mesh.cells)
        np.testing.assert_array_equal(read.point_data["displacement"], frame.position - history.frames[0].position)
        fields = {name: data[0] for name, data in read.cell_data.items()}
        assert set(fields) == {"part", "yarn", "radius", *frame.fields}
        for name, values in frame.fields.items():
            np.testing.assert_array_equal(fields[name], values)
        np.testing.assert_array_equal(fields["part"], history.mesh.part)
        np.testing.assert_array_equal(fields["yarn"], history.mesh.yarn)
    assert np.count_nonzero(fields["alive"] == 0) == 4  # the failed elements stay as cells


def test_tube_filter_finds_a_radius_at_the_points(tmp_path: Path) -> None:
    history = beam_history()
    write_frames(tmp_path, history)
    read = meshio.read(tmp_path / "frames" / "frame-0002.vtu")
    for system, radius in ((0, 0.375), (2, 0.25)):
        nodes = history.mesh.cells[history.mesh.part == system]
        np.testing.assert_array_equal(read.point_data["radius"][nodes], radius)


def test_files_are_compressed(tmp_path: Path) -> None:
    history = beam_history(8, 20)
    write_frames(tmp_path, history)
    text = (tmp_path / "frames" / "frame-0000.vtu").read_bytes()
    assert b"vtkZLibDataCompressor" in text
    raw = sum(array.nbytes for array in (history.frames[0].position, *history.frames[0].fields.values()))
    assert len(text) < raw


def test_full_disk_leaves_no_half_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, *_: object, **__: object) -> None:
        Path(path).write_bytes(b"<VTK")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(meshio, "write", full)
    with pytest.raises(ResourceError, match="disk is full"):
        write_frames(tmp_path, beam_history())
    assert list((tmp_path / "frames").iterdir()) == [] and not (tmp_path / "frames.pvd").exists()
