"""Makes a closed, outward body of what an STL file holds: a solid, or only the skin that the fabric touches."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from knittest.base.errors import InputError
from knittest.models.triangle_mesh import TriangleMesh

Index = NDArray[np.int64]


def mended(mesh: TriangleMesh, away: float, height: float) -> tuple[TriangleMesh, list[str]]:
    """Closed body that ``mesh`` bounds, its triangles turning left seen from outside, and notes on what was changed.

    Triangles are turned until neighbours agree. An open surface is taken for the skin of a body that goes on along z by
    ``height`` [mm], upwards (``away`` = 1) or downwards (-1), away from the fabric: a copy of the skin closes it there.
    Raises :class:`InputError` for a surface that is none.
    """
    notes = []
    disagreeing = _disagreeing(mesh)
    if disagreeing.any():
        mesh = mesh.turned(disagreeing)
        notes.append(f"{disagreeing.sum()} triangles faced another way than their neighbours: turned")
    skin = len(mesh.borders()) > 0
    outward = away * -float(mesh.normals[:, 2].sum()) if skin else mesh.volume
    if skin and abs(outward) < 1e-6 * float(np.linalg.norm(mesh.normals, axis=1).sum()):
        raise InputError("an open surface that stands upright: which side of it is the body cannot be told")
    if outward < 0.0:
        mesh = mesh.turned()
        notes.append("inverted, its triangles faced into the body: turned")
    if skin:
        mesh = _thickened(mesh, away * height)
        way = "upwards" if away > 0.0 else "downwards"
        notes.append(f"an open surface: taken for the skin of a body that goes on {height:.4g} mm {way}")
    return mesh, notes


def _thickened(skin: TriangleMesh, shift: float) -> TriangleMesh:
    """Body between ``skin`` and a copy of it moved along z by ``shift`` [mm]."""
    corners, by = skin.corners, np.array([0.0, 0.0, shift])
    begin, end = np.moveaxis(skin.points[skin.borders()], 1, 0)
    sides = [np.stack([end, begin, begin + by], axis=1), np.stack([end, begin + by, end + by], axis=1)]
    return TriangleMesh.joined([corners, corners[:, ::-1] + by, *sides])


def _disagreeing(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """Triangles (m,) to turn so that all neighbours agree, the fewer of each connected part.

    Every triangle is two nodes of a graph, as it is and turned. Neighbours that agree join like with like, others like
    with unlike; then a choice for one triangle is one component, and a part both of whose choices are one has one side
    only (a Moebius strip).
    """
    count, (a, b, differ) = len(mesh.triangles), _neighbours(mesh)
    rows, columns = np.concatenate([a, a + count]), np.concatenate([b + count * differ, b + count * ~differ])
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(2 * count, 2 * count))
    _, label = connected_components(graph, directed=False)
    kept, turned = label[:count], label[count:]
    if (kept == turned).any():
        raise InputError("a surface with one side only")
    votes = np.bincount(kept, minlength=label.max() + 1)
    return (votes[turned] > votes[kept]) | ((votes[turned] == votes[kept]) & (turned < kept))


def _neighbours(mesh: TriangleMesh) -> tuple[Index, Index, NDArray[np.bool_]]:
    """Pairs of triangles at an edge, (n,) each, and whether both run along it the same way, which they must not."""
    edges = mesh.edges
    owner = np.tile(np.arange(len(mesh.triangles)), 3)
    low, high = edges.min(axis=1), edges.max(axis=1)
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    if (crowded := int((same[1:] & same[:-1]).sum())) > 0:
        raise InputError(f"more than two triangles meet at {crowded} edges: expected the surface of one body")
    first, second = order[:-1][same], order[1:][same]
    return owner[first], owner[second], edges[first, 0] == edges[second, 0]
