"""Builds the stencils of the fibres' bending in the plane.

At every node through which a yarn goes on, weights of the nodes of the shells round it give both fibres and their
second derivatives along themselves. Where nodes lie on the line of the yarn, on meshes along the yarns and on squares
at 45 degrees to them, these alone bear weight: second differences. Elsewhere all nodes do, by the least weights, mostly
beside the line, that are exact for quadratic displacements. Where the mesh does not tell them, at free edges that the
yarns leave, nothing bends; nor at seams where directions jump and edges where the sheet is folded.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from knittest.kernels.in_plane_state import BLOCK, NOWHERE, OWN_EACH, SAME, WEIGHTS, Bends, no_bends
from knittest.kernels.options import PARTITIONS
from knittest.kernels.shell_state import ALPHA_A, AREA, BETA_A, Shells
from knittest.models.shell_step import element_rows

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: nodes nearer to the line of a yarn than this share of the size of the shells are on it
ON_LINE = 0.02
#: largest error of a stencil's derivatives of linear and quadratic fields, in sizes of shells
EXACT = 1e-6
#: largest sum of the sizes of a stencil's weights, in sizes of shells (4 for a second difference): more come from a
#: mesh that does not tell the derivative but for its own unevenness
LARGEST = 12.0
#: how much less a node off the line bears: weights are least in the sum of w^2 (NEAR + distance^2)^2
NEAR = 0.1
#: difference of weights, over the largest, that is rounding
ALIKE = 1e-9
#: the same, that is the unevenness of a sheet which a block of stencils does without: a slope of 0.05, as of heights of
#: 0.05 mm on shells of 2 mm, shortens sides by 1e-3
UNEVEN = 2e-3
#: least cosine of the angle between the direction of a shell and the mean round a node, beyond which it is a seam, and
#: the same of normals, beyond which the sheet is folded
SEAM, FOLD = 0.94, 0.7


class Stencils(NamedTuple):
    """Stencils of equal size: ``node`` (n,), ``member`` (n, m) nodes, ``weight`` (n, 4, m) as in :class:`Bends`, and
    whether a second derivative of warp and weft is there, ``told`` (n, 2).
    """

    node: Index
    member: Index
    weight: Array
    told: NDArray[np.bool_]


def build_bends(points: Array, cells: Index, shells: Shells, stiffness: Array) -> Bends:
    """Stencils of shells at rest in ``points`` (n, 3) [mm] with corners ``cells`` (n_el, 4).

    ``stiffness`` of warp and weft (2,) [N mm]: that of a yarn over the distance of the yarns; zeros build nothing.
    """
    if stiffness.max() <= 0.0:
        return no_bends()
    around = _incidence(cells, len(points))
    frame, area, whole = _frames(points, cells, shells, around)
    stencils = [_stencils(points, nodes, member, frame, area) for nodes, member in _rings(around, whole)]
    return _in_blocks(points, [s for group in stencils for s in _by_size(group)], around, area, stiffness)


def _incidence(cells: Index, n: int) -> sparse.csr_matrix:
    """Nodes by shells (n, n_el), 1 where a node is a corner."""
    n_el = len(cells)
    return sparse.csr_matrix((np.ones(4 * n_el), (cells.ravel(), np.repeat(np.arange(n_el), 4))), (n, n_el))


def _frames(
    points: Array, cells: Index, shells: Shells, around: sparse.csr_matrix
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Warp, weft (n, 2, 3), area (n,) [mm^2] of each node, and whether the shells round it are of one direction."""
    row = element_rows(shells, len(cells))
    corners = points[cells]
    x31, x42 = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    normal = _unit(np.cross(x31, x42))
    warp = row(ALPHA_A)[:, None] * x31 + row(BETA_A)[:, None] * x42
    mean_normal = _unit(around @ (normal * row(AREA)[:, None]))
    mean_warp = around @ (warp * row(AREA)[:, None])
    mean_warp = _unit(mean_warp - np.sum(mean_warp * mean_normal, axis=1)[:, None] * mean_normal)
    node, shell = around.nonzero()
    bad = np.sum(mean_normal[node] * normal[shell], axis=1) < FOLD
    bad |= np.sum(mean_warp[node] * warp[shell], axis=1) < SEAM
    whole = np.bincount(node, bad, len(points)) == 0
    return np.stack([mean_warp, np.cross(mean_normal, mean_warp)], axis=1), around @ (0.25 * row(AREA)), whole


