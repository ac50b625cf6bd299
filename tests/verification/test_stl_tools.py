"""Tools from STL files: the same as by dimensions, what is mended, what is refused, and the sampling's own accuracy."""

import time
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.config.tools import Die, Holder, Stamp, StlTool
from knittest.laboratory.forming.tool_check import write_tools
from knittest.models.surface import TriangleMesh, surface
from knittest.tooling.fit import Stroke, measure_fit
from knittest.tooling.toolset import ToolSet, build_tools

DEPTH, THICKNESS, BLANK = 30.0, 2.6, (330.0, 330.0)
SHAPED = Stamp(kind="hemisphere")


@pytest.fixture(scope="module")
def by_dimensions() -> ToolSet:
    return build_tools(SHAPED, Die(), Holder(), DEPTH, THICKNESS, BLANK)


def write(path: Path, mesh: TriangleMesh) -> StlTool:
    """Binary STL; a coarse grid, because the tests look at what becomes of the surface."""
    meshio.write(path, meshio.Mesh(mesh.points, [("triangle", mesh.triangles)]), file_format="stl", binary=True)
    return StlTool(path=str(path), spacing=2.0)


def built(stamp: StlTool, die: StlTool) -> ToolSet:
    return build_tools(Stamp(kind="stl", stl=stamp), Die(stl=die), None, DEPTH, THICKNESS, BLANK)


def test_exported_tools_come_back_as_they_were(by_dimensions, tmp_path):
    """All three, through write_tools: the kernel's own samples of the holder too."""
    stamp, die, holder = (StlTool(path=str(path), spacing=2.0) for path in write_tools(by_dimensions, tmp_path / "new"))
    found = build_tools(Stamp(kind="stl", stl=stamp), Die(stl=die), Holder(stl=holder), DEPTH, THICKNESS, BLANK)
    assert found.notes == ()
    for name, tool in by_dimensions.by_name.items():
        assert found.by_name[name].solid.volume == pytest.approx(tool.solid.volume, rel=1e-6)
        assert found.by_name[name].solid.points.min(axis=0) == pytest.approx(tool.solid.points.min(axis=0), abs=1e-4)
    assert found.holder.distance(np.array([[120.0, 0.0, -1.7]])) == pytest.approx([3.0], abs=1e-4)


@pytest.fixture
def files(tmp_path: Path, by_dimensions: ToolSet) -> tuple[StlTool, StlTool]:
    stamp, die = by_dimensions.stamp.solid, by_dimensions.die.solid
    return write(tmp_path / "stamp.stl", stamp), write(tmp_path / "die.stl", die.with_offset((0.0, 0.0, 77.0)))


def skin(mesh: TriangleMesh, touched: np.ndarray) -> TriangleMesh:
    """Only the triangles whose corners are all ``touched`` (n_points,)."""
    return TriangleMesh(mesh.points, mesh.triangles[touched[mesh.triangles].all(axis=1)])


def compare(found: ToolSet, expected: ToolSet, tolerance: float) -> None:
    """Both tools the same within ``tolerance`` [mm] near the surfaces the fabric touches."""
    rng = np.random.default_rng(2)
    for name in ("stamp", "die"):
        points = expected.by_name[name].solid.points
        points = points[(np.abs(points[:, :2]) < 150.0).all(axis=1) & (np.abs(points[:, 2]) < DEPTH)]
        points = points[rng.integers(0, len(points), 4000)] + rng.uniform(-2.0, 2.0, (4000, 3))
        off = found.by_name[name].distance(points) - expected.by_name[name].distance(points)
        assert np.abs(off).max() < tolerance, name


def test_files_of_shaped_tools_give_the_same_tools(files, by_dimensions):
    """Wherever the file lies in z. Trilinear samples at 2 mm: h^2 / (8 r), edges of 8 mm seen from 2 mm inside: 0.08,
    twice curved in plan at most, chords of 0.02 mm.
    """
    found = built(*files)
    compare(found, by_dimensions, 0.17)
    assert found.notes == ()
    stroke = Stroke(DEPTH, THICKNESS, BLANK)
    true = measure_fit(replace(by_dimensions, holder=None), stroke)
    assert measure_fit(found, stroke).die.size == pytest.approx(true.die.size, abs=0.17)


