"""Rigid tools from closed triangle surfaces, by their signed distance on a grid."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.base.errors import InputError
from knittest.base.reading import excerpt, read_regular
from knittest.kernels.triangle_distance import crossings, far_distance, inherit, near_distance
from knittest.models.tool import Tool, sampled
from knittest.models.triangle_mesh import TriangleMesh

Array = NDArray[np.float64]

#: extent of a tool that is taken for a slip of unit outside [mm]
SMALLEST, LARGEST = 0.5, 5000.0
#: samples around the surface on every side
MARGIN = 3
#: the grid begins off round numbers by this share of its spacing, so that its columns miss edges drawn along the axes
SHIFT = np.array([0.3819660, 0.2360680, 0.0])
#: number of spacings within which a distance is that of the nearest triangle of all; beyond, of the triangle of the
#: nearest such sample or of a neighbour of it; number of rounds in which neighbours are asked
BAND, PASSES = 4.0, 2
#: most triangles of a file, and the bytes that one takes in ASCII at most and in lines
MOST_TRIANGLES, ASCII_BYTES, ASCII_LINES = 1_000_000, 500, 7
BINARY_HEAD, BINARY_BYTES = 84, 50
#: most samples of a grid: 200 MB
MOST_SAMPLES = 25_000_000


def surface(points: ArrayLike, triangles: ArrayLike, spacing: float, box: ArrayLike | None = None) -> Tool:
    """Tool bounded by ``triangles`` (n, 3) of ``points`` (m, 3) [mm], sampled every ``spacing`` [mm].

    ``box`` (2, 3): lowest and highest place [mm] at which it can be touched; default: all round it. Flat faces are
    exact, radii off by about spacing^2 / (8 radius), edges rounded within a cell. Raises :class:`InputError` for a
    surface that is open, inverted, without volume or of an implausible size.
    """
    mesh = TriangleMesh(np.asarray(points, float), np.asarray(triangles, np.int64))
    check_closed(mesh)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    if box is not None:
        lowest, highest = np.asarray(box, float)
        low, high = np.maximum(low, lowest), np.minimum(high, highest)
    origin = low - (MARGIN + SHIFT) * spacing
    shape = np.ceil((high - origin) / spacing).astype(int) + MARGIN + 1
    count = float(np.prod(shape.astype(float)))
    if (shape < 2 * MARGIN).any():
        raise InputError("surface: lies where the fabric cannot touch it")
    if count > MOST_SAMPLES:
        raise InputError(f"surface: {count:.2g} samples at {spacing:g} mm; expected a coarser spacing")
    return sampled(origin, spacing, _samples(mesh.corners, origin, spacing, shape))


def read_surface(path: Path, spacing: float) -> Tool:
    """Tool from an STL file in mm; raises InputError for files that are none, and as :func:`surface` does."""
    mesh = read_stl(path)
    try:
        return surface(mesh.points, mesh.triangles, spacing)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def read_stl(path: Path) -> TriangleMesh:
    """Triangles of an STL file, ASCII or binary, joined at their corners; raises :class:`InputError`."""
    import meshio

    _check_size(path)
    try:
        with np.errstate(over="ignore"):  # it multiplies a number from the file
            mesh = meshio.read(path, file_format="stl")
        triangles = mesh.cells_dict["triangle"]
    except Exception as error:  # its parsers raise whatever the bytes lead them to, with all of them in the message
        why = excerpt(str(error)) or type(error).__name__
        raise InputError(f"{path}: not an STL file with triangles ({why})") from None
    if not np.isfinite(mesh.points).all():
        raise InputError(f"{path}: corners that are not finite")
    # every triangle of an STL file has corners of its own, in single precision
    return TriangleMesh.joined([mesh.points.astype(float)[triangles]], same=1e-6)


def _check_size(path: Path) -> None:
    """Raise :class:`InputError` for what is no file, and for more triangles than can be mended and sampled in time."""
    limit = MOST_TRIANGLES * ASCII_BYTES
    content = read_regular(path, limit, f"expected at most {MOST_TRIANGLES:,} triangles; write a coarser mesh")
    count = int.from_bytes(content[BINARY_HEAD - 4 : BINARY_HEAD], "little")
    if len(content) != BINARY_HEAD + BINARY_BYTES * count:
        count = content.count(b"\n") // ASCII_LINES
    if count > MOST_TRIANGLES:
        raise InputError(f"{path}: {count:,} triangles; expected at most {MOST_TRIANGLES:,}: write a coarser mesh")


def check_closed(mesh: TriangleMesh) -> None:
    """Raise :class:`InputError` for what :func:`surface` cannot sample."""
    if not np.isfinite(mesh.points).all():
        raise InputError("surface: corners that are not finite")
    extent = float(np.ptp(mesh.points[mesh.triangles.ravel()], axis=0).max())
    if not SMALLEST <= extent <= LARGEST:
        raise InputError(f"surface: {extent:.3g} mm across; expected {SMALLEST:g} to {LARGEST:g} mm: another unit?")
    if borders := len(mesh.borders()):
        raise InputError(f"surface: open or folded at {borders} edges; expected a closed surface")
    if abs(mesh.volume) < 1e-9 * extent**3:
        raise InputError("surface: encloses no volume")
    if mesh.volume < 0.0:
        raise InputError("surface: inverted: its triangles turn right seen from outside; flip them")


def distances(corners: Array, points: Array, at_most: Array) -> Array:
    """Distance [mm] of ``points`` (n, 3) from the triangles ``corners`` (m, 3, 3); inf above ``at_most`` (n,)."""
    square, number = np.full((len(points), 1, 1, 1), np.inf), np.zeros((1, 1, 1), np.int32)
    for k, point in enumerate(points):  # each is the only sample of a grid
        near_distance(corners, point, 1.0, at_most[k], square[k], number)
    return np.sqrt(square.ravel())


def _samples(corners: Array, origin: Array, spacing: float, shape: Array) -> Array:
    """Signed distance [mm] from the closed surface of ``corners`` (n, 3, 3) at a grid of ``shape``."""
    square = np.full(tuple(shape), np.inf)
    nearest = np.full(tuple(shape), -1, np.int32)
    near_distance(corners, origin, spacing, BAND * spacing, square, nearest)
    _fill_far(corners, origin, spacing, square, nearest)
    steps = np.zeros(tuple(shape), np.int8)
    crossings(corners, origin, spacing, steps)
    inside = np.cumsum(steps, axis=2, dtype=np.int8) > 0
    distance: Array = np.sqrt(square, out=square)
    np.negative(distance, out=distance, where=inside)
    if any(_jumps(distance, axis).max() > 1.5 * spacing for axis in range(3)):
        raise InputError("surface: it runs through itself, so that its inside cannot be told")
    return distance


def _jumps(distance: Array, axis: int) -> Array:
    """Change of the distance from sample to sample where its sign changes: at most a spacing of a true one."""
    inside = distance < 0.0
    jump: Array = np.abs(np.diff(distance, axis=axis)) * np.diff(inside, axis=axis)
    return jump


def _fill_far(corners: Array, origin: Array, spacing: float, square: Array, nearest: NDArray[np.int32]) -> None:
    from scipy.ndimage import distance_transform_edt

    beyond = nearest < 0
    if beyond.all():
        raise InputError("surface: lies where the fabric cannot touch it")
    inherit(distance_transform_edt(beyond, return_distances=False, return_indices=True), beyond, nearest)
    for _ in range(PASSES):
        found = np.empty_like(nearest)
        far_distance(corners, origin, spacing, beyond, nearest, square, found)
        nearest = found
