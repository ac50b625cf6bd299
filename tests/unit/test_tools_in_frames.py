"""Tools in the frames of a run: where they are, in ParaView's collection and in the moving view."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from browser import needs_browser
from export_sample import shell_history
from report_sample import write_run
from test_moving_view import drawn, parts, unpacked

from knittest.base.errors import InputError
from knittest.base.history import Body, Frame
from knittest.export.meshes import write_frames
from knittest.laboratory.forming.tool_check import moved_tools
from knittest.report_page.moving.page import write_view
from knittest.report_page.moving.recording import read_recording

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
CORNERS = np.array([[0.0, 0.0, 5.0], [30.0, 0.0, 5.0], [0.0, 30.0, 5.0], [0.0, 0.0, 25.0]])
DOWN = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -2.5], [0.0, 0.0, -4.0]])
STAMP = Body("stamp", CORNERS, TETRAHEDRON, DOWN)
DIE = Body("die", CORNERS - [0.0, 0.0, 40.0], TETRAHEDRON, 0.0 * DOWN)


TOOLS = (STAMP, DIE)


def written(folder: Path) -> Path:
    write_frames(folder, shell_history(), TOOLS)
    return folder


def test_every_time_of_the_collection_has_the_tools_where_they_are(tmp_path: Path) -> None:
    history = shell_history()
    times = [frame.time for frame in history.frames]
    root = ElementTree.parse(written(tmp_path) / "frames.pvd").getroot()
    for tool in TOOLS:
        rows = [row for row in root.iter("DataSet") if row.get("name") == tool.name]
        assert [float(row.attrib["timestep"]) for row in rows] == times
        for row, offset in zip(rows, tool.offset, strict=True):
            mesh = meshio.vtu.read(tmp_path / row.attrib["file"])
            np.testing.assert_allclose(mesh.points, tool.points + offset, atol=1e-12)
            np.testing.assert_array_equal(mesh.cells_dict["triangle"], TETRAHEDRON)
    assert len(list((tmp_path / "frames").glob("die-*"))) == 1  # it does not move


def test_the_view_has_them_as_they_move_and_the_specimen_as_without(tmp_path: Path) -> None:
    folder = written(write_run(tmp_path / "run"))
    recording = read_recording(folder)
    count = len(recording.time)
    assert recording.position.shape == (count, *shell_history().frames[0].position.shape)
    header, data = parts(write_view(folder))
    for told, tool in zip(header["bodies"], TOOLS, strict=True):
        assert told["name"] == tool.name
        np.testing.assert_allclose(told["offset"], tool.offset, atol=1e-5)
        place = np.array(told["low"]) + told["step"] * unpacked(data, told["points"])[0]
        np.testing.assert_allclose(place, tool.points, atol=0.51 * told["step"])


def test_a_tool_that_lacks_a_time_is_refused(tmp_path: Path) -> None:
    collection = written(tmp_path) / "frames.pvd"
    lines = collection.read_text().splitlines(keepends=True)
    last = max(k for k, line in enumerate(lines) if 'name="stamp"' in line)
    collection.write_text("".join(lines[:last] + lines[last + 1 :]))
    with pytest.raises(InputError, match="'stamp' is missing at some times"):
        read_recording(tmp_path)


def test_tools_of_forming_stand_where_the_curve_says() -> None:
    """The stamp goes down by its travel, the holder by its own with its sign, the die stays."""
    solid = SimpleNamespace(points=CORNERS, triangles=TETRAHEDRON)
    tools = SimpleNamespace(by_name={name: SimpleNamespace(solid=solid) for name in ("stamp", "die", "holder")})
    history = shell_history()
    history.frames[:] = [Frame(t, 0.0, 0.0, history.frames[0].position, {}) for t in (0.0, 3.0, 8.0)]
    history.curve |= {
        "time_ms": np.array([0.0, 2.0, 4.0, 8.0]),
        "stamp_travel_mm": np.array([0.0, 0.0, 10.0, 60.0]),
        "holder_travel_mm": np.array([0.0, -0.2, -0.4, 0.1]),
    }
    found = {body.name: body for body in moved_tools(tools, history)}
    np.testing.assert_allclose(found["stamp"].offset, [[0, 0, 0], [0, 0, -5.0], [0, 0, -60.0]])
    np.testing.assert_allclose(found["holder"].offset, [[0, 0, 0], [0, 0, -0.3], [0, 0, 0.1]])
    np.testing.assert_array_equal(found["die"].offset, 0.0)


@needs_browser
def test_a_browser_draws_them_and_moves_them(tmp_path: Path) -> None:
    """The specimen does not move: the pixels that change between the frames are the stamp."""
    folder, history, shots = write_run(tmp_path / "run"), shell_history(), []
    history.frames[:] = [replace(history.frames[0], time=time) for time in (0.0, 1.0, 2.0)]
    write_frames(folder, history, TOOLS)
    page = write_view(folder).as_uri()
    for state in ("frame=1&look=side", "frame=3&look=side"):
        dom, shot = drawn(tmp_path, f"{page}#{state}", "800,700")
        assert "stamp" in dom and "die" in dom
        shots.append(shot[200:-200])
    assert np.mean(np.abs(shots[0] - shots[1]).max(axis=2) > 0.02) > 0.01
