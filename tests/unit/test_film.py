"""Films: their images by what must be on them, their files, and what is refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from export_sample import beam_history, shell_history
from PIL import Image
from report_sample import write_run

from knittest.base.errors import InputError
from knittest.cli.main import run as command
from knittest.export.meshes import write_frames
from knittest.export.shading import LOOKS, view_axes
from knittest.report_page.loaded_run import load_run
from knittest.report_page.moving.film import FilmOptions, animate, film_paths
from knittest.report_page.moving.recording import read_recording, scales_of
from knittest.report_page.moving.stage import Stage

SHORT = ["--seconds", "0.2", "--fps", "5", "--width", "320"]


@pytest.fixture(scope="module", params=["beams", "shells"])
def moved(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_run(tmp_path_factory.mktemp("film") / request.param)
    write_frames(folder, beam_history() if request.param == "beams" else shell_history())
    return folder


@pytest.mark.parametrize("look", LOOKS)
def test_a_line_of_sight_turns_and_does_not_stretch(look: str) -> None:
    np.testing.assert_allclose(view_axes(look) @ view_axes(look).T, np.eye(3), atol=1e-15)
    assert np.linalg.det(view_axes(look)) == pytest.approx(1.0)


def test_from_the_top_z_is_towards_the_viewer_and_from_the_side_up() -> None:
    np.testing.assert_allclose(view_axes("top"), np.eye(3), atol=1e-15)
    np.testing.assert_allclose(view_axes("side")[1], [0.0, 0.0, 1.0], atol=1e-15)


@pytest.mark.parametrize("form", [".gif", ".mp4"])
def test_a_film_has_its_images_and_its_size(moved: Path, tmp_path: Path, form: str) -> None:
    if form == ".mp4":
        ffmpeg = pytest.importorskip("imageio_ffmpeg")
    out = tmp_path / f"film{form}"
    words = ["--seconds", "0.4", "--fps", "10", "--width", "320", "--look", "top"]
    assert command(["animate", str(moved), "--out", str(out), *words]) == 0
    if form == ".mp4":
        count, seconds = ffmpeg.count_frames_and_secs(str(out))
        assert count == 14 and seconds == pytest.approx(1.4, abs=0.11)
    else:
        with Image.open(out) as film:
            assert film.size[0] == 320 and film.info["duration"] == 100 and 2 <= film.n_frames <= 14
    assert [path.name for path in tmp_path.iterdir()] == [out.name]


def test_failed_elements_are_gone_and_what_moves_moves(moved: Path) -> None:
    recording = read_recording(moved)
    name, scale = next(iter(scales_of(recording).items()))
    stage = Stage(load_run(moved), recording, scale, "top", 320, tools=True)

    value = recording.fields[name][0]
    none = stage.image(recording.position[0], np.full_like(value, np.nan), 1.0)

    def drawn(position: np.ndarray, value: np.ndarray) -> np.ndarray:
        return (stage.image(position, value, 1.0) != none).any(axis=2)

    whole = drawn(recording.position[0], value)
    half = drawn(recording.position[0], np.where(2 * np.arange(len(value)) < len(value), value, np.nan))
    assert 50 < half.sum() < 0.8 * whole.sum()
    assert (drawn(recording.position[0] + [5.0, 0.0, 0.0], value) != whole).any()


@pytest.mark.parametrize(
    ("out", "filmed", "said"),
    [
        ("film.avi", FilmOptions(), "ends with .mp4 or .gif"),
        ("film.gif", FilmOptions(colour="taste"), "colour 'taste': expected one of .*height"),
        ("film.gif", FilmOptions(look="inside"), "look 'inside': expected one of oblique, top, side"),
        ("film.gif", FilmOptions(seconds=0.0), "seconds = 0: expected 0.1 to 600"),
        ("film.gif", FilmOptions(width=100_000), "width = 100000: expected 320 to 3840"),
    ],
)
def test_what_no_film_can_be_made_of_is_refused(
    moved: Path, tmp_path: Path, out: str, filmed: FilmOptions, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        animate(moved, tmp_path / out, filmed)
    assert not list(tmp_path.iterdir())


def test_without_an_encoder_an_mp4_is_refused_and_nothing_left(moved: Path, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"pip install 'knittest\[animate\]', or write a .gif"):
        animate(moved, tmp_path / "film.mp4", FilmOptions(seconds=0.1, width=320))
    assert not list(tmp_path.iterdir())


def test_both_directions_get_a_film_each(moved: Path, tmp_path: Path) -> None:
    both = tmp_path / "both"
    for name in ("warp", "weft"):
        shutil.copytree(moved, both / name)
    assert command(["animate", str(both), "--out", str(tmp_path / "film.gif"), *SHORT]) == 0
    assert sorted(path.name for path in tmp_path.glob("*.gif")) == ["film-warp.gif", "film-weft.gif"]


def test_the_default_is_mp4_and_without_an_encoder_a_gif(moved: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr("knittest.report_page.moving.film.has_encoder", lambda: True)
    run = Path("runs/one")
    assert film_paths(run, [run], None) == ({run: run / "film.mp4"}, "")
    assert film_paths(run, [run], Path("a.gif")) == ({run: Path("a.gif")}, "")
    monkeypatch.setattr("knittest.report_page.moving.film.has_encoder", lambda: False)
    assert command(["animate", str(moved), *SHORT]) == 0
    out, err = capsys.readouterr()
    assert out.strip() == str(moved / "film.gif") and (moved / "film.gif").is_file()
    assert "pip install 'knittest[animate]'" in err
    (moved / "film.gif").unlink()
