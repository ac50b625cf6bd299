"""Fit of forming tools: closed forms of depth and clearance, and misfits that are rejected with what mends them."""

from dataclasses import replace
from itertools import pairwise
from math import cos, hypot, radians, tan
from pathlib import Path

import meshio
import numpy as np
import pytest
from matplotlib.image import imread

from knittest.base.errors import InputError
from knittest.cli.main import run as knittest
from knittest.config.loading import resolve
from knittest.config.tools import Die, DomeStamp, Holder, Stamp, StlTool, TStamp
from knittest.laboratory.forming.tool_check import fitting_tools, measured_tools
from knittest.models.surface import TriangleMesh
from knittest.runs.specimen import prepare
from knittest.tooling import outline
from knittest.tooling.fit import Stroke, measure_fit
from knittest.tooling.stl_tool import HeightMap
from knittest.tooling.tool_corrections import axis_rotations, fitting_change
from knittest.tooling.toolset import PLATE, ToolSet, build_tools

#: a small T and its blank, so that a set of files is sampled in tenths of a second
STROKE = Stroke(15.0, 2.2, (120.0, 120.0))
T = TStamp(bar_length=56.0, bar_width=20.0, stem_length=36.0, stem_width=20.0, edge_radius=4.0, outer_corner_radius=5.0,
           inner_corner_radius=12.0)  # fmt: skip
DIE, HOLDER = Die(clearance=6.0, edge_radius=4.0), Holder(clearance=6.0)
ALL = ("stamp", "die", "holder")
Meshes = dict[str, TriangleMesh]


def by_dimensions(stamp: Stamp, stroke: Stroke = STROKE, die: Die = DIE, holder: Holder | None = HOLDER) -> ToolSet:
    return build_tools(stamp, die, holder, stroke.depth, stroke.thickness, stroke.blank)


@pytest.fixture(scope="module")
def meshes():
    """The small T with triangles of 5 mm along its outline, so that it is looked at fast."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(outline, "LONGEST", 5.0)
        return {name: tool.solid for name, tool in by_dimensions(Stamp(t=T)).by_name.items()}


def by_files(meshes: Meshes, folder: Path, stroke: Stroke = STROKE, **fields: object) -> ToolSet:
    files = {}
    for name, mesh in meshes.items():
        path = folder / f"{name}.stl"
        meshio.write(path, meshio.Mesh(mesh.points, [("triangle", mesh.triangles)]), file_format="stl", binary=True)
        files[name] = StlTool(path=str(path), spacing=1.5, **fields)
    return build_tools(
        Stamp(kind="stl", stl=files["stamp"]), Die(stl=files["die"]),
        Holder(stl=files["holder"]) if "holder" in files else None, stroke.depth, stroke.thickness, stroke.blank,
    )  # fmt: skip


def turned(meshes: Meshes, rotation: tuple[float, float, float], names: tuple[str, ...] = ALL) -> Meshes:
    return {name: mesh.with_rotation(rotation) if name in names else mesh for name, mesh in meshes.items()}


def mended(tools: ToolSet, stroke: Stroke = STROKE) -> tuple[str, ToolSet]:
    """Advice on ``tools`` as one text, and the tools made again with it."""
    change = fitting_change(tools, stroke)
    assert change is not None
    return " ".join(change.settings), replace(
        tools, **{name: tools.by_name[name].with_fields(**fields) for name, fields in change.fields.items()}
    )


def assert_mended(tools: ToolSet, problem: str, *advice: str) -> None:
    """The ``problem`` is found, one of ``advice`` is given, and it mends the tools."""
    assert problem in " ".join(measure_fit(tools, STROKE).problems)
    text, changed = mended(tools)
    assert text in advice
    fit = measure_fit(changed, STROKE)
    assert fit.problems == () and fit.depth == pytest.approx(STROKE.depth, abs=0.01)


@pytest.mark.parametrize("depth", [25.0, 40.0])
@pytest.mark.parametrize("thickness", [2.22, 2.6])
def test_depth_and_clearances_of_the_shipped_t_are_its_closed_forms(depth, thickness):
    """The die's wall begins a radius below its face, where the stamp is narrower than there by its draft."""
    stroke = Stroke(depth, thickness, (330.0, 330.0))
    fit = measure_fit(by_dimensions(Stamp(), stroke, Die(), Holder()), stroke)
    draft = radians(2.0)
    assert fit.problems == () and fit.fit_warnings == () and fit.depth == pytest.approx(depth)
    assert fit.die.size == pytest.approx((8.0 + (thickness + 8.0) * tan(draft)) * cos(draft), abs=1e-3)
    assert fit.die.travel == depth and fit.die.place[2] == pytest.approx(-0.5 * thickness - 8.0, abs=1e-3)
    assert fit.holder.size == pytest.approx((8.0 - PLATE * tan(draft)) * cos(draft), abs=1e-3)


