"""Forming tools from a user's STL files: read, checked, repaired, placed on the fabric, sampled as height maps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, label, map_coordinates
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.config.tools import StlTool
from knittest.export.shading import View, render_triangles
from knittest.models.surface import TriangleMesh, surface
from knittest.models.tool import Tool

Index = NDArray[np.int64]
Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


def repair_mesh(mesh: TriangleMesh, away: float, height: float) -> tuple[TriangleMesh, list[str]]:
    """Closed body bounded by ``mesh``, with triangles that turn left seen from outside, and notes on changes.

    Triangles are flipped until neighbours agree. An open surface is closed to a body that extends along z by ``height``
    [mm], upwards (``away`` = 1) or downwards (-1), away from the fabric. Raises :class:`InputError` for any other one.
    """
    notes = []
    disagreeing = _triangles_to_flip(mesh)
    if disagreeing.any():
        mesh = mesh.with_reversed_triangles(disagreeing)
        notes.append(f"{disagreeing.sum()} triangles with another orientation than their neighbours were flipped")
    skin = len(mesh.borders()) > 0
    outward = away * -float(mesh.normals[:, 2].sum()) if skin else mesh.volume
    if skin and abs(outward) < 1e-6 * float(np.linalg.norm(mesh.normals, axis=1).sum()):
        raise InputError("an open vertical surface, of which the side of the body is unknown; close the surface")
    if outward < 0.0:
        mesh = mesh.with_reversed_triangles()
        notes.append("all triangles faced inwards and were flipped")
    if skin:
        corners, by = mesh.corners, np.array([0.0, 0.0, away * height])
        begin, end = np.moveaxis(mesh.points[mesh.borders()], 1, 0)
        sides = [np.stack([end, begin, begin + by], axis=1), np.stack([end, begin + by, end + by], axis=1)]
        mesh = TriangleMesh.from_corners([corners, corners[:, ::-1] + by, *sides])
        way = "upwards" if away > 0.0 else "downwards"
        notes.append(f"an open surface, closed to a body that extends {height:.4g} mm {way}")
    return mesh, notes


def _triangles_to_flip(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Triangles (m,) to flip so that all neighbours agree, the fewer of each connected part.

    Each triangle is two nodes of a graph, unchanged and flipped. Neighbours that agree connect equal states, others
    opposite ones. If both states of a triangle are in one component, the surface is one-sided (a Moebius strip).
    """
    count, (a, b, differ) = len(mesh.triangles), _pair_neighbours(mesh)
    rows, columns = np.concatenate([a, a + count]), np.concatenate([b + count * differ, b + count * ~differ])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * count, 2 * count))
    _, label = connected_components(graph, directed=False)
    kept, turned = label[:count], label[count:]
    if (kept == turned).any():
        raise InputError("a one-sided surface (Moebius strip); expected the surface of a body")
    votes = np.bincount(kept, minlength=label.max() + 1)
    return (votes[turned] > votes[kept]) | ((votes[turned] == votes[kept]) & (turned < kept))


def _pair_neighbours(mesh: TriangleMesh) -> tuple[Index, Index, NDArray[np.bool_]]:
    """Pairs of triangles at an edge, (n,) each, and whether both run along it in the same direction (wrong)."""
    edges = mesh.edges
    owner = np.tile(np.arange(len(mesh.triangles)), 3)
    low, high = edges.min(axis=1), edges.max(axis=1)
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    if (crowded := int((same[1:] & same[:-1]).sum())) > 0:
        raise InputError(f"more than two triangles meet at {crowded} edges: expected the surface of one body")
    first, second = order[:-1][same], order[1:][same]
    return owner[first], owner[second], edges[first, 0] == edges[second, 0]


#: limits of the extent of a tool over that of the blank; beyond them the unit is wrong
SMALLEST, LARGEST = 0.05, 20.0
#: how far beyond the blank a tool is sampled [mm]
RIM = 10.0


