"""STL files that are too large, that two of which run through each other, and that are none."""

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.files import EXCERPT, excerpt
from knittest.config.loading import resolve
from knittest.laboratory.forming.tool_check import fitting_tools
from knittest.models import surface
from knittest.models.surface import MOST_TRIANGLES, TriangleMesh, read_stl

CORNERS = np.array([[[-150.0, -100.0, 0.0], [150.0, -100.0, 0.0], [0.0, 160.0, 0.0]]])


def write(path, corners):
    """Binary STL of ``corners`` (n, 3, 3)."""
    record = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    record["corners"] = corners
    path.write_bytes(b" " * 80 + np.uint32(len(corners)).tobytes() + record.tobytes())
    return path


def sparse(path, triangles: int):
    """A binary file of a given number of ``triangles`` that takes no room on the disk."""
    path.write_bytes(b" " * 80 + np.uint32(triangles).tobytes())
    with path.open("rb+") as stream:
        stream.truncate(84 + 50 * triangles)
    return path


def test_too_many_triangles_are_counted_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr("meshio.read", lambda *a, **k: pytest.fail("read in full"))
    counted = f"{MOST_TRIANGLES + 1:,} triangles; "
    for many, said in ((MOST_TRIANGLES + 1, counted), (60_000_000, "larger than 500 MB: ")):
        with pytest.raises(InputError, match=f"{said}expected at most 1,000,000"):
            read_stl(sparse(tmp_path / "large.stl", many))


def test_as_many_as_allowed_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(surface, "MOST_TRIANGLES", 2)
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    for count in (1, 2, 3):
        (tmp_path / "a.stl").write_text(f"solid s\n{facet * count}endsolid s\n")
        for path in (tmp_path / "a.stl", write(tmp_path / "b.stl", np.repeat(CORNERS, count, axis=0))):
            if count <= 2:
                assert len(read_stl(path).triangles) == count
            else:
                with pytest.raises(InputError, match="3 triangles; expected at most 2"):
                    read_stl(path)


@pytest.mark.parametrize(
    "content",
    [
        b"solid \x1b[31m\nfacet normal \x1b]0;title\x07" + b"secret " * 5000,
        b"solid\n" + b"outer\nvertex a b c\nsecond line\n" * 300,
        bytes(range(256)) * 40,
    ],
)
def test_a_message_carries_a_line_of_a_bad_file_at_most(tmp_path, content):
    path = tmp_path / "bad.stl"
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        read_stl(path)
    text = str(refused.value)
    assert text.isprintable() and len(text) < len(str(path)) + EXCERPT + 60


def test_an_excerpt_is_one_printable_line_of_bounded_length():
    assert excerpt("one\ntwo") == "one" and excerpt("") == "" and excerpt("a\x1b[0m") == "a?[0m"
    assert len(excerpt("x" * EXCERPT)) == EXCERPT == len(excerpt("x" * 10_000))
    assert excerpt("x" * 10_000).endswith("x...")


@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_two_flat_triangles_run_into_each_other(tmp_path, monkeypatch, turned):
    """No corner of either lies in the other: at full depth they cross in the middle, 38.5 mm deep."""
    other = (CORNERS * [1.0, turned, 1.0])[:, :: int(turned)]
    monkeypatch.chdir(tmp_path)
    stamp, die = write(tmp_path / "stamp.stl", CORNERS), write(tmp_path / "die.stl", other)
    named = {"stamp.kind": "stl", "stamp.stl.path": stamp.name, "die.stl.path": die.name, "holder.stl.path": die.name}
    spacing = [f"rig.{tool}.stl.spacing=5" for tool in ("stamp", "die", "holder")]
    sets = [*(f"rig.{name}={value}" for name, value in named.items()), *spacing]
    run = resolve(variant="1", scale="macro", test="forming", preset="quick", sets=sets)
    with pytest.raises(InputError, match=r"stamp and die is negative, they overlap by 3\d\.?\d* mm"):
        fitting_tools(run, 1.5)


def test_points_are_spread_all_over_a_surface():
    mesh = TriangleMesh.from_corners([CORNERS])
    points = mesh.spread(10.0)
    inside = np.random.default_rng(1).dirichlet(np.ones(3), 200) @ CORNERS[0]
    apart = np.linalg.norm(inside[:, None] - points[None], axis=2).min(axis=1)
    assert apart.max() < 10.0  # the centre of a small triangle is the farthest
    assert len(points) < 1000
    cross = np.cross(CORNERS[0, 1] - CORNERS[0, 0], points - CORNERS[0, 0])
    assert np.abs(points[:, 2]).max() == 0.0 and (cross[:, 2] >= -1e-9).all()  # on it, on the inner side of an edge
    for a, b in (CORNERS[0, [0, 1]], CORNERS[0, [1, 2]], CORNERS[0, [2, 0]]):
        on_edge = [point for point in points if abs(np.cross(b - a, point - a)[2]) < 1e-6]
        assert len(on_edge) > np.linalg.norm(b - a) / 10.0  # each of the three, not only the corners
    assert len(mesh.spread(1e-6)) < 2_100_000
    assert len(mesh.spread(1e6)) == 3