@pytest.mark.parametrize(("radius", "depth"), [(50.0, 40.0), (30.0, 25.0)])
def test_depth_and_clearance_of_a_hemisphere_are_its_closed_forms(radius, depth):
    """The sphere is nearest to the torus of the die's edge: distance of their centres less both radii."""
    stroke = Stroke(depth, 2.6, (330.0, 330.0))
    stamp = Stamp(kind="hemisphere", hemisphere=DomeStamp(radius=radius))
    fit = measure_fit(by_dimensions(stamp, stroke, Die(), None), stroke)
    apart = hypot(radius + 16.0, 1.3 - depth + radius + 1.3 + 8.0)
    assert fit.problems == () and fit.depth == pytest.approx(depth)
    assert fit.die.size == pytest.approx(apart - 8.0 - radius, abs=0.05)  # corners of the mesh are 2 mm apart


def test_files_give_the_numbers_of_the_dimensions(meshes, tmp_path):
    """Within the sampling of rounded edges, h^2 / (8 r) at 1.5 mm and 4 mm twice."""
    exact, sampled = (measure_fit(t, STROKE) for t in (by_dimensions(Stamp(t=T)), by_files(meshes, tmp_path)))
    assert sampled.problems == () and sampled.fit_warnings == ()
    assert sampled.depth == pytest.approx(exact.depth, abs=1e-3)
    assert sampled.die.size == pytest.approx(exact.die.size, abs=0.15)


def test_there_are_24_axis_rotations():
    axes = TriangleMesh(np.eye(3), np.array([[0, 1, 2]]))
    matrices = {axes.with_rotation(r).points.round().tobytes() for r in axis_rotations()}
    assert len(matrices) == len(axis_rotations()) == 24 and axis_rotations()[0] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("rotation", [(-90.0, 0.0, 0.0), (0.0, 90.0, 0.0), (180.0, 0.0, 0.0), (0.0, 0.0, 90.0)])
def test_a_rotated_set_fits_or_is_mended_by_the_advice(meshes, tmp_path, rotation):
    """Only a set turned about z stands as it shall; each other one is rejected with a rotation that makes it fit."""
    tools = by_files(turned(meshes, rotation), tmp_path)
    upright = rotation[:2] == (0.0, 0.0)
    fit = measure_fit(tools, STROKE)
    assert (fit.problems == ()) == upright
    if not upright:
        text, changed = mended(tools)
        assert text.count("rotation=") == 3 and "offset" not in text
        assert measure_fit(changed, STROKE).problems == ()
        # upright again: the area of the section of the T, whichever way it looks
        there = changed.stamp.height_map(STROKE.blank).covered_cells
        assert there.sum() == pytest.approx(
            by_files(meshes, tmp_path).stamp.height_map(STROKE.blank).covered_cells.sum(), rel=0.05
        )


@pytest.mark.parametrize(
    ("names", "problem", "advice"),
    [
        (("stamp",), "The stamp stands upside down: the lower edge is sharp", "rig.stamp.stl.rotation=[180,0,0]"),
        (("die",), "The die stands upside down: the upper edge of the opening", "rig.die.stl.rotation=[180,0,0]"),
        (("holder",), "The holder stands upside down", "rig.holder.stl.rotation=[180,0,0]"),
        (("stamp", "die"), "stands upside down", "rig.stamp.stl.rotation=[180,0,0] rig.die.stl.rotation=[180,0,0]"),
    ],
)
def test_tools_upside_down_are_rejected(meshes, tmp_path, names, problem, advice):
    assert_mended(by_files(turned(meshes, (180.0, 0.0, 0.0), names), tmp_path), problem, advice)


def test_a_stated_rotation_overrules_the_check_of_edges(meshes, tmp_path):
    fit = measure_fit(by_files(turned(meshes, (180.0, 0.0, 0.0)), tmp_path, rotation=(0.0, 0.0, 0.0)), STROKE)
    assert fit.problems == () and len(fit.fit_warnings) == 3


