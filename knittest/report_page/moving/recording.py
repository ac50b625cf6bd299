"""Reads the frames of a run folder: positions, fields with their colour scales, and tools for films."""

import xml.etree.ElementTree as ET
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import read_regular
from knittest.base.history import Body
from knittest.export.shading import View, render_triangles

Array = NDArray[np.float64]
Index = NDArray[np.int64]
COLLECTION = "frames.pvd"
MAX_COLLECTION, MAX_FRAME = 5_000_000, 2_000_000_000
#: fields that describe the elements, not their state
MESH_FIELDS = ("part", "yarn", "radius")
KINDS = {"line": "beams", "quad": "shells"}
#: rounding of positions [mm]
SHIFT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Recording:
    """Frames of a run: ``kind`` beams or shells; ``cells`` (m, 2 or 4) with their ``part`` (m,) in ``part_names`` and
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

    def with_fewer_frames(self, most: int) -> "Recording":
        """The same with ``most`` frames at most, evenly spaced by number from the first to the last."""
        if len(self.time) <= most:
            return self
        kept = np.unique(np.round(np.linspace(0, len(self.time) - 1, most)).astype(int))
        fields = {name: values[kept] for name, values in self.fields.items()}
        bodies = tuple(body.select_frames(kept) for body in self.bodies)
        return replace(self, time=self.time[kept], position=self.position[kept], fields=fields, bodies=bodies)

    def around(self, time: float) -> tuple[int, int, float]:
        """Numbers of the frames before and after a ``time`` [ms], and its share of the interval."""
        before = int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, max(len(self.time) - 2, 0)))
        after = min(before + 1, len(self.time) - 1)
        span = float(self.time[after] - self.time[before])
        return before, after, (time - float(self.time[before])) / span if span > 0.0 else 0.0

    def bodies_at(self, time: float) -> list[Body]:
        """The ``bodies`` at one ``time`` [ms], interpolated between frames."""
        return [body.interpolate(*self.around(time)) for body in self.bodies]


class Entry(NamedTuple):
    """A file of the collection: time [ms], path, and the name of the tool, empty for the specimen."""

    time: float
    path: Path
    tool: str


def read_recording(folder: Path) -> Recording:
    """Read the frames of the run folder ``folder``; raises :class:`InputError` for missing or inconsistent frames."""
    collection = folder / COLLECTION
    if not collection.exists():
        raise InputError(
            f"{folder}: has no frames ({COLLECTION} is missing): run the test again without --no-frames "
            "(in a sweep: keep: frames), or continue a stopped run with knittest resume"
        )
    text = read_regular(collection, MAX_COLLECTION, "a run writes less")
    entries = _entries(collection, text)
    specimen = [entry for entry in entries if not entry.tool]
    if not specimen:
        raise InputError(f"{collection}: names no frames: run the test again without --no-frames")
    time = np.array([entry.time for entry in specimen])
    if np.any(np.diff(time) < 0.0):
        raise InputError(f"{collection}: times of the frames decrease; expected ascending times")
    _, _, comment = text.decode("utf-8", errors="replace").partition("part: ")  # "part: 0 warp, 1 weft"
    part_names = [entry.strip().partition(" ")[2] for entry in comment.partition(" -->")[0].split(",")]
    recording = _recording([_mesh(entry.path) for entry in specimen], [e.path for e in specimen], time, part_names)
    return replace(recording, bodies=_bodies([entry for entry in entries if entry.tool], time))


def _entries(collection: Path, text: bytes) -> list[Entry]:
    """Files of the ``collection``; raises :class:`InputError` for a path outside its folder."""
    try:
        rows = ET.fromstring(text).iter("DataSet")
        found = [(float(row.attrib["timestep"]), row.attrib["file"], row.get("name", "")) for row in rows]
    except (ET.ParseError, KeyError, ValueError) as error:
        raise InputError(f"{collection}: cannot be read: {error}; run the test again") from None
    for _, name, _ in found:
        if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts or "\\" in name:
            raise InputError(f"{collection}: names {name!r}: expected a file in the run folder")
    return [Entry(time, collection.parent / name, tool) for time, name, tool in found]


def _mesh(path: Path) -> Any:
    import meshio

    if not path.is_file():
        raise InputError(f"{path}: no such file, but {COLLECTION} names it; run the test again")
    if path.stat().st_size > MAX_FRAME:
        raise InputError(f"{path}: larger than {MAX_FRAME // 1_000_000} MB: a run writes less")
    try:
        mesh = meshio.vtu.read(path)  # meshio.read ends the process on an error
    except Exception as error:  # of any kind in a damaged file
        raise InputError(f"{path}: cannot be read as VTU ({error}); run the test again") from None
    if len(mesh.cells) != 1 or not np.isfinite(mesh.points).all():
        raise InputError(f"{path}: expected elements of one kind and finite positions; run the test again")
    return mesh


def _recording(meshes: Sequence[Any], paths: Sequence[Path], time: Array, part_names: list[str]) -> Recording:
    first = meshes[0]
    cells = first.cells[0].data
    kind = KINDS.get(first.cells[0].type, "")
    if not kind or any(name not in first.cell_data for name in MESH_FIELDS):
        raise InputError(f"{paths[0]}: not a frame of knittest: expected beams or shells with {', '.join(MESH_FIELDS)}")
    for mesh, path in zip(meshes, paths, strict=True):
        same = mesh.points.shape == first.points.shape and np.array_equal(mesh.cells[0].data, cells)
        if not same or mesh.cell_data.keys() != first.cell_data.keys():
            raise InputError(f"{path}: has other nodes, elements or fields than {paths[0].name}; run the test again")
    names = [name for name in first.cell_data if name not in MESH_FIELDS]
    fields = {name: np.array([mesh.cell_data[name][0] for mesh in meshes], float) for name in names}
    part, radius = (np.asarray(first.cell_data[name][0]) for name in ("part", "radius"))
    if len(part_names) <= part.max():
        part_names = [f"part {k}" for k in range(part.max() + 1)]
    used, numbers = np.unique(cells, return_inverse=True)  # a periodic cell has nodes of its images too
    position = np.array([mesh.points[used] for mesh in meshes], float)
    return Recording(
        kind, numbers.reshape(cells.shape), part.astype(np.int64), tuple(part_names), radius.astype(float), time,
        position, fields,
    )  # fmt: skip


def _bodies(entries: Sequence[Entry], time: Array) -> tuple[Body, ...]:
    """Rigid tools; raises :class:`InputError` for a missing file and a changed shape."""
    found = []
    for name in dict.fromkeys(entry.tool for entry in entries):
        own = [entry for entry in entries if entry.tool == name]
        if not np.array_equal([entry.time for entry in own], time):
            raise InputError(f"{own[0].path}: tool {name!r} is missing at some times; run the test again")
        meshes = [_mesh(entry.path) for entry in own]
        points, triangles = meshes[0].points, meshes[0].cells[0].data
        if meshes[0].cells[0].type != "triangle" or any(mesh.points.shape != points.shape for mesh in meshes):
            raise InputError(f"{own[0].path}: tool {name!r}: expected the same number of triangles at every time")
        points, places = np.asarray(points, float), [np.asarray(mesh.points, float) for mesh in meshes]
        offset, turn = np.array([place[0] - points[0] for place in places]), None
        moved = [points + one for one in offset]
        if not np.allclose(places, moved, rtol=0.0, atol=SHIFT_TOLERANCE):  # it turns, or is sheared
            known = np.column_stack([points, np.ones(len(points))])
            solved = np.array([np.linalg.lstsq(known, place, rcond=None)[0] for place in places])
            if not np.allclose([known @ one for one in solved], places, rtol=0.0, atol=SHIFT_TOLERANCE):
                raise InputError(f"{own[0].path}: tool {name!r} changes its shape; run the test again")
            offset, turn = solved[:, 3], solved[:, :3].transpose(0, 2, 1)
        found.append(Body(name, points, triangles, offset, turn))
    return tuple(found)


#: colour of tools, their opacity, and that of their edges
COLOUR, OPAQUE, EDGE = np.array([0.55, 0.6, 0.66]), 0.34, 0.7
#: difference of the light between neighbouring pixels at which an edge is drawn
STEP = 0.06


class ToolLayers:
    """Images of ``bodies`` in the axes ``sight`` (3, 3) on the pixels of ``view``; only a rotating body is redrawn."""

    def __init__(self, bodies: Sequence[Body], sight: Array, view: View) -> None:
        self._sight, self._view = sight, view
        self._start = [body.offset[0] for body in bodies]
        self._layers = [_layer(body.place(0) @ sight.T, body.triangles, view) for body in bodies]

    def around(self, height: Array, moved: Sequence[Body]) -> tuple[Array, Array]:
        """RGBA images (rows, columns, 4) of ``moved`` tools behind and before a specimen of ``height`` [mm]."""
        if not self._layers:
            return np.zeros((0, 0, 4)), np.zeros((0, 0, 4))
        found = [self._moved(k, body) for k, body in enumerate(moved)]
        found.sort(key=lambda layer: float(layer[0].max()))
        behind = [(image, top <= height) for top, image in found]
        return _blend_layers(behind), _blend_layers([(image, ~under) for image, under in behind])

    def _moved(self, number: int, body: Body) -> tuple[Array, Array]:
        """Height and image of tool ``number`` at the place of ``body``."""
        if body.turn is not None:
            return _layer(body.place(0) @ self._sight.T, body.triangles, self._view)
        height, image = self._layers[number]
        across, up, towards = self._sight @ (body.offset[0] - self._start[number])
        shift = (round(up / self._view.pixel), round(across / self._view.pixel))
        return np.roll(height, shift, (0, 1)) + towards, np.roll(image, shift, (0, 1))


def _layer(points: Array, triangles: NDArray[np.int64], view: View) -> tuple[Array, Array]:
    """Height (rows, columns) and RGBA image (rows, columns, 4) of a tool with its outlines and creases."""
    height, light = render_triangles(points[triangles], view)
    edges = np.zeros(light.shape, bool)
    edges[1:] |= np.abs(np.diff(light, axis=0)) > STEP
    edges[:, 1:] |= np.abs(np.diff(light, axis=1)) > STEP
    image = np.zeros((*height.shape, 4))
    image[..., :3] = np.clip(COLOUR * light[..., None], 0.0, 1.0)
    image[..., 3] = np.where(np.isfinite(height), np.where(edges, EDGE, OPAQUE), 0.0)
    return height, image


def _blend_layers(layers: Sequence[tuple[Array, NDArray[np.bool_]]]) -> Array:
    """RGBA images blended on top of each other, each where its mask (rows, columns) is set."""
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
#: fields shown first, and the largest value that they must reach for that [unit of the label]
FIRST = {"axial_force": 0.0, "shear_angle": 0.1}
#: rounding of a field, by unit
ROUNDING = {"N": 1e-6, "N/mm": 1e-6, "%": 1e-6, "°": 1e-4}
#: share of the element values within the scale, so that a few recoiling ends do not set it [%]
SCALE_PERCENTILE = 99.8
#: share of the largest value below which negative values are ignored, so that the scale starts at 0
ONE_SIDED_SHARE = 0.01
#: codes 1 to 255 are values, 0 is none
CODES = 254


@dataclass(frozen=True)
class Scale:
    """Colour scale from ``low`` to ``high`` [``unit``], diverging if ``signed``, of values ``least`` to ``largest``."""

    label: str
    unit: str
    factor: float
    low: float
    high: float
    signed: bool
    least: float
    largest: float

    def codes(self, values: Array) -> NDArray[np.int64]:
        """Codes 1 to 255 of ``values`` in the frame's unit, 0 for nan."""
        share = np.clip((self.factor * values - self.low) / (self.high - self.low), 0.0, 1.0)
        known = np.isfinite(values)
        return np.where(known, 1 + np.round(CODES * np.where(known, share, 0.0)), 0).astype(np.int64)