def test_inverted_files_and_patches_are_turned(files, by_dimensions, tmp_path):
    stamp = by_dimensions.stamp.solid
    patch = np.arange(len(stamp.triangles)) < 40
    write(tmp_path / "stamp.stl", stamp.with_reversed_triangles(~patch))
    found = built(*files)
    compare(found, by_dimensions, 0.17)
    assert "stamp: stamp.stl: 40 triangles with another orientation than their neighbours were flipped" in found.notes
    assert "stamp: stamp.stl: all triangles faced inwards and were flipped" in found.notes


@pytest.mark.parametrize("turned", [False, True])
def test_skins_become_bodies_away_from_the_fabric(files, by_dimensions, tmp_path, turned):
    """The die's face and shoulder and wall, the stamp without its lid."""
    stamp, die = by_dimensions.stamp.solid, by_dimensions.die.solid
    cup = skin(stamp, stamp.points[:, 2] < stamp.points[:, 2].max() - 1e-6)
    plate = skin(die, (np.abs(die.points[:, :2]) < 184.0).all(axis=1) | (die.points[:, 2] > -2.0))
    plate = skin(plate, plate.points[:, 2] > die.points[:, 2].min() + 1e-6)
    for name, mesh in (("stamp", cup), ("die", plate)):
        write(tmp_path / f"{name}.stl", mesh.with_reversed_triangles() if turned else mesh)
    found = built(*files)
    assert sum("an open surface" in note for note in found.notes) == 2
    assert sum("inwards" in note for note in found.notes) == 2 * turned
    assert all(len(tool.solid.borders()) == 0 for tool in found.by_name.values())
    rng = np.random.default_rng(4)
    points = np.column_stack([rng.uniform(-120.0, 120.0, (20000, 2)), rng.uniform(-8.0, 8.0, 20000)])
    for name in ("stamp", "die"):
        true = by_dimensions.by_name[name].distance(points)
        near = np.abs(true) < 4.0
        assert np.abs(found.by_name[name].distance(points[near]) - true[near]).max() < 0.17
        assert near.sum() > 300


def test_scale_offset_and_dead_triangles(files, by_dimensions, tmp_path):
    """In inches, 10 mm off, with triangles that have two corners in one place."""
    stamp = by_dimensions.stamp.solid
    dead = np.concatenate([stamp.corners, np.repeat(stamp.corners[:3, :1], 3, axis=1)])
    flat = TriangleMesh(dead.reshape(-1, 3) / 25.4 + [10.0 / 25.4, 0.0, 0.0], np.arange(3 * len(dead)).reshape(-1, 3))
    in_inches = write(tmp_path / "stamp.stl", flat).model_copy(update={"scale": 25.4, "offset_x": -10.0})
    found = built(in_inches, files[1])
    compare(found, by_dimensions, 0.17)
    assert found.notes == ("stamp: stamp.stl: 3 triangles without area were removed",)


def test_files_that_are_no_tools_are_refused(files, by_dimensions, tmp_path):
    stamp, path = by_dimensions.stamp.solid, tmp_path / "stamp.stl"
    fin = np.concatenate([stamp.triangles, [[*stamp.triangles[0, :2], stamp.triangles[5000, 0]]]])
    wall = TriangleMesh(np.array([[0.0, 0, 0], [50, 0, 0], [50, 0, 50], [0, 0, 50]]), np.array([[0, 1, 2], [0, 2, 3]]))
    for mesh, message in (
        (
            stamp.with_offset((0, 0, 0), 1e-3),
            r"stamp\.stl: size 0\.1 mm on a blank of 330 mm; .* set scale: 10 for centimetres, 25\.4",
        ),
        (TriangleMesh(stamp.points, fin), r"stamp\.stl: more than two triangles meet at 1 edges"),
        (wall, "an open vertical surface"),
        (_moebius(), "one-sided surface"),
    ):
        write(path, mesh)
        with pytest.raises(InputError, match=message):
            built(*files)
    path.unlink()
    with pytest.raises(InputError, match=r"stamp\.stl: no such file"):
        built(*files)
    with pytest.raises(InputError, match=r"rig\.die\.stl: missing"):
        build_tools(Stamp(kind="stl", stl=files[0]), Die(), None, DEPTH, THICKNESS, BLANK)


