"""A file of another test than the one asked for is named as such, before it is asked for sizes that it has not."""

from pathlib import Path

import pytest

from knittest.base.files import data_dir
from knittest.cli.main import run
from knittest.experiment.lab_tests import looks_like

LAB = data_dir() / "tutorial"
FILES = [("frame-1.csv", "picture-frame"), ("cantilever-warp.csv", "cantilever"), ("friction-1.csv", "friction")]
STRIPS = [path for path in sorted(LAB.glob("*.csv")) if path.stem.split("-")[0] in ("warp", "weft", "yarn")]


@pytest.mark.parametrize(("name", "test"), FILES)
@pytest.mark.parametrize("command", [["stats"], ["import", "--direction", "warp", "--out", "data/mine"]])
@pytest.mark.parametrize("sizes", [[], ["--width", "50", "--gauge-length", "200"]])
def test_a_file_of_another_test_is_no_strip(tmp_path, monkeypatch, capsys, command, name, test, sizes):
    """With sizes of a strip a pull between plates was a tensile test of 1.5 %: silently wrong."""
    monkeypatch.chdir(tmp_path)
    assert run(["data", *command, str(LAB / name), *sizes]) == 2
    assert f"{name}: looks like a {test} test; give --test {test}" in capsys.readouterr().err
    assert not Path("data").exists()


def test_a_file_without_a_head_is_known_by_its_name(tmp_path, capsys):
    path = tmp_path / "rahmen-1.csv"
    path.write_text("Weg [mm];Kraft [N]\n0;0\n5;1\n10;2\n")
    assert run(["data", "stats", str(path)]) == 2
    assert "for a picture-frame test, give --test picture-frame" in capsys.readouterr().err
    assert run(["data", "stats", str(LAB / "friction-1.csv"), "--test", "cantilever"]) == 2
    assert "for a friction test, give --test friction" in capsys.readouterr().err


@pytest.mark.parametrize("path", STRIPS, ids=lambda path: path.name)
def test_strips_and_yarns_look_like_no_other_test(path):
    assert len(STRIPS) == 16 and looks_like(path) == ""


def test_who_says_tensile_is_believed(tmp_path, capsys):
    path = tmp_path / "a.csv"
    path.write_text("Reibung der Backen;keine\nWeg [mm];Kraft [N]\n0;0\n1;2000\n3;6000\n")
    given = ["data", "stats", str(path), "--gauge-length", "200"]
    assert run(given) == 2 and "looks like a friction test" in capsys.readouterr().err
    assert run([*given, "--test", "tensile"]) == 0
