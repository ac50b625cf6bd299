"""The gallery shows pictures of at most five lines each, which are planned as they stand; a run is made once."""

import pytest
from PIL import Image

import knittest.studies.command
from docs import gallery


class Planned(Exception):
    """All is read and resolved: the run would begin."""


@pytest.mark.parametrize(("name", "lines"), gallery.shown().items(), ids=list(gallery.shown()))
def test_lines_of_a_picture_are_short_and_can_be_run(name, lines, tmp_path, monkeypatch):
    def begins(*_: object) -> None:
        raise Planned

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(knittest.studies.command, "run_all", begins)
    assert len([line for line in lines.splitlines() if line]) <= 5
    with pytest.raises(Planned):
        gallery.made(lines, {})
    with Image.open(gallery.HERE / "gallery" / f"{name}.png") as picture:
        assert min(picture.size) >= 300


def test_every_picture_of_the_page_has_its_lines():
    text = (gallery.HERE / "gallery.md").read_text(encoding="utf-8")
    assert text.count("](gallery/") == len(gallery.shown()) >= 8
    assert {path.stem for path in (gallery.HERE / "gallery").glob("*.png")} == set(gallery.shown())


def test_a_run_is_made_once():
    left: dict[str, object] = {}
    first = gallery.made("made = []\nrun = made.append(1) or made\npicture = run\n", left)
    again = gallery.made("run = made.append(1) or made\npicture = len(run)\n", left)
    assert first["run"] == [1] and again["picture"] == 1


def test_an_unknown_picture_is_refused(capsys):
    assert gallery.main(["strip", "nothing"]) == 2
    assert "nothing: no picture of the gallery, which has strip" in capsys.readouterr().out