def _moebius() -> TriangleMesh:
    turn = np.linspace(0.0, 2.0 * np.pi, 21)[:-1]
    rings = [
        np.column_stack([(40 + s * np.cos(turn / 2)) * np.cos(turn), (40 + s * np.cos(turn / 2)) * np.sin(turn),
                         s * np.sin(turn / 2)]) for s in (-9.0, 9.0)
    ]  # fmt: skip
    low, high = np.arange(20), np.arange(20) + 20
    ahead_low, ahead_high = np.roll(low, -1), np.roll(high, -1)
    ahead_low[-1], ahead_high[-1] = high[0], low[0]
    triangles = np.concatenate([np.stack([low, ahead_low, ahead_high], 1), np.stack([low, ahead_high, high], 1)])
    return TriangleMesh(np.concatenate(rings), triangles)


def solid_angles(mesh: TriangleMesh, points: np.ndarray) -> np.ndarray:
    """Sum of the solid angles of all triangles (Van Oosterom & Strackee, 1983): 4 pi inside, 0 outside."""
    a, b, c = np.moveaxis(mesh.corners[None] - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    dots = [np.einsum("ptk,ptk->pt", u, v) for u, v in ((a, b), (b, c), (c, a))]
    volume = np.einsum("ptk,ptk->pt", a, np.cross(b, c))
    return 2.0 * np.arctan2(volume, la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb).sum(axis=1)


def test_signs_of_samples_are_those_of_the_solid_angle(by_dimensions):
    """An independent way to tell inside from outside, at samples of a body whose edges lie along the axes too."""
    mesh = by_dimensions.die.solid.with_offset((0.0, 0.0, 0.0), 0.1)
    tool = surface(mesh.points, mesh.triangles, 0.4)
    rng = np.random.default_rng(6)
    index = np.column_stack([rng.integers(0, n, 100) for n in tool.samples.shape])
    found = tool.samples[tuple(index.T)]
    index, found = index[np.abs(found) > 1e-9], found[np.abs(found) > 1e-9]  # not those on the surface
    inside = solid_angles(mesh, tool.position + 0.4 * index) > 2.0 * np.pi
    assert ((found < 0.0) == inside).all()
    assert 20 < inside.sum() < 80


def test_a_surface_that_runs_through_itself_is_one_body(by_dimensions):
    """Two spheres into each other: the distance of their union outside of it."""
    stamp = by_dimensions.stamp.solid
    both = np.concatenate([stamp.points, stamp.with_offset((30.0, 0.0, 0.0)).points])
    tool = surface(both, np.concatenate([stamp.triangles, stamp.triangles + len(stamp.points)]), 2.0)
    place = tool.position + 2.0 * np.argwhere(tool.samples > 0.0)
    place = place[place[:, 2] < 40.0]
    true = np.minimum(by_dimensions.stamp.distance(place), by_dimensions.stamp.distance(place - [30.0, 0.0, 0.0]))
    index = np.round((place - tool.position) / 2.0).astype(int)
    off = np.abs(tool.samples[tuple(index.T)] - true)
    assert off[true < 8.0].max() < 0.06  # chords of 0.02 mm both ways
    assert (off < 0.06 + 0.02 * true).all()


def test_sampling_is_quick(by_dimensions):
    """Cost of 3 million samples from 20,000 triangles: CPU seconds, compilation apart."""
    die = by_dimensions.die.solid
    surface(die.points, die.triangles, 8.0)
    begin = time.process_time()
    tool = surface(die.points, die.triangles, 1.35, [[-200.0, -200.0, -50.0], [200.0, 200.0, 5.0]])
    spent = time.process_time() - begin
    assert tool.samples.size > 2.5e6
    assert spent < 20.0
