"""Tools that turn: in files of frames, in the moving view and in films."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import needs_browser
from export_sample import shell_history
from matplotlib.colors import to_rgb
from report_sample import write_run
from test_moving_view import drawn, parts

from knittest.base.errors import InputError
from knittest.base.figure import RED
from knittest.base.history import Body
from knittest.export import shading
from knittest.export.meshes import write_frames
from knittest.export.shading import View
from knittest.report_page.loaded_run import load_run
from knittest.report_page.moving.page import write_view
from knittest.report_page.moving.recording import ToolLayers, read_recording, scales_of
from knittest.report_page.moving.stage import CLOCK, DPI, Stage

QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
#: a strip from 5 to 35 mm along x and 3 mm wide, at rest, turned to the left by a quarter, then sheared
STRIP = np.array([[5.0, 0.0, 8.0], [35.0, 0.0, 8.0], [35.0, 3.0, 8.0], [5.0, 3.0, 8.0]])
TURN = np.array([np.eye(3), QUARTER, np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])])
OFFSET = np.array([[0.0, 0.0, 0.0], [20.0, -3.0, 0.0], [1.0, 2.0, 3.0]])
BAR = Body("bar", STRIP, np.array([[0, 1, 2], [0, 2, 3]]), OFFSET, TURN)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    run = write_run(tmp_path / "run")
    write_frames(run, shell_history(), (BAR,))
    return run


def test_a_bar_is_read_back_and_is_on_the_line_between_frames(folder: Path) -> None:
    recording = read_recording(folder)
    (read,) = recording.bodies
    assert read.turn is not None
    for frame in range(3):
        np.testing.assert_allclose(read.place(frame), BAR.place(frame), atol=1e-9)
    np.testing.assert_allclose(read.place(1)[0], [20.0, 2.0, 8.0], atol=1e-9)  # 5 mm along x has become 5 along y
    (body,) = recording.bodies_at(float(0.75 * recording.time[0] + 0.25 * recording.time[1]))
    np.testing.assert_allclose(body.place(0), 0.75 * BAR.place(0) + 0.25 * BAR.place(1), atol=1e-9)
    np.testing.assert_allclose(recording.with_fewer_frames(2).bodies[0].place(1), BAR.place(2), atol=1e-9)


def test_the_view_has_its_matrices(folder: Path) -> None:
    (told,) = parts(write_view(folder))[0]["bodies"]
    turn, offset = np.array(told["turn"]).reshape(-1, 3, 3), np.array(told["offset"])
    for frame in range(3):
        np.testing.assert_allclose(STRIP @ turn[frame].T + offset[frame], BAR.place(frame), atol=1e-3)


def test_a_tool_that_changes_its_shape_is_refused(folder: Path) -> None:
    straight = (folder / "frames" / "bar-0000.vtu").read_bytes()
    bent = Body("bar", STRIP + np.array([[0.0], [0.0], [0.1], [0.0]]), BAR.triangles, OFFSET)
    write_frames(folder, shell_history(), (bent,))
    (folder / "frames" / "bar-0000.vtu").write_bytes(straight)
    with pytest.raises(InputError, match=r"bar-0000\.vtu: tool 'bar' changes its shape"):
        read_recording(folder)


def test_a_film_draws_it_where_it_is_at_each_moment() -> None:
    """From above: 30 x 3 mm along x, then along y from (17, 2) to (20, 32)."""
    seen = View(0.0, 40.0, 0.0, 40.0, 0.5)
    layers, below = ToolLayers([BAR], np.eye(3), seen), np.full(seen.shape, -np.inf)
    for frame, (left, bottom, right, top) in ((0, (5, 0, 35, 3)), (1, (17, 2, 20, 32))):
        shown = layers.around(below, [BAR.interpolate(frame, frame, 0.0)])[1][..., 3] > 0.0
        rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
        found = [columns[0], rows[0], columns[-1] + 1, rows[-1] + 1]
        np.testing.assert_allclose(0.5 * np.array(found), [left, bottom, right, top], atol=0.51)


def test_large_triangles_are_drawn_in_pieces_as_if_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    seen, rng = View(0.0, 60.0, 0.0, 50.0, 0.25), np.random.default_rng(4)
    corners = rng.uniform(-10.0, 70.0, (6, 3, 3))
    height, light = shading.render_triangles(corners, seen)
    monkeypatch.setattr(shading, "_WHOLE", np.inf)
    whole, lit = shading.render_triangles(corners, seen)
    assert np.isfinite(whole).mean() > 0.2
    np.testing.assert_array_equal(np.isfinite(height), np.isfinite(whole))
    np.testing.assert_allclose(height, whole, atol=1e-9)
    assert (np.abs(light - lit) < 1e-9).mean() > 0.999  # two faces may meet at a pixel


def test_long_notices_of_a_film_leave_the_clock_its_corner(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", failures=("kinetic energy over work 11.96 % is above 5 %; " * 3,))
    write_frames(folder, shell_history())
    recording = read_recording(folder)
    name, scale = next(iter(scales_of(recording).items()))
    stage = Stage(load_run(folder), recording, scale, "top", 480, tools=True)
    image = stage.image(recording.position[0], recording.fields[name][0], 0.0).astype(int)
    red = np.round(255 * np.array(to_rgb(RED)))
    ink = (np.abs(image - red).max(axis=2) < 60)[-80:]
    columns, rows = np.flatnonzero(ink.any(axis=0)), np.flatnonzero(ink.any(axis=1))
    assert columns[-1] < 480 - DPI * CLOCK + 20 and np.ptp(rows) > 20  # two lines and more


@needs_browser
def test_a_browser_turns_it(tmp_path: Path) -> None:
    """The specimen does not move: what changes is the bar, which turns from the right to upwards."""
    folder, history, shots = write_run(tmp_path / "run"), shell_history(), []
    history.frames[:] = [replace(history.frames[0], time=time) for time in (0.0, 1.0, 2.0)]
    write_frames(folder, history, (replace(BAR, offset=np.zeros_like(OFFSET)),))
    page = write_view(folder).as_uri()
    for frame in (1, 2):
        shots.append(drawn(tmp_path, f"{page}#frame={frame}&look=top", "800,700")[1][100:-130])
    changed = (np.abs(shots[0] - shots[1]).max(axis=2) > 0.02).sum(axis=1)
    lying = int(np.argmax(changed))
    assert changed[: lying - 50].sum() > 400 and changed[lying + 50 :].sum() < 40
