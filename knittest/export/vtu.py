"""VTU frames and their .pvd collection, for ParaView."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from knittest.base.atomic import replacing, resource_error, write_atomic
from knittest.base.history import Array, Body, Frame, History, Mesh

_CELL_TYPE = {"beams": "line", "shells": "quad"}


#: file of the collection at a time [ms]: its path, and the tool it shows, empty for the specimen
Entry = tuple[float, str, str]


def write_frames(run_folder: Path, history: History, bodies: Sequence[Body] = ()) -> Path:
    """Write ``frames/frame-0000.vtu``... and ``frames.pvd`` in ``run_folder``; return the path of the collection.

    Points are the nodes at the frame's time [mm], with ``displacement`` [mm] from the first frame and, for beams,
    ``radius`` [mm] (ParaView's tube filter varies its radius by a point field). Cells carry every field of
    the frame, ``part``, ``yarn`` and ``radius``; failed elements stay, with ``alive`` 0, to be thresholded. Tools
    (``bodies``) are triangles in ``frames/<tool>-0000.vtu``..., a file wherever they have moved, and blocks of the
    collection by name. Raises :class:`ResourceError`.
    """
    folder = run_folder / "frames"
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise resource_error(folder, error) from error
    entries: list[Entry] = []
    for number, frame in enumerate(history.frames):
        path = folder / f"frame-{number:04d}.vtu"
        write_frame(path, history.mesh, frame, history.frames[0].position)
        entries.append((frame.time, path.relative_to(run_folder).as_posix(), ""))
    for body in bodies:
        entries += _write_body(folder, body, [frame.time for frame in history.frames])
    collection = run_folder / "frames.pvd"
    write_atomic(collection, _collection(entries, history.mesh))
    return collection


def write_frame(path: Path, mesh: Mesh, frame: Frame, reference: Array) -> None:
    """Write one compressed VTU file; ``reference`` [mm], (n_nodes, 3), is where displacements are counted from."""
    import meshio

    points: dict[str, Any] = {"displacement": frame.position - reference}
    if mesh.kind == "beams":
        points["radius"] = _nodal_radius(mesh, len(reference))
    cells = {"part": mesh.part, "yarn": mesh.yarn, "radius": mesh.radius, **frame.fields}
    unstructured = meshio.Mesh(
        frame.position,
        [(_CELL_TYPE[mesh.kind], mesh.cells)],
        point_data=points,
        cell_data={name: [np.asarray(values)] for name, values in cells.items()},
    )
    with replacing(path) as temporary:
        meshio.write(temporary, unstructured, file_format="vtu", compression="zlib")


def _write_body(folder: Path, body: Body, times: Sequence[float]) -> list[Entry]:
    """Write ``body`` at each of ``times`` [ms] into ``folder``, once while it stays where it is."""
    import meshio

    entries: list[Entry] = []
    for number, time in enumerate(times):
        place = body.place(number)
        if number == 0 or (place != body.place(number - 1)).any():
            path = folder / f"{body.name.replace(' ', '-')}-{number:04d}.vtu"
            surface = meshio.Mesh(place, [("triangle", body.triangles)])
            with replacing(path) as temporary:
                meshio.write(temporary, surface, file_format="vtu", compression="zlib")
        entries.append((time, path.relative_to(folder.parent).as_posix(), body.name))
    return entries


def _nodal_radius(mesh: Mesh, n_nodes: int) -> Array:
    """Radius of the thickest beam at each node [mm], (n_nodes,)."""
    radius = np.zeros(n_nodes)
    for end in (0, 1):
        np.maximum.at(radius, mesh.cells[:, end], mesh.radius)
    return radius


def _collection(entries: list[Entry], mesh: Mesh) -> str:
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