def _unit(v: Array) -> Array:
    """Vectors (n, 3) of length one; null vectors stay."""
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return np.divide(v, length, out=np.zeros_like(v), where=length > 0.0)


def _rings(around: sparse.csr_matrix, whole: NDArray[np.bool_]) -> list[tuple[Index, Index]]:
    """Nodes (k,) with the nodes of all shells round them (k, m), in groups of equal m."""
    ring = sparse.csr_matrix(around @ around.T)
    ring.sort_indices()
    size = np.diff(ring.indptr)
    groups = []
    for m in np.unique(size[whole]):
        nodes = np.flatnonzero(whole & (size == m))
        groups.append((nodes, ring.indices[ring.indptr[nodes][:, None] + np.arange(m)].astype(np.int64)))
    return groups


def _stencils(points: Array, nodes: Index, member: Index, frame: Array, area: Array) -> Stencils:
    """Weights of all members for both fibres of ``nodes`` and their second derivatives."""
    # a node has a quarter of each of its shells: the size is theirs, also at edges
    size = np.sqrt(area[nodes])
    offset = points[member] - points[nodes][:, None]
    s, t = (np.einsum("kmi,ki->km", offset, frame[nodes, i]) / size[:, None] for i in range(2))
    warp, a_told = _derivative(s, t, 1)
    weft, b_told = _derivative(t, s, 1)
    warp_s, told = _derivative(s, t, 2)
    weft_t, other_told = _derivative(t, s, 2)
    told, other_told = told & a_told & b_told, other_told & a_told & b_told
    per_size = 1.0 / size[:, None]
    weight = np.stack([warp, weft, warp_s * told[:, None] * per_size, weft_t * other_told[:, None] * per_size], axis=1)
    return Stencils(nodes, member, weight * per_size[:, None], np.column_stack([told, other_told]))


def _derivative(s: Array, t: Array, order: int) -> tuple[Array, NDArray[np.bool_]]:
    """Weights (k, m) of members at ``s`` along and ``t`` across a yarn for a derivative along it; whether they exist.

    First derivatives are exact for linear, second ones for quadratic fields. Members on the line of the yarn are tried
    alone first, as if it went through them.
    """
    weight, told = _least(s, np.zeros_like(t), (np.abs(t) < ON_LINE).astype(float), order)
    rest = ~told
    if rest.any():
        weight[rest], told[rest] = _least(s[rest], t[rest], 1.0 / (NEAR + t[rest] ** 2), order)
    return weight, told


def _least(s: Array, t: Array, trust: Array, order: int) -> tuple[Array, NDArray[np.bool_]]:
    """Weights of least sum of (w / trust)^2 that give the derivative of ``order`` exactly; whether there are any."""
    one = np.ones_like(s)
    powers = [one, s] if order == 1 else [one, s, 0.5 * s**2]
    if t.any():  # off the line
        powers += [t] if order == 1 else [t, s * t, 0.5 * t**2]
    terms = np.stack(powers, axis=1)
    weight = trust * np.linalg.pinv(terms * trust[:, None], rcond=1e-9)[:, :, order]
    error = np.einsum("kjm,km->kj", terms, weight)
    error[:, order] -= 1.0
    return weight, (np.abs(error).max(axis=1) < EXACT) & (np.abs(weight).sum(axis=1) < LARGEST)


def _by_size(group: Stencils) -> list[Stencils]:
    """The stencils of a group with any second derivative, without members of no weight, by their size."""
    counts = (np.abs(group.weight).max(axis=1) > 0.0).sum(axis=1)
    found = []
    for m in np.unique(counts[group.told.any(axis=1)]):
        pick = np.flatnonzero((counts == m) & group.told.any(axis=1))
        weight = group.weight[pick]
        order = np.argsort(np.abs(weight).max(axis=1) == 0.0, axis=1, kind="stable")[:, :m]
        member = np.take_along_axis(group.member[pick], order, axis=1)
        weight = np.take_along_axis(weight, order[:, None], axis=2)
        found.append(Stencils(group.node[pick], member, weight, group.told[pick]))
    return found