@dataclass(frozen=True)
class Placement:
    """Place of a file's body: highest (``away`` = -1) or lowest point (1) at ``face`` [mm]; the fabric, of lengths
    ``blank`` [mm], comes up to ``height`` [mm] from there.
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
        mesh = mesh.with_rotation(stl.rotation)
    mesh = mesh.with_offset((stl.offset_x_mm, stl.offset_y_mm, 0.0), stl.scale)
    extent, blank = float(np.ptp(mesh.points, axis=0).max()), max(place.blank)
    if not SMALLEST * blank <= extent <= LARGEST * blank:
        raise InputError(
            f"{path}: size {extent:.3g} mm on a blank of {blank:g} mm; if the file is not in mm, set scale: 10 for "
            "centimetres, 25.4 for inches, 1000 for metres, 0.001 for micrometres"
        )
    try:
        body, notes = repair_mesh(mesh, place.away, 2.0 * place.height)  # its far side lies where nothing touches it
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if dropped:
        notes.insert(0, f"{dropped} triangles without area were removed")
    touched = mesh.points[:, 2]
    rise = place.face - float(touched.min() if place.away > 0.0 else touched.max())
    return body.with_offset((0.0, 0.0, rise)), [f"{path.name}: {note}" for note in notes]


def stl_tool(stl: StlTool, body: TriangleMesh, place: Placement) -> Tool:
    """Sample ``body`` for the kernel where the fabric may be; raises :class:`InputError`."""
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


#: cells along the longer side of the blank
CELLS = 200
#: share of the area of a tool that may stand higher than its face
PROUD = 0.1
#: fall, as a share of the largest one looked at, below which a surface counts as flat
FLAT = 0.02
#: slope of a triangle out of the upright, as a cosine, from which on it is seen
EDGE_ON = 1e-6


@dataclass(frozen=True)
class HeightMap:
    """Height [mm] of a body over a grid in plan with cells of ``cell`` [mm], row 0 at the lowest y; -inf outside.

    Seen from below, heights are counted downwards: ``height`` is -z of the lowest surface.
    """

    height: Array
    cell: float

    @classmethod
    def of(
        cls, body: TriangleMesh, blank: tuple[float, float], *, below: bool = False, cells: int = CELLS
    ) -> "HeightMap":
        """Map of a closed ``body`` within a ``blank`` (lengths along x and y [mm]), from above or ``below``."""
        x, y = 0.5 * blank[0], 0.5 * blank[1]
        cell = max(blank) / cells
        up = -1.0 if below else 1.0
        seen = up * body.normals[:, 2] > EDGE_ON * np.linalg.norm(body.normals, axis=1)
        corners = body.corners[seen] * np.array([1.0, 1.0, up])
        return cls(render_triangles(corners, View(-x, x, -y, y, cell))[0], cell)

    @property
    def covered_cells(self) -> Mask:
        """Cells that the body covers."""
        return np.isfinite(self.height)

    @property
    def face(self) -> float:
        """Height [mm] that a tenth of the covered area reaches; -inf for a body that covers nothing."""
        heights = self.height[self.covered_cells]
        return float(np.quantile(heights, 1.0 - PROUD)) if heights.size else -np.inf

    def rim(self) -> Array:
        """Height [mm] that the body reaches on two opposite sides of each cell, along x or y; the face at most."""
        both = [
            np.minimum(np.maximum.accumulate(h, axis), np.flip(np.maximum.accumulate(np.flip(h, axis), axis), axis))
            for h, axis in ((self.height, 0), (self.height, 1))
        ]
        return np.minimum(np.maximum(*both), self.face)

    def edge_width(self, fall: float, face: float, opening: Mask | None = None) -> float:
        """Mean width in plan [mm] in which the surface falls from ``face`` by ``fall`` [mm]: 0 for a sharp edge.

        ``opening``: cells within the opening round which the edge runs; default: all edges. 0 without an edge.
        """
        low = self.height < face - fall
        if opening is not None:
            low = connected_parts(low, opening)
        border = low & binary_dilation(~low)
        if not border.any():
            return 0.0
        near = binary_dilation(low, iterations=int(np.ceil(2.0 * fall / self.cell)))
        slope = near & (self.height < face - FLAT * fall) & (self.height >= face - fall)
        return self.cell * float(np.count_nonzero(slope)) / float(np.count_nonzero(border))


def connected_parts(region: Mask, seed: Mask) -> Mask:
    """Return the connected parts of a ``region`` with a cell of ``seed``."""
    part, _ = label(region)
    found: Mask = region & np.isin(part, np.unique(part[seed & region]))
    return found
