"""Tools of forming by dimensions: distances against closed forms, meshes, kernel against exact, refusals."""

from math import cos, pi, radians, sin, tan

import numpy as np
import pytest
from matplotlib.image import imread
from pydantic import ValidationError

from knittest.base.errors import InputError
from knittest.config.tools import Die, DomeStamp, Holder, Stamp, TStamp
from knittest.kernels.tool_shapes import least_distances, tool_distance
from knittest.laboratory.forming.pictures import tools_picture
from knittest.models.tool import Tool, tool_arrays
from knittest.tooling.fit import Stroke, measure_fit
from knittest.tooling.outline import stamp_outline
from knittest.tooling.toolset import ToolSet, build_tools

DEPTH, THICKNESS = 40.0, 2.6


def tools(stamp: Stamp, holder: Holder | None = None) -> ToolSet:
    return build_tools(stamp, Die(), holder, DEPTH, THICKNESS, (330.0, 330.0))


@pytest.fixture(scope="module")
def shaped():
    return tools(Stamp(), Holder())


@pytest.fixture(scope="module")
def dome():
    return tools(Stamp(kind="hemisphere"))


def kernel(tool: Tool, points: np.ndarray) -> np.ndarray:
    arrays = tool_arrays([tool])
    return np.array([tool_distance(0, arrays, *p) for p in points])


def near_surface(tool_set: ToolSet, name: str, reach: float, count: int) -> np.ndarray:
    """Points within about ``reach`` [mm] of the corners of a mesh, where the fabric may come to lie."""
    rng = np.random.default_rng(3)
    corners = tool_set.by_name[name].solid.points
    touched = corners[(np.abs(corners[:, :2]) < 160.0).all(axis=1)]
    return touched[rng.integers(0, len(touched), count)] + rng.uniform(-reach, reach, (count, 3))


def test_a_dome_is_a_sphere_with_a_cylinder_on_top(dome):
    """|x - c| - R below the centre and rho - R above it, outside the axis."""
    radius, rng = 50.0, np.random.default_rng(1)
    points = rng.uniform([-70, -70, -10], [70, 70, 75], (2000, 3))
    above = points - [0.0, 0.0, 0.5 * THICKNESS + radius]
    rho = np.hypot(points[:, 0], points[:, 1])
    true = np.where(above[:, 2] < 0.0, np.linalg.norm(above, axis=1), rho) - radius
    assert dome.stamp.distance(points) == pytest.approx(true, abs=1e-12)
    near = np.abs(true) < 3.0
    assert np.abs(kernel(dome.stamp.tool, points[near])[:, 0] - true[near]).max() < 0.5**2 / (4.0 * 47.0)


def test_faces_walls_and_edges_of_a_t_lie_where_the_dimensions_say(shaped):
    """Heights over faces, distance from a wall with draft, from the rounded edge and from a fillet in plan."""
    low, draft = 0.5 * THICKNESS, radians(2.0)
    assert shaped.stamp.distance(np.array([[0.0, 0.0, -5.0], [0.0, 60.0, low]])) == pytest.approx([low + 5.0, 0.0])
    assert shaped.die.distance(np.array([[150.0, 150.0, 3.0]])) == pytest.approx([3.0 + low])
    assert shaped.holder.distance(np.array([[150.0, -150.0, -3.0]])) == pytest.approx([3.0 + low])
    # wall of the bar at y = 75, 30 mm above the bottom, 2 mm off
    wall = np.array([0.0, 75.0 + 30.0 * tan(draft) + 2.0 * cos(draft), low + 30.0 - 2.0 * sin(draft)])
    assert shaped.stamp.distance(wall[None]) == pytest.approx([2.0])
    # edge: 3 mm off along the ray at 45 deg from the centre of its 8 mm round
    centre = np.array([0.0, 75.0 - 8.0 * (1.0 - sin(draft)) / cos(draft), low + 8.0])
    assert shaped.stamp.distance((centre + 11.0 * np.array([0.0, 0.6, -0.8]))[None]) == pytest.approx([3.0])
    # inner corner: bottom of the bar y = 25, side of the stem x = 25, fillet of 20 mm about (45, 5)
    middle = np.array([45.0, 5.0]) + 17.0 * np.array([-0.6, 0.8])
    assert stamp_outline(Stamp()).distance(middle[None]) == pytest.approx([3.0])


