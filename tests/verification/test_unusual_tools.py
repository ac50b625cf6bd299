"""Tools that are unusual but can form: clearances from their geometry, and none of them is rejected."""

from itertools import pairwise

import meshio
import numpy as np
import pytest
from matplotlib.path import Path as Polygon

from knittest.config.tools import Die, Holder, Stamp, StlTool
from knittest.models.surface import TriangleMesh
from knittest.tooling.fit import Fit, Stroke, measure_fit
from knittest.tooling.outline import cap, wall
from knittest.tooling.toolset import build_tools

STROKE = Stroke(15.0, 2.2, (120.0, 120.0))
#: height of the middle of a dome of 15 mm over the edge of a die at full depth: a thickness
OVER = 2.2


def circle(radius, at=(0.0, 0.0), sides=96):
    turn = np.linspace(0.0, 2.0 * np.pi, sides + 1)[:-1]
    return np.asarray(at) + radius * np.column_stack([np.cos(turn), np.sin(turn)])


def box(x, y, at=(0.0, 0.0)):
    """Outline of a rectangle with points on its sides, for their triangles to follow it."""
    side = np.linspace(-1.0, 1.0, 25)[:-1]
    one = np.ones(24)
    parts = [(side, -one), (one, side), (-side, one), (-one, -side)]
    return np.asarray(at) + np.concatenate([np.column_stack(part) for part in parts]) * [0.5 * x, 0.5 * y]


def plate(outer, *holes, low, high):
    """Upright walls round ``outer`` and ``holes`` between two heights."""

    def body(points):
        inside = [Polygon(ring).contains_points(points) for ring in (outer, *holes)]
        return inside[0] & ~np.any([np.zeros(len(points), bool), *inside[1:]], axis=0)

    def at(ring, z):
        return np.column_stack([ring, np.full(len(ring), z)])

    caps = [cap([at(ring, z) for ring in (outer, *holes)], body, z == high) for z in (low, high)]
    walls = [wall(at(outer, low), at(outer, high)), *(wall(at(hole, high), at(hole, low)) for hole in holes)]
    return TriangleMesh.from_corners([*caps, *walls])


def revolved(profile, at=(0.0, 0.0), sides=96):
    """Body of revolution of a ``profile`` of radii and heights, the body on its left."""
    rings = [np.column_stack([circle(r, at, sides), np.full(sides, z)]) for r, z in profile]
    return TriangleMesh.from_corners([wall(low, high) for low, high in pairwise(rings)])


def dome(radius=15.0, at=(0.0, 0.0), sides=96, steps=41):
    turn = np.linspace(0.0, 0.5 * np.pi, steps)
    profile = [*zip(radius * np.sin(turn), -radius * np.cos(turn), strict=True), (radius, 40.0), (0.0, 40.0)]
    return revolved(profile, at, sides)


def both(*meshes):
    return TriangleMesh.from_corners([mesh.corners for mesh in meshes])


def fit_of(folder, stroke=STROKE, **meshes) -> Fit:
    files = {}
    for name, mesh in meshes.items():
        path = folder / f"{name}.stl"
        meshio.write(path, meshio.Mesh(mesh.points, [("triangle", mesh.triangles)]), file_format="stl", binary=True)
        files[name] = StlTool(path=str(path))
    holder = Holder(stl=files["holder"]) if "holder" in files else None
    stamp, die = Stamp(kind="stl", stl=files["stamp"]), Die(stl=files["die"])
    return measure_fit(build_tools(stamp, die, holder, stroke.depth, stroke.thickness, stroke.blank), stroke)


