"""Tools from triangle surfaces: distance against the analytic one, refusals of bad surfaces."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from knittest.base.errors import InputError
from knittest.kernels.tool_shapes import tool_distance
from knittest.models.surface import read_surface, surface
from knittest.models.tool import Tool, tool_arrays

BOX = np.array([[x, y, z] for x in (0.0, 10.0) for y in (0.0, 8.0) for z in (0.0, 6.0)])


def hull(points: np.ndarray) -> np.ndarray:
    """Triangles of a convex surface, turning left seen from outside."""
    found = ConvexHull(points)
    middle = points.mean(axis=0)
    out = np.einsum("ij,ij->i", found.equations[:, :3], points[found.simplices[:, 0]] - middle) > 0.0
    corners = points[found.simplices]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    left = np.einsum("ij,ij->i", normal, found.equations[:, :3]) > 0.0
    return np.where((left == out)[:, None], found.simplices, found.simplices[:, ::-1])


def distances(tool: Tool, points: np.ndarray) -> np.ndarray:
    arrays = tool_arrays([tool])
    return np.array([tool_distance(0, arrays, *p) for p in points])


def sphere(n: int, radius: float = 10.0) -> np.ndarray:
    k = np.arange(n) + 0.5
    z, turn = 1.0 - 2.0 * k / n, np.pi * (1.0 + 5.0**0.5) * k
    return radius * np.column_stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z])


def test_a_box_is_exact_off_its_edges():
    tool = surface(BOX, hull(BOX), 0.5)
    found = distances(tool, np.array([[5.0, 4.0, 6.3], [5.0, 4.0, 5.7], [10.4, 4.0, 3.0], [5.1, -0.6, 3.2]]))
    assert found[:, 0] == pytest.approx([0.3, -0.3, 0.4, 0.6], abs=1e-9)
    assert found[0, 1:] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


def test_a_sphere_converges_with_its_triangles_and_grid():
    """Chords of n triangles lie within 2 pi R / n of the sphere; trilinear samples are of second order."""
    rng = np.random.default_rng(1)
    points = rng.normal(size=(60, 3))
    points *= (10.0 + rng.uniform(-0.6, 0.6, 60))[:, None] / np.linalg.norm(points, axis=1)[:, None]
    errors = []
    for n, spacing in ((300, 1.6), (1200, 0.8)):
        corners = sphere(n)
        found = distances(surface(corners, hull(corners), spacing), points)
        errors.append(np.abs(found[:, 0] - (np.linalg.norm(points, axis=1) - 10.0)).max())
    assert errors[1] < 0.08
    assert np.log2(errors[0] / errors[1]) > 1.5


def test_bad_surfaces_are_refused(tmp_path):
    triangles = hull(BOX)
    for bad, message in (
        ((BOX, triangles[1:]), "open"),
        ((BOX, triangles[:, ::-1]), "inverted"),
        ((BOX * [1.0, 1.0, 0.0], triangles), "no volume"),
        ((0.001 * BOX, triangles), "another unit"),
    ):
        with pytest.raises(InputError, match=message):
            surface(*bad, 0.5)
    path = tmp_path / "tool.stl"
    path.write_text("solid nothing\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"tool\.stl"):
        read_surface(path, 0.5)