@pytest.mark.parametrize("name", ["stamp", "die", "holder"])
def test_distances_have_unit_slope(shaped, name):
    """Central differences of 1e-4 mm near the surfaces: a distance in plan in a profile's distance is a distance."""
    points, h = near_surface(shaped, name, 2.0, 1500), 1e-4
    distance = shaped.by_name[name].distance
    slope = [(distance(points + h * e) - distance(points - h * e)) / (2.0 * h) for e in np.eye(3)]
    assert np.linalg.norm(slope, axis=0) == pytest.approx(np.ones(1500), abs=1e-4)


@pytest.mark.parametrize("name", ["stamp", "die", "holder"])
def test_the_kernel_s_tools_are_the_exact_ones(shaped, name):
    """Only the distance in plan is sampled, h = 0.5 mm: off by h^2 / (8 r), its slope by h / (sqrt 8 r), r >= 6 mm."""
    points = near_surface(shaped, name, 2.0, 3000)
    found = kernel(shaped.by_name[name].tool, points)
    assert np.abs(found[:, 0] - shaped.by_name[name].distance(points)).max() < 0.5**2 / (8.0 * 6.0)
    assert np.abs(np.linalg.norm(found[:, 1:], axis=1) - 1.0).max() < 0.5 / (8.0**0.5 * 6.0)


@pytest.mark.parametrize("name", ["stamp", "die", "holder"])
def test_least_distances_of_tools_are_lower_bounds(shaped, name):
    points = near_surface(shaped, name, 30.0, 500)
    arrays, least = tool_arrays([shaped.by_name[name].tool]), np.empty(500)
    least_distances(0, arrays, 0, 500, tuple(np.ascontiguousarray(points.T)), np.full(500, 0.7), 0.3, least)
    found = kernel(shaped.by_name[name].tool, points)[:, 0]
    assert (least <= found + 1e-12).all()
    # few nodes are looked at in vain: on the diagonal of an edge of 8 mm, sqrt(2) - 1 radii off it, and two samples off
    assert (least[found > (2.0**0.5 - 1.0) * 8.0 + 2.0**0.5 * 2.0 * 0.5] > 0.0).all()


@pytest.mark.parametrize("name", ["stamp", "die", "holder"])
def test_meshes_are_closed_and_lie_on_the_surface(shaped, name):
    tool = shaped.by_name[name]
    assert len(tool.solid.borders()) == 0
    rim = (np.abs(tool.solid.points[:, :2]) > 160.0).any(axis=1)
    top = np.isclose(tool.solid.points[:, 2], tool.solid.points[:, 2].max()) & (name == "stamp")
    assert np.abs(tool.distance(tool.solid.points[~rim & ~top])).max() < 3e-6  # points are kept to 1e-6 mm


def test_volume_of_a_t_follows_from_its_dimensions():
    """Without draft: area A of the outline times height, less what the edge takes (Steiner's formula for its offsets).

    Height z of the edge offsets the outline by s = r (cos phi - 1), phi from 0 to pi / 2: the integrals of A + P s +
    pi s^2 over the edge's height r are A r - P r^2 (1 - pi / 4) + pi r^3 (5 / 3 - pi / 2). The turning of a closed
    outline is 2 pi, concave corners or not.
    """
    t = TStamp(draft_angle=0.0, edge_radius=8.0)
    solid = tools(Stamp(t=t)).stamp.solid
    area = 150.0 * 50.0 + 100.0 * 50.0 - (1.0 - pi / 4.0) * (6.0 * 12.0**2 - 2.0 * 20.0**2)
    perimeter = 2.0 * (150.0 + 150.0) - (2.0 - pi / 2.0) * (6.0 * 12.0 + 2.0 * 20.0)
    height, r = float(np.ptp(solid.points[:, 2])), 8.0
    true = area * height - perimeter * r**2 * (1.0 - pi / 4.0) + pi * r**3 * (5.0 / 3.0 - pi / 2.0)
    assert solid.volume == pytest.approx(true, rel=3e-4)  # chords of 0.02 mm under arcs
    outline = stamp_outline(Stamp(t=t))
    assert outline.area == pytest.approx(area)