BLOCK = box(160.0, 160.0)
RING = plate(BLOCK, circle(20.0), low=-40.0, high=0.0)
#: half the angle of a side of an octagon; slope of the wall of a cone
EIGHTH, SLOPE = np.pi / 8.0, np.arctan(9.0 / 40.0)
TOOLS = {
    "a stamp wider at the top": (
        revolved([(0.0, 0.0), (10.0, 0.0), (19.0, 40.0), (0.0, 40.0)]),
        plate(BLOCK, circle(25.0), low=-40.0, high=0.0), (15.0 - (15.0 - OVER) * np.tan(SLOPE)) * np.cos(SLOPE),
    ),
    "an opening that narrows downwards": (
        dome(), revolved([(20.0, 0.0), (17.0, -40.0), (80.0, -40.0), (80.0, 0.0), (20.0, 0.0)]),
        np.hypot(20.0, OVER) - 15.0,
    ),
    "a face that slopes to the opening": (
        dome(), revolved([(20.0, -5.0), (20.0, -40.0), (80.0, -40.0), (80.0, 0.0), (20.0, -5.0)]),
        np.hypot(20.0, OVER + 5.0) - 15.0,
    ),
    "a stamp off centre": (dome(at=(2.5, 0.0)), RING, np.hypot(17.5, OVER) - 15.0),
    "a coarse prism": (
        plate(circle(15.0, sides=8), low=0.0, high=40.0),
        plate(BLOCK, circle(20.0, sides=8), low=-40.0, high=0.0), 5.0 * np.cos(EIGHTH),
    ),
    "a dome of 60,000 triangles": (dome(sides=384, steps=79), RING, np.hypot(20.0, OVER) - 15.0),
    "a long bar between rails": (
        plate(box(150.0, 20.0), low=0.0, high=40.0),
        both(*(plate(box(160.0, 40.0, (0.0, y)), low=-40.0, high=0.0) for y in (-32.5, 32.5))), 2.5,
    ),
    "a ring thinner than the stroke": (
        dome(), plate(BLOCK, circle(20.0), low=-5.0, high=0.0), np.hypot(20.0, OVER) - 15.0,
    ),
    "sharp corners in plan": (
        plate(box(40.0, 40.0), low=0.0, high=40.0), plate(BLOCK, box(44.4, 44.4), low=-40.0, high=0.0), 2.2,
    ),
    "two domes": (
        both(dome(12.0, (-28.0, 0.0)), dome(12.0, (28.0, 0.0))),
        plate(BLOCK, circle(17.0, (-28.0, 0.0)), circle(17.0, (28.0, 0.0)), low=-40.0, high=0.0), 5.0,
    ),
    "an overlap outside the blank": (
        both(dome(), plate(box(8.0, 60.0, (70.0, 0.0)), low=-13.0, high=30.0)), RING, np.hypot(20.0, OVER) - 15.0,
    ),
    "skins": (
        TriangleMesh(dome().points, dome().triangles[dome().corners[:, :, 2].mean(axis=1) < 39.0]),
        TriangleMesh(RING.points, RING.triangles[RING.corners[:, :, 2].mean(axis=1) > -39.0]),
        np.hypot(20.0, OVER) - 15.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TOOLS)
def test_unusual_tools_fit_with_the_clearance_of_their_geometry(name, tmp_path):
    """Within the chords of circles of 96 sides, 0.011 mm at 20 mm."""
    stamp, die, clearance = TOOLS[name]
    fit = fit_of(tmp_path, stamp=stamp, die=die)
    assert fit.problems == ()
    if name == "a face that slopes to the opening":  # the stamp enters it by less than from the highest place
        assert 0.8 * STROKE.depth < fit.depth < STROKE.depth and len(fit.fit_warnings) == 1
    else:
        assert fit.depth == pytest.approx(STROKE.depth, abs=1e-3) and fit.fit_warnings == ()
    assert fit.die.size == pytest.approx(clearance, abs=0.02)


def test_a_holder_with_a_large_hole_and_a_narrow_blank_fit(tmp_path):
    holder = plate(BLOCK, circle(50.0), low=0.0, high=10.0)
    fit = fit_of(tmp_path, stamp=dome(), die=RING, holder=holder)
    assert fit.problems == () and fit.holder.size == pytest.approx(35.0, abs=0.04)
    fit = fit_of(tmp_path, Stroke(15.0, 2.2, (120.0, 60.0)), stamp=dome(), die=RING)
    assert fit.problems == () and fit.die.size == pytest.approx(np.hypot(20.0, OVER) - 15.0, abs=0.02)


def test_a_clearance_a_tenth_of_a_millimetre_too_small_is_rejected(tmp_path):
    die = plate(BLOCK, box(44.2, 44.2), low=-40.0, high=0.0)
    fit = fit_of(tmp_path, stamp=plate(box(40.0, 40.0), low=0.0, high=40.0), die=die)
    assert fit.die.size == pytest.approx(2.1, abs=1e-3)
    assert "is 2.1 mm" in fit.problems[0] and len(fit.problems) == 1
