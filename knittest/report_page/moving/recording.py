"""Frames of a run folder, read back: what moves, where it is at each time, and what its elements carry."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.history import Body
from knittest.base.reading import read_regular

Array = NDArray[np.float64]
Index = NDArray[np.int64]

COLLECTION = "frames.pvd"
MAX_COLLECTION, MAX_FRAME = 5_000_000, 2_000_000_000
#: what says which elements there are, not what they carry
FIXED = ("part", "yarn", "radius")
KINDS = {"line": "beams", "quad": "shells"}
#: difference of two places that is rounding [mm]
SHIFTED = 1e-6


@dataclass(frozen=True)
class Recording:
    """Frames of a run: ``kind`` beams or shells of ``cells`` (m, 2 or 4), their ``part`` (m,) in ``part_names`` and
    ``radius`` (m,) [mm]; at the times ``time`` (k,) [ms] the ``position`` (k, n, 3) [mm] of the nodes and ``fields``
    (k, m) of the elements by name; ``bodies`` are the tools.
    """

    kind: str
    cells: Index
    part: Index
    part_names: tuple[str, ...]
    radius: Array
    time: Array
    position: Array
    fields: dict[str, Array]
    bodies: tuple[Body, ...] = ()

    def thinned(self, most: int) -> "Recording":
        """The same with ``most`` frames at most, evenly spaced by number, the first and the last among them."""
        if len(self.time) <= most:
            return self
        kept = np.unique(np.round(np.linspace(0, len(self.time) - 1, most)).astype(int))
        fields = {name: values[kept] for name, values in self.fields.items()}
        bodies = tuple(body.at_frames(kept) for body in self.bodies)
        return replace(self, time=self.time[kept], position=self.position[kept], fields=fields, bodies=bodies)

    def around(self, time: float) -> tuple[int, int, float]:
        """Number of the frame before a ``time`` [ms] and of the one after it, and the share of the way between them."""
        before = int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, max(len(self.time) - 2, 0)))
        after = min(before + 1, len(self.time) - 1)
        span = float(self.time[after] - self.time[before])
        return before, after, (time - float(self.time[before])) / span if span > 0.0 else 0.0

    def bodies_at(self, time: float) -> list[Body]:
        """The ``bodies`` at one ``time`` [ms], by the line between the frames."""
        return [body.between(*self.around(time)) for body in self.bodies]


@dataclass(frozen=True)
class Entry:
    """A file of the collection: its time [ms], its path and the tool it shows, empty for the specimen."""

    time: float
    path: Path
    tool: str


def read_recording(folder: Path) -> Recording:
    """Read the frames of the run folder ``folder``; raises :class:`InputError` where there are none or they differ."""
    collection = folder / COLLECTION
    if not collection.exists():
        raise InputError(
            f"{folder}: has no frames ({COLLECTION} is not there): run the test again without --no-frames "
            "(in a sweep: keep: frames), or go on with a stopped run by knittest resume"
        )
    text = read_regular(collection, MAX_COLLECTION, "a run writes less")
    entries = _entries(collection, text)
    specimen = [entry for entry in entries if not entry.tool]
    if not specimen:
        raise InputError(f"{collection}: names no frames: run the test again without --no-frames")
    time = np.array([entry.time for entry in specimen])
    if np.any(np.diff(time) < 0.0):
        raise InputError(f"{collection}: times of the frames go back; expected them in order")
    meshes = [_mesh(entry.path) for entry in specimen]
    recording = _recording(meshes, [entry.path for entry in specimen], time, _part_names(text))
    return replace(recording, bodies=_bodies([entry for entry in entries if entry.tool], time))


def _entries(collection: Path, text: bytes) -> list[Entry]:
    """Files that the ``collection`` names, all of them in its folder."""
    try:
        rows = ET.fromstring(text).iter("DataSet")
        found = [(float(row.attrib["timestep"]), row.attrib["file"], row.get("name", "")) for row in rows]
    except (ET.ParseError, KeyError, ValueError) as error:
        raise InputError(f"{collection}: cannot be read: {error}; run the test again") from None
    for _, name, _ in found:
        if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts or "\\" in name:
            raise InputError(f"{collection}: names {name!r}: expected a file in the run folder")
    return [Entry(time, collection.parent / name, tool) for time, name, tool in found]


def _part_names(text: bytes) -> tuple[str, ...]:
    """Names of the parts as the comment of the collection states them: ``part: 0 warp, 1 weft``."""
    _, found, rest = text.decode("utf-8", errors="replace").partition("part: ")
    if not found:
        return ()
    return tuple(entry.strip().partition(" ")[2] for entry in rest.partition(" -->")[0].split(","))


def _mesh(path: Path) -> Any:
    """A frame as :mod:`meshio` reads it."""
    import meshio

    if not path.is_file():
        raise InputError(f"{path}: no such file, but {COLLECTION} names it; run the test again")
    if path.stat().st_size > MAX_FRAME:
        raise InputError(f"{path}: larger than {MAX_FRAME // 1_000_000} MB: a run writes less")
    try:
        mesh = meshio.vtu.read(path)  # meshio.read ends the process where it cannot read
    except Exception as error:  # whatever the reader meets in a damaged file
        raise InputError(f"{path}: cannot be read as VTU ({error}); run the test again") from None
    if len(mesh.cells) != 1 or not np.isfinite(mesh.points).all():
        raise InputError(f"{path}: expected elements of one kind and finite positions; run the test again")
    return mesh


def _recording(meshes: Sequence[Any], paths: Sequence[Path], time: Array, part_names: tuple[str, ...]) -> Recording:
    """The ``meshes`` of one specimen put together."""
    first = meshes[0]
    cells = first.cells[0].data
    kind = KINDS.get(first.cells[0].type, "")
    if not kind or any(name not in first.cell_data for name in FIXED):
        raise InputError(f"{paths[0]}: not a frame of knittest: expected beams or shells with {', '.join(FIXED)}")
    for mesh, path in zip(meshes, paths, strict=True):
        same = mesh.points.shape == first.points.shape and np.array_equal(mesh.cells[0].data, cells)
        if not same or mesh.cell_data.keys() != first.cell_data.keys():
            raise InputError(f"{path}: has other nodes, elements or fields than {paths[0].name}; run the test again")
    names = [name for name in first.cell_data if name not in FIXED]
    fields = {name: np.array([mesh.cell_data[name][0] for mesh in meshes], float) for name in names}
    part, radius = (np.asarray(first.cell_data[name][0]) for name in ("part", "radius"))
    part_names = part_names if len(part_names) > part.max() else tuple(f"part {k}" for k in range(part.max() + 1))
    used, numbers = np.unique(cells, return_inverse=True)  # a cell has nodes of its images too
    position = np.array([mesh.points[used] for mesh in meshes], float)
    return Recording(
        kind,
        numbers.reshape(cells.shape),
        part.astype(np.int64),
        part_names,
        radius.astype(float),
        time,
        position,
        fields,
    )


def _bodies(entries: Sequence[Entry], time: Array) -> tuple[Body, ...]:
    """Tools, each of which has a file at every time and keeps its shape."""
    found = []
    for name in dict.fromkeys(entry.tool for entry in entries):
        own = [entry for entry in entries if entry.tool == name]
        if not np.array_equal([entry.time for entry in own], time):
            raise InputError(f"{own[0].path}: tool {name!r} is not there at every time; run the test again")
        meshes = [_mesh(entry.path) for entry in own]
        points, triangles = meshes[0].points, meshes[0].cells[0].data
        if meshes[0].cells[0].type != "triangle" or any(mesh.points.shape != points.shape for mesh in meshes):
            raise InputError(f"{own[0].path}: tool {name!r}: expected triangles, as many at every time")
        try:
            offset, turn = _motion(np.asarray(points, float), [np.asarray(mesh.points, float) for mesh in meshes])
        except ValueError:
            raise InputError(f"{own[0].path}: tool {name!r} changes its shape; run the test again") from None
        found.append(Body(name, np.asarray(points, float), triangles, offset, turn))
    return tuple(found)


def _motion(points: Array, places: Sequence[Array]) -> tuple[Array, Array | None]:
    """Offsets (k, 3) and matrices (k, 3, 3) that take ``points`` (n, 3) to each of ``places``; none for one that never
    turns. Raises :class:`ValueError` where no such matrix does.
    """
    offset = np.array([place[0] - points[0] for place in places])
    if all(np.allclose(place, points + o, rtol=0.0, atol=SHIFTED) for place, o in zip(places, offset, strict=True)):
        return offset, None
    known = np.column_stack([points, np.ones(len(points))])
    solved = [np.linalg.lstsq(known, place, rcond=None)[0] for place in places]
    if not all(np.allclose(known @ s, p, rtol=0.0, atol=SHIFTED) for s, p in zip(solved, places, strict=True)):
        raise ValueError("no rigid motion")
    return np.array([s[3] for s in solved]), np.array([s[:3].T for s in solved])
