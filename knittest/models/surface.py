"""Rigid tools from closed triangle surfaces, by their signed distance on a grid."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.errors import InputError
from knittest.kernels.triangle_distance import sample_distance
from knittest.models.boundary import Tool, sampled

Array = NDArray[np.float64]

#: extent of a tool that is taken for a slip of unit outside [mm]
SMALLEST, LARGEST = 0.5, 5000.0
#: samples around the surface on every side
MARGIN = 3
#: most samples of a grid: 400 MB
MOST_SAMPLES = 50_000_000


def surface(points: ArrayLike, triangles: ArrayLike, spacing: float) -> Tool:
    """Tool bounded by ``triangles`` (n, 3) of ``points`` (m, 3) [mm], sampled every ``spacing`` [mm].

    Flat faces are exact, radii off by about spacing^2 / (8 radius), edges rounded within a cell. Raises
    :class:`InputError` for a surface that is open, inverted, degenerate or of an implausible size.
    """
    points, triangles = np.asarray(points, float), np.asarray(triangles, np.int64)
    corners = points[triangles]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    _check(triangles, corners, float((high - low).max()))
    origin = low - MARGIN * spacing
    shape = np.ceil((high - low) / spacing).astype(int) + 2 * MARGIN + 1
    count = float(np.prod(shape.astype(float)))
    if count > MOST_SAMPLES:
        raise InputError(f"surface: {count:.2g} samples at {spacing:g} mm; expected a coarser spacing")
    samples = np.empty(tuple(shape))
    sample_distance(corners, origin, spacing, samples)
    return sampled(origin, spacing, samples)


def read_surface(path: Path, spacing: float) -> Tool:
    """Tool from an STL file in mm; raises InputError for files that are none, and as :func:`surface` does."""
    import meshio

    try:
        mesh = meshio.read(path, file_format="stl")
        triangles = mesh.cells_dict["triangle"]
    except (OSError, KeyError, ValueError, IndexError, meshio.ReadError) as error:
        raise InputError(f"{path}: not an STL file with triangles ({error or type(error).__name__})") from None
    # every triangle of an STL file has corners of its own
    points, inverse = np.unique(np.round(mesh.points.astype(float), 6), axis=0, return_inverse=True)
    try:
        return surface(points, inverse.reshape(-1)[triangles], spacing)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _check(triangles: NDArray[np.int64], corners: Array, extent: float) -> None:
    if not np.isfinite(corners).all():
        raise InputError("surface: corners that are not finite")
    if not SMALLEST <= extent <= LARGEST:
        raise InputError(f"surface: {extent:.3g} mm across; expected {SMALLEST:g} to {LARGEST:g} mm: another unit?")
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if (flat := np.flatnonzero(np.linalg.norm(normal, axis=1) < 1e-12 * extent**2)).size:
        raise InputError(f"surface: triangle {flat[0]} has no area")
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there = {(int(a), int(b)) for a, b in edges}
    open_edges = [(a, b) for a, b in there if (b, a) not in there]
    if open_edges or len(there) != len(edges):
        raise InputError(f"surface: open or folded at {max(len(open_edges), 1)} edges; expected a closed surface")
    if np.sum(corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])) < 0.0:
        raise InputError("surface: inverted: its triangles turn right seen from outside; flip them")
