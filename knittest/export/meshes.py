"""Mesh files: VTU frames for ParaView, centre-lines and surfaces of yarns (VTU, CSV, STL, VTP), Abaqus input."""

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import replace_file, resource_error, write_atomic
from knittest.base.history import Array, Body, Frame, History, Mesh
from knittest.fabric.cell import Cell
from knittest.fabric.strip import YarnPath, centre_lines

Index = NDArray[np.int64]

#: kind of cells of the mesh: type of meshio, which knows only the number of corners, and of Abaqus
CELLS = {"beams": ("line", "B31"), "shells": ("quad", "S4R")}
#: file of the collection: time [ms], path, and tool, empty for the specimen
Entry = tuple[float, str, str]


def write_frames(run_folder: Path, history: History, bodies: Sequence[Body] = ()) -> Path:
    """Write ``frames/frame-0000.vtu``... and ``frames.pvd`` in ``run_folder``; return the path of the collection.

    Points are the nodes [mm], with ``displacement`` [mm] from the first frame and, for beams, ``radius`` [mm] for the
    tube filter of ParaView. Cells have all fields of the frame, ``part``, ``yarn`` and ``radius``; failed elements
    remain, with ``alive`` 0. Tools (``bodies``) are triangles in ``frames/<tool>-0000.vtu``..., a file for each
    position, and named blocks of the collection. Raises :class:`ResourceError`.
    """
    folder = run_folder / "frames"
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise resource_error(folder, error) from error
    entries: list[Entry] = []
    for number, frame in enumerate(history.frames):
        path = folder / f"frame-{number:04d}.vtu"
        _write_frame(path, history.mesh, frame, history.frames[0].position)
        entries.append((frame.time, path.relative_to(run_folder).as_posix(), ""))
    for body in bodies:
        entries += _write_body(folder, body, [frame.time for frame in history.frames])
    collection = run_folder / "frames.pvd"
    write_atomic(collection, _collection_text(entries, history.mesh))
    return collection


def _save(path: Path, form: str, points: Array, cells: Sequence[tuple[str, Index]], **more: Any) -> None:
    """Write a mesh with meshio, as compressed VTU or binary STL, whole or not at all."""
    import meshio

    how: dict[str, Any] = {"compression": "zlib"} if form == "vtu" else {"binary": True}
    with replace_file(path) as temporary:
        meshio.write(temporary, meshio.Mesh(points, cells, **more), file_format=form, **how)


def _write_frame(path: Path, mesh: Mesh, frame: Frame, reference: Array) -> None:
    """Write one VTU file; displacements are counted from ``reference`` [mm], (n_nodes, 3)."""
    points: dict[str, Any] = {"displacement": frame.position - reference}
    if mesh.kind == "beams":  # the radius of the thickest beam at each node
        points["radius"] = np.zeros(len(reference))
        for end in (0, 1):
            np.maximum.at(points["radius"], mesh.cells[:, end], mesh.radius)
    cells = {"part": mesh.part, "yarn": mesh.yarn, "radius": mesh.radius, **frame.fields}
    data = {name: [np.asarray(values)] for name, values in cells.items()}
    _save(path, "vtu", frame.position, [(CELLS[mesh.kind][0], mesh.cells)], point_data=points, cell_data=data)


def _write_body(folder: Path, body: Body, times: Sequence[float]) -> list[Entry]:
    """Write ``body`` at each of ``times`` [ms] into ``folder``, once as long as it does not move."""
    entries: list[Entry] = []
    for number, time in enumerate(times):
        place = body.place(number)
        if number == 0 or (place != body.place(number - 1)).any():
            path = folder / f"{body.name.replace(' ', '-')}-{number:04d}.vtu"
            _save(path, "vtu", place, [("triangle", body.triangles)])
        entries.append((time, path.relative_to(folder.parent).as_posix(), body.name))
    return entries


def _collection_text(entries: list[Entry], mesh: Mesh) -> str:
    parts = ", ".join(f"{number} {name}" for number, name in enumerate(mesh.part_names))
    parts = re.sub("-+", "-", parts)  # two in a row may not stand in a comment
    rows = "".join(
        f'    <DataSet timestep="{time:.9g}"{f" name={quoteattr(tool)}" if tool else ""} file={quoteattr(path)}/>\n'
        for time, path, tool in entries
    )
    return (
        '<?xml version="1.0"?>\n'
        f"<!-- time in ms, lengths in mm, forces in N; part: {escape(parts)} -->\n"
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}  </Collection>\n</VTKFile>\n"
    )


LINE_FORMATS = (".vtu", ".csv")


def export_centre_lines(path: Path, cell: Cell, n_wales: int, n_courses: int) -> None:
    """Write the yarns of ``n_wales`` x ``n_courses`` cells in the format of the file's suffix.

    Raises :class:`InputError` for another suffix and :class:`ResourceError` if the file cannot be written.
    """
    if path.suffix.lower() not in LINE_FORMATS:
        raise InputError(f"{path}: unknown format; expected the suffix {' or '.join(LINE_FORMATS)}")
    paths = centre_lines(cell, n_wales, n_courses)
    if path.suffix.lower() == ".csv":
        rows = [
            f"{yarn.system},{yarn.index + 1},{number},{x:.6f},{y:.6f},{z:.6f}\n"
            for yarn in paths
            for number, (x, y, z) in enumerate(yarn.points, 1)
        ]
        write_atomic(path, "".join(["system,yarn,point,x_mm,y_mm,z_mm\n", *rows]))
    else:
        _write_vtu(path, paths, cell.spec.radius)


