"""Yarns as closed surfaces of triangles: STL for printers and CAD, VTP with forces for ParaView."""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import replacing, write_atomic
from knittest.base.errors import InputError
from knittest.base.history import Array

Index = NDArray[np.int64]

#: formats, and corners of a tube's section where none are asked for
FORMATS, SIDES = (".stl", ".vtp"), 12


@dataclass(frozen=True)
class TubeSurface:
    """``points`` (n, 3) [mm] and ``triangles`` (m, 3), which turn left seen from outside, of ``element`` (m,)."""

    points: Array
    triangles: Index
    element: Index


def tube_surface(position: Array, cells: Index, radius: Array, alive: NDArray[np.bool_], sides: int) -> TubeSurface:
    """Tubes about the beams ``cells`` (n_el, 2) between nodes at ``position`` [mm], (n, 3), of ``radius`` [mm],
    (n_el,), as prisms of ``sides`` joined where a beam follows another, and closed at their ends.

    A yarn ends where a beam is not ``alive`` (n_el,). Raises :class:`InputError` where no beam is.
    """
    shown = np.flatnonzero(alive & np.isfinite(position[cells]).all(axis=(1, 2)))
    if not len(shown):
        raise InputError("tubes: no beam is whole: choose an earlier frame with --frame")
    follows = (cells[shown[1:], 0] == cells[shown[:-1], 1]) & (radius[shown[1:]] == radius[shown[:-1]])
    chains = np.split(shown, np.flatnonzero(~follows) + 1)
    points, triangles, element, first = [], [], [], 0
    for chain in chains:
        nodes = np.append(cells[chain, 0], cells[chain[-1], 1])
        points.append(_rings(position[nodes], float(radius[chain[0]]), sides))
        triangles.append(first + _walls(len(nodes), sides))
        element.append(np.concatenate([np.repeat(chain, 2 * sides), np.repeat(chain[[0, -1]], sides)]))
        first += len(points[-1])
    return TubeSurface(np.concatenate(points), np.concatenate(triangles), np.concatenate(element))


def _rings(path: Array, radius: float, sides: int) -> Array:
    """Corners of a section at each point of ``path`` (n, 3), turned with it and not about it, then both end points."""
    along = np.diff(path, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-30)
    tangent = np.concatenate([along[:1], along[1:] + along[:-1], along[-1:]])
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-30)
    normal = np.zeros_like(path)
    normal[0] = np.eye(3)[np.argmin(np.abs(tangent[0]))]
    for k in range(len(path)):
        before = normal[max(k - 1, 0)]
        normal[k] = before - (before @ tangent[k]) * tangent[k]
        normal[k] /= np.linalg.norm(normal[k])
    angle = 2.0 * np.pi * np.arange(sides) / sides
    binormal = np.cross(tangent, normal)
    around = np.cos(angle)[:, None] * normal[:, None] + np.sin(angle)[:, None] * binormal[:, None]
    return np.concatenate([(path[:, None] + radius * around).reshape(-1, 3), path[[0, -1]]])


def _walls(rings: int, sides: int) -> Index:
    """Triangles of ``rings`` of ``sides`` corners, ring by ring, then those of the first and of the last end."""
    corner = np.arange(sides)
    turned = np.roll(corner, -1)
    start = sides * np.arange(rings - 1)[:, None]
    low, high = np.stack([start + corner, start + turned]), np.stack([start + corner, start + turned]) + sides
    wall = np.stack([low[0], low[1], high[1], low[0], high[1], high[0]], axis=-1).reshape(-1, 3)
    middle, last = rings * sides, sides * (rings - 1)
    head = np.column_stack([turned, corner, np.full(sides, middle)])
    tail = np.column_stack([last + corner, last + turned, np.full(sides, middle + 1)])
    return np.concatenate([wall, head, tail])


def write_tubes(path: Path, surface: TubeSurface, fields: Mapping[str, Array]) -> None:
    """Write ``surface`` in the format of the file's suffix, a VTP with ``fields`` (n_el,) of the beams.

    Raises :class:`InputError` for another suffix, :class:`ResourceError` if the file cannot be written.
    """
    form = path.suffix.lower()
    if form not in FORMATS:
        raise InputError(f"{path}: cannot tell the format from the suffix: expected {' or '.join(FORMATS)}")
    if form == ".vtp":
        write_atomic(path, _vtp(surface, fields))
        return
    import meshio

    with replacing(path) as temporary:
        mesh = meshio.Mesh(surface.points, [("triangle", surface.triangles)])
        meshio.write(temporary, mesh, file_format="stl", binary=True)


def _vtp(surface: TubeSurface, fields: Mapping[str, Array]) -> str:
    """Poly data of VTK, of which no library without VTK itself writes any."""
    n, m = len(surface.points), len(surface.triangles)
    cells = "".join(
        _array("Float32", values[surface.element].astype("<f4"), f' Name="{name}"') for name, values in fields.items()
    )
    points = _array("Float32", surface.points.astype("<f4"), ' NumberOfComponents="3"')
    polys = _array("Int32", surface.triangles.astype("<i4"), ' Name="connectivity"')
    polys += _array("Int32", 3 * np.arange(1, m + 1, dtype="<i4"), ' Name="offsets"')
    return (
        '<?xml version="1.0"?>\n<!-- lengths in mm, forces in N -->\n'
        '<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">\n<PolyData>\n'
        f'<Piece NumberOfPoints="{n}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{m}">\n'
        f"<CellData>\n{cells}</CellData>\n<Points>\n{points}</Points>\n<Polys>\n{polys}</Polys>\n"
        "</Piece>\n</PolyData>\n</VTKFile>\n"
    )


def _array(kind: str, values: NDArray[np.generic], named: str) -> str:
    raw = np.ascontiguousarray(values).tobytes()
    data = base64.b64encode(len(raw).to_bytes(4, "little") + raw).decode("ascii")
    return f'<DataArray type="{kind}"{named} format="binary">{data}</DataArray>\n'