@pytest.mark.parametrize("name", ["stamp", "die"])
def test_normals_of_the_kernel_are_gradients_of_the_distance(name):
    """Also where the samples' spacing is no power of two: a rounded quotient once counted as off the grid."""
    small = TStamp(bar_length=57.0, bar_width=21.0, stem_length=37.0, stem_width=21.0, edge_radius=4.0,
                   outer_corner_radius=5.3, inner_corner_radius=12.0)  # fmt: skip
    die = Die(clearance=6.0, edge_radius=4.0)
    tool_set = build_tools(Stamp(t=small), die, None, 15.0, 2.2, (120.0, 120.0))
    tool = tool_set.by_name[name]
    points = near_surface(tool_set, name, 0.3, 400)
    points = points[(np.abs(points[:, :2]) < 40.0).all(axis=1) & (np.abs(points[:, 2]) < 10.0)]
    step = 1e-5 * np.eye(3)
    gradient = np.column_stack([(tool.distance(points + h) - tool.distance(points - h)) / 2e-5 for h in step])
    assert len(points) > 100
    assert np.abs(kernel(tool.tool, points)[:, 1:] - gradient).max() < 0.05


def test_the_gap_at_full_depth_is_the_clearance(shaped):
    """Place where the stamp, moved down, passes the die's face: across from wall to wall, 8 mm along the level."""
    stamp_wall = 75.0 + DEPTH * tan(radians(2.0))
    moved = np.array([[0.0, stamp_wall, 0.5 * THICKNESS + DEPTH]])
    assert shaped.stamp.distance(moved) == pytest.approx([0.0], abs=1e-12)
    assert shaped.die.distance(np.array([[0.0, stamp_wall, -20.0]])) == pytest.approx([8.0])


def test_picture_of_tools(dome, tmp_path):
    """A picture is drawn of a set without holder too, and is not blank."""
    path = tmp_path / "tools.png"
    stroke = Stroke(DEPTH, THICKNESS, (330.0, 330.0))
    tools_picture(path, dome, measure_fit(dome, stroke), stroke, title="hemisphere")
    assert np.ptp(imread(path)[:, :, :3], axis=(0, 1)).min() > 0.5


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"stem_width": 200.0}, "stem_width: must be at most bar_length"),
        ({"outer_corner_radius": 26.0}, "outer_corner_radius: must be at most half"),
        ({"inner_corner_radius": 39.0}, "inner_corner_radius: must be at most 38 mm"),
        ({"edge_radius": 13.0}, "edge_radius: the rounding reaches .* outer_corner_radius"),
        ({"edge_radius": 25.5, "outer_corner_radius": 25.0}, "edge_radius: .*flat bottom"),
    ],
)
def test_dimensions_that_do_not_fit_are_refused(fields, message):
    with pytest.raises(ValidationError, match=message):
        TStamp(**fields)


def test_tools_that_do_not_fit_each_other_are_refused():
    blank = (330.0, 330.0)
    with pytest.raises(InputError, match=r"die\.edge_radius: must be at most 5\.6"):
        build_tools(Stamp(), Die(clearance=13.0), None, DEPTH, THICKNESS, blank)
    stamp = Stamp(t=TStamp(draft_angle=18.0))
    with pytest.raises(InputError, match="draft_angle: widens the stamp by 19"):
        build_tools(stamp, Die(clearance=0.1, edge_radius=0.2), None, DEPTH, THICKNESS, blank)
    with pytest.raises(InputError, match="less than the blank"):
        build_tools(Stamp(kind="hemisphere", hemisphere=DomeStamp(radius=160.0)), Die(), None, 30.0, THICKNESS, blank)
    with pytest.raises(ValidationError, match="stl: missing"):
        Stamp(kind="stl")
