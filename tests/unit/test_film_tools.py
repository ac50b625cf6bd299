"""Tools in films: what is nearest to the viewer, behind and before the specimen, and the colours of a GIF."""

from pathlib import Path

import numpy as np
import pytest
from export_sample import shell_history
from PIL import Image
from report_sample import write_run
from test_tools_in_frames import DIE, STAMP

from knittest.base.history import Body
from knittest.cli.main import run as command
from knittest.export.meshes import write_frames
from knittest.export.shading import View, render_triangles
from knittest.report_page.loaded_run import load_run
from knittest.report_page.moving.film import COLOURS, palette
from knittest.report_page.moving.recording import ToolLayers, read_recording, scales_of
from knittest.report_page.moving.stage import Stage

VIEW = View(0.0, 40.0, 0.0, 30.0, 0.5)


def test_the_nearest_of_two_triangles_is_seen_at_its_height() -> None:
    """A plane z = 0.1 x + 0.2 y below the line x / 40 + y / 30 = 1, and over a part of it a level one at 50."""
    slope = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 4.0], [0.0, 30.0, 6.0]])
    level = np.array([[0.0, 0.0, 50.0], [10.0, 0.0, 50.0], [0.0, 10.0, 50.0]])
    height, light = render_triangles(np.array([level, slope]), VIEW)
    y, x = (np.indices(VIEW.shape) + 0.5) * VIEW.pixel
    inside, over = x / 40.0 + y / 30.0 <= 1.0, x + y <= 10.0
    np.testing.assert_array_equal(np.isfinite(height), inside)
    np.testing.assert_allclose(height[inside & ~over], (0.1 * x + 0.2 * y)[inside & ~over], atol=1e-9)
    assert (height[over] == 50.0).all() and (light[inside] > 0.45).all() and (light[~inside] == 0.0).all()


@pytest.mark.parametrize("size", [0.6, 900.0])
def test_triangles_of_any_size_are_drawn_where_they_are_seen(size: float) -> None:
    centre = np.array([20.0, 15.0, 1.0])
    corners = centre + size * np.array([[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]])
    shown = np.isfinite(render_triangles(corners[None], VIEW)[0]).sum() * VIEW.pixel**2
    assert shown == pytest.approx(min(4.5 * size**2, 1200.0), rel=0.35)
    assert np.isinf(render_triangles(corners[None] + [1e4, 0.0, 0.0], VIEW)[0]).all()


def test_a_tool_is_behind_below_the_specimen_and_before_it_above() -> None:
    """A square at z = 0, seen from above, moves up by 10 past a specimen at 5, and 8 mm to the right."""
    square = np.array([[5.0, 5.0, 0.0], [15.0, 5.0, 0.0], [15.0, 15.0, 0.0], [5.0, 15.0, 0.0]])
    body = Body("plate", square, np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 10.0]]))
    layers = ToolLayers([body], np.eye(3), VIEW)
    specimen = np.full(VIEW.shape, 5.0)
    for frame, place in ((0, 0), (1, 1)):
        offset = body.offset[frame]
        images = layers.around(specimen, [body.interpolate(frame, frame, 0.0)])
        shown, other = images[place], images[1 - place]
        columns = np.flatnonzero(shown[20, :, 3])
        assert columns[0] * VIEW.pixel == pytest.approx(5.0 + offset[0]) and len(columns) == 20
        assert 0.0 < shown[20, columns[8], 3] < 0.5 and not other[..., 3].any()


def test_a_film_shows_the_tools_unless_told_not_to(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run")
    write_frames(folder, shell_history(), (STAMP, DIE))
    recording = read_recording(folder)
    name, scale = next(iter(scales_of(recording).items()))

    def drawn(tools: bool, time: float) -> np.ndarray:
        stage = Stage(load_run(folder), recording, scale, "side", 480, tools)
        return stage.image(recording.position[0], recording.fields[name][0], time)

    bare, shown, later = drawn(False, 0.0), drawn(True, 0.0), drawn(True, float(recording.time[-1]))
    assert shown.shape[0] > bare.shape[0]  # the tools are above and below the specimen
    area = (shown != 255).any(axis=2)
    assert area.mean() > 2.0 * (bare != 255).any(axis=2).mean()
    assert (shown != later)[: 3 * len(shown) // 4].any()  # the stamp has moved; the specimen and the clock's corner not
    words, films = ["--seconds", "0.2", "--width", "320"], [tmp_path / "bare.gif", tmp_path / "tools.gif"]
    for film, option in zip(films, (["--no-tools"], []), strict=True):
        assert command(["animate", str(folder), *words, *option, "--out", str(film)]) == 0
    without, drawn = (np.asarray(Image.open(film).convert("RGB")) for film in films)
    covered, bare_covered = ((image != 255).any(axis=2).sum() for image in (drawn, without))
    assert covered > 1.1 * bare_covered  # title and colour bar are in both


def test_a_few_pixels_that_stand_out_keep_their_colour() -> None:
    """Shades of grey all over, and a line of red, which a palette by the number of pixels loses."""
    image = np.repeat(np.linspace(90, 255, 60_000)[:, None], 3, axis=1).astype(np.uint8).reshape(200, 300, 3)
    image[100, :30] = [180, 4, 38]
    found = palette([image]).astype(int)
    assert found.shape == (COLOURS, 3)
    assert np.abs(found - [180, 4, 38]).max(axis=1).min() <= 8
    assert (found == 255).all(axis=1).any()