X = "rig.stamp.stl.offset_x=-{0:g} rig.stamp.stl.offset_y=0"
#: changed meshes, the problem and the advice; by 4.5 mm a stamp still enters, with a clearance of 1.7 mm
MISFITS = {
    "swapped files": (
        lambda meshes: {"stamp": meshes["die"], "die": meshes["stamp"]},
        "The stamp does not enter an opening of the die",
        "rig.stamp.stl.path={1}/die.stl rig.die.stl.path={1}/stamp.stl",
    ),
    "a stamp beside the opening": (
        lambda meshes: {"stamp": meshes["stamp"].with_offset((20.0, 0.0, 0.0))},
        "at least the fabric's thickness, 2.2 mm",
        X.format(20.0),
    ),
    "a stamp off centre": (
        lambda meshes: {"stamp": meshes["stamp"].with_offset((4.5, 0.0, 0.0))},
        "at least the fabric's thickness, 2.2 mm",
        X.format(4.5),
    ),
    "a die in another unit": (
        lambda meshes: {"die": meshes["die"].with_offset((0.0, 0.0, 0.0), 0.1)}, "The stamp", "rig.die.stl.scale=10",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", MISFITS)
def test_files_that_do_not_fit_are_rejected(meshes, tmp_path, kind):
    change, problem, advice = MISFITS[kind]
    assert_mended(by_files({**meshes, **change(meshes)}, tmp_path), problem, advice.format(0, tmp_path))


def test_a_set_beyond_the_blank_is_rejected_with_the_unit(meshes, tmp_path, monkeypatch):
    """The opening of a die ten times too large lies beside the blank: there is nothing to sample."""
    monkeypatch.chdir(tmp_path)
    sets = settings(tmp_path, {name: mesh.with_offset((0.0, 0.0, 0.0), 10.0) for name, mesh in meshes.items()})
    run = resolve(variant="1", scale="macro", test="forming", preset="quick", sets=sets)
    advice = " ".join(f"--set rig.{name}.stl.scale=0.1" for name in ALL)
    with pytest.raises(InputError, match=r"lies where the fabric cannot touch it.*The tools fit with " + advice):
        measured_tools(run, 2.2)


def test_files_far_too_small_are_rejected_with_the_units(meshes, tmp_path):
    with pytest.raises(InputError, match=r"size 0\.05\d+ mm on a blank of 120 mm; .* 1000 for metres"):
        by_files({name: mesh.with_offset((0.0, 0.0, 0.0), 1e-3) for name, mesh in meshes.items()}, tmp_path)


def cup(inner: float, outer: float, deep: float, floor: float) -> TriangleMesh:
    """A round block with a cavity: a cylinder of radius ``outer`` with a hole of radius ``inner``, ``deep`` [mm]."""
    turn = np.linspace(0.0, 2.0 * np.pi, 65)[:-1]
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    profile = [(0.0, -deep), (inner, -deep), (inner, -3.0), (inner + 1.0, -0.9), (inner + 3.0, 0.0), (outer, 0.0),
               (outer, -deep - floor), (0.0, -deep - floor)]  # fmt: skip
    rings = [np.column_stack([r * ring, np.full(64, z)]) for r, z in profile]
    parts = []
    for low, high in pairwise(rings):
        a, b = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
        parts += [np.stack([low, high, a], axis=1), np.stack([a, high, b], axis=1)]
    mesh = TriangleMesh.from_corners(parts)
    return mesh if mesh.volume > 0.0 else mesh.with_reversed_triangles()


@pytest.fixture(scope="module")
def dome():
    return by_dimensions(Stamp(kind="hemisphere", hemisphere=DomeStamp(radius=15.0))).stamp.solid


def test_a_die_with_a_floor_is_a_cavity(dome, tmp_path):
    """Its clearance is its depth less the stroke and a thickness more; a shallower one is rejected."""
    fit = measure_fit(by_files({"stamp": dome, "die": cup(21.0, 55.0, 15.5, 10.0)}, tmp_path), STROKE)
    assert fit.problems == () and fit.die.size == pytest.approx(15.5 - 15.0 + 2.2, abs=1e-3)
    for deep, problem in ((13.8, "is 1 mm"), (7.8, "they overlap by 5 mm")):
        tools = by_files({"stamp": dome, "die": cup(21.0, 55.0, deep, 10.0)}, tmp_path)
        problems = " ".join(measure_fit(tools, STROKE).problems)
        assert problem in problems and fitting_change(tools, STROKE) is None


def test_a_closed_cavity_upside_down_is_rejected(dome, tmp_path):
    die = cup(21.0, 55.0, 20.0, 10.0).with_rotation((180.0, 0.0, 0.0))
    assert_mended(by_files({"stamp": dome, "die": die}, tmp_path), "they overlap", "rig.die.stl.rotation=[180,0,0]")


def test_an_open_surface_upside_down_is_rejected(dome, tmp_path):
    """A skin of the face and the cavity stands as a pot on its face: its rim is no face."""
    solid = cup(21.0, 55.0, 20.0, 10.0)
    touched = np.hypot(*solid.points[:, :2].T) < 54.0
    skin = TriangleMesh(solid.points, solid.triangles[touched[solid.triangles].any(axis=1) &
                        (solid.points[solid.triangles][:, :, 2].max(axis=1) > -20.5)])  # fmt: skip
    upright = by_files({"stamp": dome, "die": skin}, tmp_path)
    assert "open surface" in " ".join(upright.notes) and measure_fit(upright, STROKE).problems == ()
    tools = by_files({"stamp": dome, "die": skin.with_rotation((180.0, 0.0, 0.0))}, tmp_path)
    assert_mended(tools, "stamp", "rig.die.stl.rotation=[180,0,0]")


def test_a_holder_with_a_narrow_opening_is_rejected(meshes, tmp_path):
    narrow = by_dimensions(Stamp(kind="hemisphere", hemisphere=DomeStamp(radius=10.0))).by_name["holder"].solid
    tools = by_files({**meshes, "holder": narrow}, tmp_path)
    assert any("Stamp and holder overlap" in text for text in measure_fit(tools, STROKE).problems)


def test_an_edge_width_is_that_of_a_quarter_circle(meshes):
    """A fall f below an edge of radius r takes sqrt(2 r f - f^2) in plan, less where the fall counts as flat."""
    up = HeightMap.of(meshes["die"], STROKE.blank)
    inside = HeightMap.of(meshes["stamp"], STROKE.blank).covered_cells
    fall, radius = 3.0, 4.0
    flat = 0.02 * fall
    true = (2.0 * radius * fall - fall**2) ** 0.5 - (2.0 * radius * flat - flat**2) ** 0.5
    assert up.edge_width(fall, up.face, inside) == pytest.approx(true, rel=0.15)
    down = HeightMap.of(meshes["die"], STROKE.blank, below=True)
    assert down.edge_width(fall, down.face, inside) == 0.0


def settings(folder: Path, meshes: Meshes) -> list[str]:
    by_files(meshes, folder)
    named = [f"rig.{name}.stl.path={name}.stl" for name in ALL] + [f"rig.{name}.stl.spacing=1.5" for name in ALL]
    return [
        "rig.stamp.kind=stl", *named, "rig.blank_length=120", "rig.blank_width=120", "rig.depth=15",
        "rig.blank_holder_force=50",
    ]  # fmt: skip


def test_a_run_and_the_check_reject_tools_with_the_way_out(meshes, tmp_path, monkeypatch, capsys):
    """Exit code 2 with files, numbers, advice and a picture; the run too; with the advice both go."""
    monkeypatch.chdir(tmp_path)
    sets = settings(tmp_path, turned(meshes, (-90.0, 0.0, 0.0)))
    words = ["--variant", "1", "--scale", "macro", "--preset", "quick"]
    assert knittest(["check", "forming", *words, "--no-time", *(w for s in sets for w in ("--set", s))]) == 2
    text = capsys.readouterr().err
    advice = [f"rig.{name}.stl.rotation=[90,0,0]" for name in ALL]
    for said in ("rig.stamp.stl.path = ", "stamp.stl", "expected at least 90 %", *advice, "check/tools.png"):
        assert said in text
    assert np.ptp(imread(tmp_path / "check" / "tools.png")[:, :, :3], axis=(0, 1)).min() > 0.5
    assert knittest(["forming", *words, "--out", "run", *(w for s in sets for w in ("--set", s))]) == 2
    assert "The tools fit with --set" in capsys.readouterr().err
    run = resolve(variant="1", scale="macro", test="forming", preset="quick", sets=[*sets, *advice])
    assert prepare(run).model.n_nodes > 0


def test_a_clearance_thinner_than_the_fabric_is_rejected_with_the_field():
    sets = ["rig.die.clearance=1", "rig.stamp.t.draft_angle=0"]
    run = resolve(variant="1", scale="macro", test="forming", preset="quick", sets=sets)
    with pytest.raises(InputError, match=r"is 1 mm .* 2\.22 mm\. Set rig\.die\.clearance to at least 2\.3 mm\."):
        fitting_tools(run, run.fabric.thickness_mm)
