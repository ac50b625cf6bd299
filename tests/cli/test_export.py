"""``knittest export stl``, and where STL files of a rig are looked for."""

from pathlib import Path

import pytest

from knittest.base.errors import InputError
from knittest.cli.main import run as knittest
from knittest.config.loading import resolve
from knittest.export.identity import data_files
from knittest.laboratory.forming.tool_check import measured_tools, tools_of
from knittest.models.surface import read_stl

CONFIG = """
rig:
  kind: forming
  stamp: {kind: stl, stl: {path: punch.stl, spacing: 3}}
  die: {stl: {path: block.stl, spacing: 3}}
"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("tools")
    arguments = ["--variant", "1", "--scale", "macro", "--set", "rig.blank_holder_force=100", "--out", str(folder)]
    assert knittest(["export", "stl", *arguments]) == 0
    return folder


def test_tools_are_written(exported):
    """The very meshes of the run, in mm, and a picture."""
    run = resolve(test="forming", variant="1", scale="macro", sets=("rig.blank_holder_force=100",))
    for name, tool in tools_of(run, run.fabric.thickness_mm).by_name.items():
        mesh = read_stl(exported / f"{name}.stl")
        assert mesh.volume == pytest.approx(tool.solid.volume, rel=1e-6)
    assert (exported / "tools.png").read_bytes().startswith(b"\x89PNG")


def test_stl_files_are_found_beside_the_config(exported, tmp_path, monkeypatch):
    """Wherever the command is given; the run keeps where they lie and counts them among its data."""
    (exported / "rig.yaml").write_text(CONFIG, encoding="utf-8")
    for old, new in (("stamp", "punch"), ("die", "block")):
        (exported / f"{new}.stl").write_bytes((exported / f"{old}.stl").read_bytes())
    monkeypatch.chdir(tmp_path)
    run = resolve(test="forming", variant="1", config=exported / "rig.yaml")
    assert run.rig.stamp.stl.path == str(exported / "punch.stl")
    assert {exported / "punch.stl", exported / "block.stl"} <= set(data_files(run))
    assert measured_tools(run, 2.6).fit.die.size > 7.0


def test_stl_files_elsewhere_are_refused(exported, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for path, message in (("missing.stl", "no such file"), (f"{exported}/stamp.stl", "expected a path in")):
        with pytest.raises(InputError, match=rf"rig\.die\.stl\.path = .*{message}"):
            resolve(test="forming", variant="1", sets=(f"rig.die.stl.path={path}",))
