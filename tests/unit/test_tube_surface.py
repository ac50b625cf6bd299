"""Yarns as closed surfaces: volume of their prisms, closed ends, breaks, files that others read."""

import base64
import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.export.meshes import tube_surface, write_tubes

SIDES = 16
ARC = np.linspace(0.0, np.pi, 41)
BENT = np.column_stack([10.0 * np.cos(ARC), 10.0 * np.sin(ARC), np.zeros(41)])
ASIDE = np.array([30.0, 0.0, 0.0])
STRAIGHT = np.column_stack([np.zeros(6), np.linspace(0.0, 5.0, 6), np.full(6, 2.0)])


def _beams(*paths):
    """Positions and beams of ``paths``, one after the other."""
    first, cells = 0, []
    for path in paths:
        cells.append(first + np.column_stack([np.arange(len(path) - 1), np.arange(1, len(path))]))
        first += len(path)
    return np.concatenate(paths), np.concatenate(cells)


def _volume(points, triangles):
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _made(*paths, radius=0.5, dead=()):
    position, cells = _beams(*paths)
    alive = np.ones(len(cells), bool)
    alive[list(dead)] = False
    return tube_surface(position, cells, np.full(len(cells), radius), alive, SIDES)


def _closed(triangles):
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forth = {tuple(e) for e in edges.tolist()}
    return len(forth) == len(edges) and all((b, a) in forth for a, b in forth)


AREA = 0.5 * SIDES * 0.5**2 * np.sin(2.0 * np.pi / SIDES)


def test_a_straight_yarn_is_a_closed_prism():
    made = _made(STRAIGHT)
    assert _closed(made.triangles) and _volume(made.points, made.triangles) == pytest.approx(5.0 * AREA)
    assert np.linalg.norm(made.points[:SIDES] - STRAIGHT[0], axis=1) == pytest.approx(np.full(SIDES, 0.5))


def test_a_bent_yarn_is_closed_and_not_wrung():
    """By Pappus' rule its volume is that of its section along its axis, here a polygon's."""
    made = _made(BENT)
    length = float(np.linalg.norm(np.diff(BENT, axis=0), axis=1).sum())
    assert _closed(made.triangles) and _volume(made.points, made.triangles) == pytest.approx(length * AREA, rel=2e-3)
    rings = made.points[: 41 * SIDES].reshape(41, SIDES, 3) - BENT[:, None]
    outwards = np.column_stack([np.cos(ARC), np.sin(ARC), 0.0 * ARC])
    turned = np.einsum("ksd,kd->ks", rings, outwards)
    assert np.abs(turned - turned[0]).max() < 1e-3  # its ends look along their beams, not the arc


def test_sections_of_a_loop_in_space_stand_across_it():
    turn = np.linspace(0.0, 9.0, 60)
    helix = np.column_stack([3.0 * np.cos(turn), 3.0 * np.sin(turn), 0.8 * turn])
    made = _made(helix)
    rings = made.points[: 60 * SIDES].reshape(60, SIDES, 3) - helix[:, None]
    along = np.diff(helix, axis=0) / np.linalg.norm(np.diff(helix, axis=0), axis=1)[:, None]
    assert np.linalg.norm(rings, axis=2) == pytest.approx(np.full((60, SIDES), 0.5))
    assert np.abs(np.einsum("ksd,kd->ks", rings[1:-1], along[1:] + along[:-1])).max() < 1e-12


def test_two_yarns_and_a_break_are_tubes_of_their_own():
    made = _made(STRAIGHT, BENT + ASIDE, dead=[2])
    assert _closed(made.triangles)
    assert set(made.element.tolist()) == set(range(45)) - {2}
    whole = _made(STRAIGHT, BENT + ASIDE)
    gone = _volume(whole.points, whole.triangles) - _volume(made.points, made.triangles)
    assert gone == pytest.approx(1.0 * AREA) and len(made.points) == len(whole.points) + 2


def test_nothing_whole_and_another_suffix_are_refused(tmp_path):
    with pytest.raises(InputError, match="all beams have failed"):
        _made(STRAIGHT, dead=range(5))
    with pytest.raises(InputError, match=r"expected the suffix .stl or .vtp"):
        write_tubes(tmp_path / "a.obj", _made(STRAIGHT), {})


def test_an_stl_is_read_back(tmp_path):
    made = _made(STRAIGHT, BENT)
    write_tubes(tmp_path / "a.stl", made, {})
    read = meshio.read(tmp_path / "a.stl", file_format="stl")
    volume = _volume(made.points, made.triangles)
    assert _volume(read.points, read.cells_dict["triangle"]) == pytest.approx(volume, rel=1e-5)


def test_a_vtp_holds_the_surface_and_the_fields_of_its_beams(tmp_path):
    made = _made(STRAIGHT, BENT)
    force = np.arange(45.0)
    write_tubes(tmp_path / "a.vtp", made, {"axial_force": force})
    piece = ET.fromstring((tmp_path / "a.vtp").read_text()).find("PolyData/Piece")
    kinds = {"Float32": "<f4", "Int32": "<i4"}

    def values(array):
        raw = base64.b64decode(array.text)
        assert int.from_bytes(raw[:4], "little") == len(raw) - 4
        return np.frombuffer(raw[4:], kinds[array.get("type")])

    (points,), (triangles, ends) = piece.findall("Points/DataArray"), piece.findall("Polys/DataArray")
    assert np.allclose(values(points).reshape(-1, 3), made.points, atol=1e-5)
    assert np.array_equal(values(triangles).reshape(-1, 3), made.triangles)
    assert values(ends)[-1] == 3 * len(made.triangles) and piece.get("NumberOfPolys") == str(len(made.triangles))
    (field,) = piece.findall("CellData/DataArray")
    assert field.get("Name") == "axial_force" and np.array_equal(values(field), force[made.element])