def scales_of(recording: Recording) -> dict[str, Scale]:
    """Scales of the fields above rounding, by name, the fields of :data:`FIRST` in front."""
    alive = recording.fields.get("alive")
    scaled = {name: scale_of(name, values, alive) for name, values in recording.fields.items() if name != "alive"}
    found = {name: scale for name, scale in scaled.items() if scale is not None}
    order = [name for name in LABELS if name in found]
    first = [name for name in order if name in FIRST and found[name].high >= FIRST[name]]
    later = [name for name in order if name in FIRST and name not in first]
    return {n: found[n] for n in dict.fromkeys([*first, *(n for n in (*order, *found) if n not in later), *later])}


def scale_of(name: str, values: Array, alive: Array | None = None) -> Scale | None:
    """Scale of the field ``name`` with ``values`` (k, m) of ``alive`` elements; None for rounding."""
    label, unit, factor = LABELS.get(name, (name.replace("_", " "), "", 1.0))
    known = factor * values[np.isfinite(values) if alive is None else np.isfinite(values) & (alive > 0.5)]
    limit = float(np.percentile(np.abs(known), SCALE_PERCENTILE)) if known.size else 0.0
    limit = limit or float(np.abs(known).max(initial=0.0))
    if limit <= ROUNDING.get(unit, 0.0):
        return None
    least, largest = float(known.min()), float(known.max())
    signed = least < -ONE_SIDED_SHARE * max(limit, largest)
    return Scale(label, unit, factor, -limit if signed else 0.0, limit, signed, least, largest)


