"""Rigid tools from closed triangle surfaces: signed distance on a grid, edges, orientation and volume."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from knittest.base.arrays import Array, Flags, Index
from knittest.base.errors import InputError
from knittest.base.files import excerpt, read_regular
from knittest.kernels.triangle_distance import crossings, far_distance, inherit, near_distance
from knittest.models.tool import Tool, sampled

#: most points that a surface is spread to
MOST_POINTS = 2_000_000
#: corners closer than this share of the surface's extent are one
SAME = 1e-8


@dataclass(frozen=True)
class TriangleMesh:
    """Surface with ``points`` (n, 3) [mm] and ``triangles`` (m, 3), which turn left seen from outside."""

    points: Array
    triangles: Index
    #: triangles left out because two of their corners were one
    dropped: int = 0

    @classmethod
    def from_corners(cls, parts: Sequence[Array], same: float = SAME) -> "TriangleMesh":
        """Join triangles given by their corners, (n, 3, 3) each, at common points; drops those without three corners.

        ``same``: share of the extent within which points are one.
        """
        corners = np.concatenate(parts)
        grain = same * float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        _, first, number = np.unique(
            np.round(corners.reshape(-1, 3) / max(grain, 1e-300)).astype(np.int64),
            axis=0, return_index=True, return_inverse=True,
        )  # fmt: skip
        triangles = number.reshape(-1, 3)
        keep = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        return cls(corners.reshape(-1, 3)[first], triangles[keep], int((~keep).sum()))

    @property
    def corners(self) -> Array:
        """Corners of the triangles [mm], (m, 3, 3)."""
        return self.points[self.triangles]

    def spread(self, spacing: float) -> Array:
        """Points [mm], (n, 3), all over the surface: its corners, and between them a point every ``spacing`` [mm] at
        least, or as close as :data:`MOST_POINTS` allow.
        """
        corners = self.corners
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        close = max(spacing, float(np.sqrt(0.5 * (sides**2).sum() / MOST_POINTS)))
        parts = np.maximum(np.ceil(sides / close), 1.0).astype(int)
        found = [self.points]
        for n in np.unique(parts[parts > 1]):
            i, j = (steps.ravel() for steps in np.mgrid[: n + 1, : n + 1])
            shares = np.column_stack([i, j, n - i - j])[i + j <= n] / n
            found.append(np.einsum("kc,mcd->mkd", shares, corners[parts == n]).reshape(-1, 3))
        return np.concatenate(found)

    @property
    def normals(self) -> Array:
        """Outward normals times area [mm2], (m, 3)."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return 0.5 * np.cross(b - a, c - a)

    @property
    def volume(self) -> float:
        """Volume inside [mm3]; negative if the triangles turn right seen from outside. Of closed surfaces only."""
        corners = self.corners - self.points.mean(axis=0)
        return float(np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0)

    @property
    def edges(self) -> Index:
        """Edges in the direction of each triangle, (3 m, 2): rows k, m + k and 2 m + k are those of triangle k."""
        t = self.triangles
        return np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])

    def borders(self) -> Index:
        """Edges (k, 2) with no triangle on the other side, or with two on one side: none if closed."""
        edges, count = self.edges, len(self.points)
        forth, back = edges @ np.array([count, 1]), edges @ np.array([1, count])
        _, number, times = np.unique(forth, return_inverse=True, return_counts=True)
        return edges[~np.isin(forth, back) | (times[number] > 1)]

    def with_reversed_triangles(self, which: Flags | None = None) -> "TriangleMesh":
        """Mesh with all triangles, or those of ``which`` (m,), turned inside out."""
        turn = np.ones(len(self.triangles), bool) if which is None else which
        return TriangleMesh(self.points, np.where(turn[:, None], self.triangles[:, ::-1], self.triangles))

    def with_rotation(self, degrees: Sequence[float]) -> "TriangleMesh":
        """Rotated about the origin by ``degrees`` (3,): about the x axis, then y, then z, which stay where they are."""
        return TriangleMesh(Rotation.from_euler("xyz", degrees, degrees=True).apply(self.points), self.triangles)

    def with_offset(self, by: Sequence[float], scale: float = 1.0) -> "TriangleMesh":
        """Scaled about the origin, then moved ``by`` (3,) [mm]."""
        return TriangleMesh(scale * self.points + np.asarray(by, float), self.triangles)


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
        raise InputError(
            f"surface: {count:.2g} samples at {spacing:g} mm, limit {MOST_SAMPLES:.2g}; use a coarser spacing"
        )
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
    return TriangleMesh.from_corners([mesh.points.astype(float)[triangles]], same=1e-6)


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
        raise InputError("surface: inverted: its normals point inwards; flip the triangles")


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
    # where the sign changes from sample to sample, a true distance changes by at most a spacing
    jumps = (np.abs(np.diff(distance, axis=axis)) * np.diff(inside, axis=axis) for axis in range(3))
    if any(jump.max() > 1.5 * spacing for jump in jumps):
        raise InputError("surface: intersects itself, so its inside is not defined")
    return distance


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
