"""Frames of a run folder, read back: what moves, what its elements carry, colours of a field, tools in images of a
film.
"""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import read_regular
from knittest.base.history import Body
from knittest.export.shading import View, nearest

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


#: colour of tools, share of what lies behind them that they hide, and of their edges
COLOUR, OPAQUE, EDGE = np.array([0.55, 0.6, 0.66]), 0.34, 0.7
#: step of the light from a pixel to the next one at which an edge is drawn
STEP = 0.06


class ToolLayers:
    """``bodies`` as seen along the rows ``sight`` (3, 3) on the pixels of ``view``, which has room for their ways.

    Each is drawn once and moved by whole pixels, unless it turns.
    """

    def __init__(self, bodies: Sequence[Body], sight: Array, view: View) -> None:
        self._sight, self._view = sight, view
        self._start = [body.offset[0] for body in bodies]
        self._layers = [_layer(body.place(0) @ sight.T, body.triangles, view) for body in bodies]

    @property
    def any(self) -> bool:
        """Tell whether there are tools."""
        return bool(self._layers)

    def around(self, height: Array, moved: Sequence[Body]) -> tuple[Array, Array]:
        """Images RGBA (rows, columns, 4) of what lies behind and before a specimen of ``height`` (rows, columns) [mm],
        tools as ``moved``, each at one moment; empty ones without tools.
        """
        if not self._layers:
            return np.zeros((0, 0, 4)), np.zeros((0, 0, 4))
        found = [self._moved(k, body) for k, body in enumerate(moved)]
        found.sort(key=lambda layer: float(layer[0].max()))
        behind = [(image, top <= height) for top, image in found]
        return _blended(behind), _blended([(image, ~under) for image, under in behind])

    def _moved(self, number: int, body: Body) -> tuple[Array, Array]:
        """Height and image of tool ``number`` at the moment of ``body``."""
        if body.turn is not None:
            return _layer(body.place(0) @ self._sight.T, body.triangles, self._view)
        height, image = self._layers[number]
        across, up, towards = self._sight @ (body.offset[0] - self._start[number])
        shift = (round(up / self._view.pixel), round(across / self._view.pixel))
        return np.roll(height, shift, (0, 1)) + towards, np.roll(image, shift, (0, 1))


def _layer(points: Array, triangles: NDArray[np.int64], view: View) -> tuple[Array, Array]:
    """Height (rows, columns) and image RGBA (rows, columns, 4) of a tool."""
    height, light = nearest(points[triangles], view)
    image = np.zeros((*height.shape, 4))
    image[..., :3] = np.clip(COLOUR * light[..., None], 0.0, 1.0)
    image[..., 3] = np.where(np.isfinite(height), np.where(_edges(light), EDGE, OPAQUE), 0.0)
    return height, image


def _edges(light: Array) -> NDArray[np.bool_]:
    """Pixels at which the light changes: outlines and creases of what is seen."""
    found = np.zeros(light.shape, bool)
    found[1:] |= np.abs(np.diff(light, axis=0)) > STEP
    found[:, 1:] |= np.abs(np.diff(light, axis=1)) > STEP
    return found


def _blended(layers: Sequence[tuple[Array, NDArray[np.bool_]]]) -> Array:
    """Images RGBA one over the other, each where its mask (rows, columns) is set."""
    result = np.zeros_like(layers[0][0])
    for image, shown in layers:
        alpha = image[..., 3:] * shown[..., None]
        beneath = result[..., 3:] * (1.0 - alpha)
        total = alpha + beneath
        mixed = (image[..., :3] * alpha + result[..., :3] * beneath) / np.maximum(total, 1e-12)
        result = np.concatenate([mixed, total], axis=2)
    return result


#: label, unit and factor from the frame's unit to it
LABELS = {
    "axial_force": ("axial force", "N", 1.0),
    "axial_strain": ("axial strain", "%", 100.0),
    "shear_angle": ("shear angle", "°", float(np.degrees(1.0))),
    "height": ("height", "mm", 1.0),
    "force_warp": ("force along warp", "N/mm", 1.0),
    "force_weft": ("force along weft", "N/mm", 1.0),
    "strain_warp": ("strain along warp", "%", 100.0),
    "strain_weft": ("strain along weft", "%", 100.0),
}
#: fields that a reader looks for first, where they reach so far [unit of the label]
FIRST = {"axial_force": 0.0, "shear_angle": 0.1}
#: largest value of a field, by unit, that is no more than rounding
ROUNDING = {"N": 1e-6, "N/mm": 1e-6, "%": 1e-6, "°": 1e-4}
#: share of the values of elements that their colours tell apart: few recoiling ends would make all others alike
TOLD_APART = 99.8
#: negative values below this share of the largest are of no account, and the scale begins at 0
ONE_SIDED = 0.01
#: codes 1 to 255 are values, 0 is none
CODES = 254