#: colours of a map
SIZE = 256
#: white of sRGB (D65), and XYZ of its linear primaries (IEC 61966-2-1)
WHITE = np.array([0.95047, 1.0, 1.08883])
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.119192, 0.9503041]]
)


def sequential_colours() -> list[str]:
    """Colours of positive values as ``#rrggbb``: viridis of matplotlib, uniform in CAM02-UCS."""
    import matplotlib

    return _hex_colours(matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, SIZE))[:, :3])


def diverging_colours() -> list[str]:
    """Colours of signed values as ``#rrggbb``: Moreland's blue to red, both arms in equal steps of CIELAB."""
    import matplotlib

    return _hex_colours(respace_colours(lambda place: matplotlib.colormaps["coolwarm"](place)[:, :3]))


def respace_colours(colours: Callable[[Array], Array]) -> Array:
    """Colours (:data:`SIZE`, 3) of a map of places 0 to 1 with equal steps in CIELAB in both halves."""
    arms = []
    for start, end in ((0.0, 0.5), (0.5, 1.0)):
        place = np.linspace(start, end, 129)
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(to_cielab(colours(place)), axis=0), axis=1))])
        arms.append(np.interp(np.linspace(0.0, length[-1], SIZE // 2), length, place))
    return colours(np.concatenate(arms))


def to_cielab(rgb: Array) -> Array:
    """CIELAB (n, 3) of sRGB ``rgb`` (n, 3), 0 to 1."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    t = linear @ TO_XYZ.T / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])


def _hex_colours(rgb: Array) -> list[str]:
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in rgb]
