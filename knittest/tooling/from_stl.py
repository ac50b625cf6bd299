"""Tools from a user's STL files: read, checked, mended, put on the fabric and sampled."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from knittest.base.errors import InputError
from knittest.base.resources import data_dir
from knittest.config.tools import StlTool
from knittest.models.surface import surface
from knittest.models.tool import Tool
from knittest.models.triangle_mesh import TriangleMesh
from knittest.tooling.mending import mended

Array = NDArray[np.float64]

#: extent of a tool over that of the blank outside of which it is taken for a slip of unit
SMALLEST, LARGEST = 0.05, 20.0
#: how far beyond the blank a tool is sampled [mm]
RIM = 10.0


@dataclass(frozen=True)
class Placement:
    """Place of a file's body: its highest point (``away`` = -1) or its lowest (1) at ``face`` [mm], with the fabric, of
    extent ``blank`` [mm] in x and y, up to ``height`` [mm] from there on its other side.
    """

    face: float
    away: float
    height: float
    blank: tuple[float, float]


def stl_body(stl: StlTool, place: Placement, mesh: TriangleMesh) -> tuple[TriangleMesh, list[str]]:
    """Closed body of the file's ``mesh`` at its place, and notes on what was mended; raises :class:`InputError`."""
    path = data_dir() / stl.path
    dropped = mesh.dropped
    if stl.rotation is not None:
        mesh = mesh.rotated(stl.rotation)
    mesh = mesh.moved((stl.offset_x_mm, stl.offset_y_mm, 0.0), stl.scale)
    _check_extent(path, mesh, place)
    try:
        body, notes = mended(mesh, place.away, 2.0 * place.height)  # its far side lies where nothing touches it
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if dropped:
        notes.insert(0, f"{dropped} triangles without area: left out")
    touched = mesh.points[:, 2]
    rise = place.face - float(touched.min() if place.away > 0.0 else touched.max())
    return body.moved((0.0, 0.0, rise)), [f"{path.name}: {note}" for note in notes]


def stl_tool(stl: StlTool, body: TriangleMesh, place: Placement) -> Tool:
    """``body`` for the kernel, sampled where the fabric may be; raises :class:`InputError`."""
    half = 0.5 * np.array(place.blank) + RIM
    ends = sorted((place.face - place.away * place.height, place.face + place.away * place.height))
    try:
        return surface(body.points, body.triangles, stl.spacing_mm, [[*-half, ends[0]], [*half, ends[1]]])
    except InputError as error:
        raise InputError(f"{stl.path}: {error}") from None


def sampled_distance(tool: Tool, points: Array) -> Array:
    """Distance [mm] of ``points`` (n, 3) from a sampled ``tool`` at its start; beyond its grid, from the grid too."""
    spacing = tool.size[0]
    place = (points - tool.position) / spacing
    nearest = np.clip(place, 0.0, np.array(tool.samples.shape) - 1.0)
    within: Array = map_coordinates(tool.samples, nearest.T, order=1, mode="nearest")
    return within + spacing * np.linalg.norm(place - nearest, axis=1)


def _check_extent(path: Path, mesh: TriangleMesh, place: Placement) -> None:
    extent, blank = float(np.ptp(mesh.points, axis=0).max()), max(place.blank)
    if not SMALLEST * blank <= extent <= LARGEST * blank:
        raise InputError(
            f"{path}: {extent:.3g} mm across on a blank of {blank:g} mm; another unit? scale: 10 for centimetres, "
            f"25.4 for inches, 1000 for metres, 0.001 for micrometres"
        )