@dataclass(frozen=True)
class Scale:
    """Colours of a field from ``low`` to ``high`` [``unit``], diverging about 0 if ``signed``; the frames hold values
    from ``least`` to ``largest``.
    """

    label: str
    unit: str
    factor: float
    low: float
    high: float
    signed: bool
    least: float
    largest: float

    def codes(self, values: Array) -> NDArray[np.int64]:
        """Whole numbers 1 to 255 for ``values`` in the frame's unit, 0 where there is no number."""
        share = np.clip((self.factor * values - self.low) / (self.high - self.low), 0.0, 1.0)
        known = np.isfinite(values)
        return np.where(known, 1 + np.round(CODES * np.where(known, share, 0.0)), 0).astype(np.int64)


def scales_of(recording: Recording) -> dict[str, Scale]:
    """Scales of the fields that are more than rounding, by name, those that a reader looks for first in front."""
    alive = recording.fields.get("alive")
    scaled = {name: scale_of(name, values, alive) for name, values in recording.fields.items() if name != "alive"}
    found = {name: scale for name, scale in scaled.items() if scale is not None}
    known = list(LABELS)

    def place(name: str) -> tuple[int, int]:
        rank = 1 if name not in FIRST else 0 if found[name].high >= FIRST[name] else 2
        return rank, known.index(name) if name in known else len(known)

    return {name: found[name] for name in sorted(found, key=place)}


def scale_of(name: str, values: Array, alive: Array | None = None) -> Scale | None:
    """Scale of the field ``name`` with ``values`` (k, m) in the frames, of elements that are ``alive``."""
    label, unit, factor = LABELS.get(name, (name.replace("_", " "), "", 1.0))
    known = factor * values[np.isfinite(values) if alive is None else np.isfinite(values) & (alive > 0.5)]
    limit = float(np.percentile(np.abs(known), TOLD_APART)) if known.size else 0.0
    limit = limit or float(np.abs(known).max(initial=0.0))
    if limit <= ROUNDING.get(unit, 0.0):
        return None
    least, largest = float(known.min()), float(known.max())
    signed = least < -ONE_SIDED * max(limit, largest)
    return Scale(label, unit, factor, -limit if signed else 0.0, limit, signed, least, largest)


#: colours of a map
SIZE = 256
#: white of sRGB (D65), and what XYZ is of its linear primaries (IEC 61966-2-1)
WHITE = np.array([0.95047, 1.0, 1.08883])
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.119192, 0.9503041]]
)


def sequential() -> list[str]:
    """Colours of values from 0 on, as ``#rrggbb``: matplotlib's viridis, uniform in CAM02-UCS."""
    import matplotlib

    return _hex(matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, SIZE))[:, :3])


def diverging() -> list[str]:
    """Colours of values about 0, as ``#rrggbb``: Moreland's blue to red, either arm in equal steps of CIELAB."""
    import matplotlib

    return _hex(evened(lambda place: matplotlib.colormaps["coolwarm"](place)[:, :3]))


def evened(colours: Callable[[Array], Array]) -> Array:
    """Colours (:data:`SIZE`, 3) of a map of places 0 to 1, respaced so that either half has equal steps in CIELAB."""
    arms = []
    for start, end in ((0.0, 0.5), (0.5, 1.0)):
        place = np.linspace(start, end, 129)
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(lab(colours(place)), axis=0), axis=1))])
        arms.append(np.interp(np.linspace(0.0, length[-1], SIZE // 2), length, place))
    return colours(np.concatenate(arms))


def lab(rgb: Array) -> Array:
    """CIELAB (n, 3) of sRGB ``rgb`` (n, 3), 0 to 1."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    t = linear @ TO_XYZ.T / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])


def _hex(rgb: Array) -> list[str]:
    return ["#" + "".join(f"{round(255 * float(c)):02x}" for c in colour) for colour in rgb]