def _in_blocks(
    points: Array, groups: list[Stencils], around: sparse.csr_matrix, area: Array, stiffness: Array
) -> Bends:
    """Arrays of the kernel: each group fills blocks of its own, in the order of its nodes."""
    member, weight, centre, told, first = [], [], [], [], [0]
    for group in groups:
        for start in range(0, len(group.node), BLOCK):
            lane = np.minimum(np.arange(start, start + BLOCK), len(group.node) - 1)
            real = np.arange(start, start + BLOCK) < len(group.node)
            member.append(group.member[lane].T)
            weight.append(group.weight[lane].transpose(2, 1, 0))
            centre.append(np.where(real, group.node[lane], -1))
            told.append(group.told[lane] & real[:, None])
            first.append(first[-1] + group.member.shape[1])
    if not member:
        return no_bends()
    members, (weights, spread) = np.concatenate(member), _spread(np.concatenate([_evened(w) for w in weight]))
    node, real = np.concatenate(centre), np.concatenate(told)
    rows = np.repeat(np.arange(len(member)), np.diff(first))
    alive = node.reshape(-1, BLOCK)[rows] >= 0
    node_start, node_entry = _entries(members, alive, len(points))
    shells, shell_start = _shells_round(node, around)
    return Bends(
        member=np.ascontiguousarray(members.astype(np.int32)),
        first=np.array(first, np.int64),
        weight=np.ascontiguousarray(weights).ravel(),
        spread=spread,
        force=np.zeros(3 * members.size),
        node_start=node_start,
        node_entry=node_entry,
        natural=_natural(points, members, weights, rows),
        stiffness=np.ascontiguousarray((real * stiffness).T * area[node]),
        alive=(node >= 0).astype(float),
        around=shells,
        around_start=shell_start,
        broken=np.zeros(PARTITIONS),
    )


def _evened(weight: Array) -> Array:
    """``weight`` (m, 4, 64) of a block, or its mean for all stencils if all are that but for the unevenness of a sheet.

    All or none: means of sums that vanish vanish, so that a stencil still gives nothing of a sheet that moves.
    """
    mean = weight.mean(axis=2, keepdims=True)
    size = np.abs(mean).max(axis=0)
    return np.broadcast_to(mean, weight.shape) if (np.abs(weight - mean) <= UNEVEN * size).all() else weight


def _spread(weight: Array) -> tuple[Array, NDArray[np.int8]]:
    """``weight`` (n_rows, 4, 64) without rounding, and how each is spread: on even meshes most are alike, or 0."""
    size = np.abs(weight).max(axis=(0, 2))[:, None]
    weight = np.where(np.abs(weight) > ALIKE * size, weight, 0.0)
    alike = (np.abs(weight - weight[..., :1]) <= ALIKE * size).all(axis=2)
    weight = np.where(alike[..., None], weight[..., :1], weight)
    spread = np.where(alike, np.where(weight[..., 0] == 0.0, NOWHERE, SAME), OWN_EACH)
    return weight, spread.astype(np.int8)


def _entries(members: Index, alive: NDArray[np.bool_], n_nodes: int) -> tuple[Index, Index]:
    """For each node, where in ``force`` its entries are, in the order of the stencils (compressed rows)."""
    row, lane = np.nonzero(alive)
    node = members[row, lane]
    order = np.argsort(node, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(node, minlength=n_nodes))])
    return start.astype(np.int64), (row * 3 * BLOCK + lane)[order].astype(np.int64)


def _shells_round(node: Index, around: sparse.csr_matrix) -> tuple[NDArray[np.int32], Index]:
    """Shells round the node of each stencil as compressed rows; none for padding."""
    count = np.where(node >= 0, np.diff(around.indptr)[node], 0)
    start = np.concatenate([[0], np.cumsum(count)])
    shells = [around.indices[around.indptr[n] : around.indptr[n + 1]] for n in node if n >= 0]
    return np.concatenate(shells).astype(np.int32), start.astype(np.int64)


def _natural(points: Array, members: Index, weights: Array, block: Index) -> Array:
    """Curvatures at rest (2, n) [1/mm]: second derivatives along the part of one fibre across the other."""
    sums = np.zeros((int(block.max()) + 1, BLOCK, WEIGHTS, 3))
    np.add.at(sums, block, np.einsum("rwl,rlx->rlwx", weights, points[members]))
    a, b, *second = sums.reshape(-1, WEIGHTS, 3).transpose(1, 0, 2)
    found = []
    for along, other, change in ((a, b, second[0]), (b, a, second[1])):
        share = np.sum(along * other, axis=1) / np.sum(along**2, axis=1)
        found.append(np.sum(change * _unit(other - share[:, None] * along), axis=1))
    return np.stack(found)