def _write_vtu(path: Path, paths: list[YarnPath], radius: dict[str, float]) -> None:
    """Write a line cell per segment; ``part`` is 0 for the loops and counts the layers of inlays from 1, back to face;
    ``yarn`` counts from 1, ``radius`` in mm.
    """
    systems = list(radius)
    counts = np.array([len(p.points) for p in paths])
    starts = np.cumsum(counts) - counts
    first = np.delete(np.arange(counts.sum()), starts[1:] - 1)[:-1]  # every point but the last of each yarn
    fields: dict[str, Any] = {
        "part": [np.repeat([systems.index(p.system) for p in paths], counts - 1)],
        "yarn": [np.repeat([p.index + 1 for p in paths], counts - 1)],
    }
    points = np.vstack([p.points for p in paths])
    at_points = {"radius": np.repeat([radius[p.system] for p in paths], counts)}
    lines = [("line", np.column_stack([first, first + 1]))]
    _save(path, "vtu", points, lines, point_data=at_points, cell_data=fields)


#: formats, and default corners of a tube's section
SURFACE_FORMATS, SIDES = (".stl", ".vtp"), 12


@dataclass(frozen=True)
class TubeSurface:
    """Surface of ``points`` (n, 3) [mm] and ``triangles`` (m, 3) of ``element`` (m,), which turn left from outside."""

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
        raise InputError("tubes: all beams have failed in this frame; choose an earlier one with --frame")
    follows = (cells[shown[1:], 0] == cells[shown[:-1], 1]) & (radius[shown[1:]] == radius[shown[:-1]])
    chains = np.split(shown, np.flatnonzero(~follows) + 1)
    points, triangles, element, first = [], [], [], 0
    for chain in chains:
        nodes = np.append(cells[chain, 0], cells[chain[-1], 1])
        points.append(_tube_points(position[nodes], float(radius[chain[0]]), sides))
        triangles.append(first + _tube_triangles(len(nodes), sides))
        element.append(np.concatenate([np.repeat(chain, 2 * sides), np.repeat(chain[[0, -1]], sides)]))
        first += len(points[-1])
    return TubeSurface(np.concatenate(points), np.concatenate(triangles), np.concatenate(element))


def _tube_points(path: Array, radius: float, sides: int) -> Array:
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


def _tube_triangles(rings: int, sides: int) -> Index:
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
    if form not in SURFACE_FORMATS:
        raise InputError(f"{path}: unknown format; expected the suffix {' or '.join(SURFACE_FORMATS)}")
    if form == ".vtp":
        write_atomic(path, _vtp_text(surface, fields))
    else:
        _save(path, "stl", surface.points, [("triangle", surface.triangles)])


def _vtp_text(surface: TubeSurface, fields: Mapping[str, Array]) -> str:
    """Return poly data of VTK; only VTK itself has a writer for it."""
    n, m = len(surface.points), len(surface.triangles)
    cells = "".join(
        _data_array("Float32", values[surface.element].astype("<f4"), f' Name="{name}"')
        for name, values in fields.items()
    )
    points = _data_array("Float32", surface.points.astype("<f4"), ' NumberOfComponents="3"')
    polys = _data_array("Int32", surface.triangles.astype("<i4"), ' Name="connectivity"')
    polys += _data_array("Int32", 3 * np.arange(1, m + 1, dtype="<i4"), ' Name="offsets"')
    return (
        '<?xml version="1.0"?>\n<!-- lengths in mm, forces in N -->\n'
        '<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">\n<PolyData>\n'
        f'<Piece NumberOfPoints="{n}" NumberOfVerts="0" NumberOfLines="0" NumberOfStrips="0" NumberOfPolys="{m}">\n'
        f"<CellData>\n{cells}</CellData>\n<Points>\n{points}</Points>\n<Polys>\n{polys}</Polys>\n"
        "</Piece>\n</PolyData>\n</VTKFile>\n"
    )


def _data_array(kind: str, values: NDArray[np.generic], named: str) -> str:
    raw = np.ascontiguousarray(values).tobytes()
    data = base64.b64encode(len(raw).to_bytes(4, "little") + raw).decode("ascii")
    return f'<DataArray type="{kind}"{named} format="binary">{data}</DataArray>\n'


def write_abaqus(path: Path, mesh: Mesh, position: Array) -> None:
    """Write ``mesh`` with nodes at ``position`` [mm], (n, 3), and a set of elements for each of its parts.

    Raises :class:`ResourceError`.
    """
    import meshio
    from meshio.abaqus._abaqus import meshio_to_abaqus_type

    shape, wanted = CELLS[mesh.kind]
    sets = {name: [np.flatnonzero(mesh.part == part)] for part, name in enumerate(mesh.part_names)}
    content = meshio.Mesh(position, [(shape, mesh.cells)], cell_sets=sets)
    with replace_file(path) as temporary:
        meshio.write(temporary, content, file_format="abaqus")
        written = temporary.read_text(encoding="utf-8")
        typed = written.replace(f"TYPE={meshio_to_abaqus_type[shape]}\n", f"TYPE={wanted}\n")
        temporary.write_text(typed, encoding="utf-8")
