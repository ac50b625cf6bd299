"""A draw with tools from STL files against the same with tools by dimensions."""

from dataclasses import replace

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.forming.tool_check import tools_of, write_tools
from knittest.models.surface import TriangleMesh
from knittest.runs.specimen import run_specimen

SMALL = [
    "rig.stamp.kind=hemisphere", "rig.stamp.hemisphere.radius=25", "rig.blank_length=120", "rig.blank_width=120",
    "rig.depth=15", "rig.imperfection=0", "model.macro.element_size=8", "solver.speed=1.5", "solver.ramp=4",
    "output.frames=2",
]  # fmt: skip


def test_a_draw_by_files_is_that_by_dimensions(tmp_path, monkeypatch):
    """Stamp and die sampled at 1 mm, the die as the skin the fabric touches: the same travel and forces, and a note.

    Shells of 8 mm, edges rounded within 1 mm: mean force over the second half of the draw 1.4 % apart, places 0.11 mm.
    """
    monkeypatch.chdir(tmp_path)
    plain = resolve(variant="1", scale="macro", test="forming", sets=SMALL)
    tools = tools_of(plain, plain.fabric.thickness_mm)
    write_tools(tools, tmp_path)
    die = tools.die.solid
    touched = (die.points[:, 2] > die.points[:, 2].min() + 1.0)[die.triangles].any(axis=1)
    wall = (np.abs(die.points[:, :2]) < 79.0).all(axis=1)[die.triangles].any(axis=1)
    skin = TriangleMesh(die.points, die.triangles[touched & wall])
    assert len(skin.borders()) > 0
    write_tools(replace(tools, die=replace(tools.die, solid=skin)), tmp_path / "skin")
    files = ["rig.stamp.kind=stl", "rig.stamp.stl.path=stamp.stl", "rig.die.stl.path=skin/die.stl"]
    changed = [s for s in SMALL if "hemisphere" not in s]
    runs = [plain, resolve(variant="1", scale="macro", test="forming", sets=[*changed, *files])]
    plain_run, by_files = (run_specimen(run) for run in runs)
    late = plain_run.history.curve["stamp_travel_mm"] > 7.5
    force = [s.history.curve["stamp_force_n"][late].mean() for s in (plain_run, by_files)]
    assert force[1] == pytest.approx(force[0], rel=0.03)
    assert force[0] > 1.0
    ends = [s.history.frames[-1].position for s in (plain_run, by_files)]
    assert np.abs(ends[1] - ends[0]).max() < 0.3
    assert any("die: die.stl: an open surface" in text for text in by_files.quality.warnings)
