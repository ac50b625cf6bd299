"""Bending of the fibres in the plane of the shells as stencils, and the critical step and rotary inertia of the
shells.

At every node through which a yarn goes on, weights of the nodes of the shells round it give both fibres and their
second derivatives along themselves. Where nodes lie on the line of the yarn, on meshes along the yarns and on squares
at 45 degrees to them, these alone bear weight: second differences. Elsewhere all nodes do, by the least weights, mostly
beside the line, that are exact for quadratic displacements. Where the mesh does not determine them, at free edges that
the yarns leave, nothing bends; nor at seams where directions jump and edges where the sheet is folded.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from knittest.base.arrays import Array, Flags, Index
from knittest.kernels.in_plane import BLOCK, NOWHERE, OWN_EACH, SAME, WEIGHTS, Bends, add_bounds, no_bends
from knittest.kernels.shell_state import (
    ALONG_A,
    ALONG_B,
    ALPHA_A,
    ALPHA_B,
    AREA,
    BETA_A,
    BETA_B,
    C31,
    C42,
    LEAN_A,
    LEAN_B,
    SHAPE,
    STATE_ROWS,
    Laminate,
    Shells,
)
from knittest.kernels.shell_state import BLOCK as SHELL_BLOCK
from knittest.kernels.vec import PARTITIONS

# Bounds of the squared frequency that the fibres' bending in the plane adds: at rest, and in any state.
#
# Nodes without mass are held. The bound of a stencil is that of :mod:`knittest.kernels.in_plane`. At rest in a plane
# the difference to the natural curvature vanishes, and so does the second derivative along the normal.


def bend_bound(bends: Bends, mass: Array) -> float:
    """Bound at rest in a plane [1/ms^2], nodal masses ``mass`` [g]: row sums over mass.

    A stencil's curvature is across its fibre, those of warp and weft may lie in one line where shear has closed them.
    """
    second = np.abs(bends.weight.reshape(-1, WEIGHTS, BLOCK)[:, 2:])
    rows, size = np.zeros(bends.member.shape), np.diff(bends.first)
    for family, stiffness in enumerate(bends.stiffness.reshape(2, -1, BLOCK)):
        u = second[:, family]
        sums = np.add.reduceat(u, bends.first[:-1], axis=0)  # over each block
        rows += u * np.repeat(sums * stiffness, size, axis=0)
    total = np.bincount(bends.member.ravel(), rows.ravel(), len(mass)).astype(float)
    return float(_divide_by_mass(total, mass).max(initial=0.0))


def bend_bound_now(bends: Bends, position: Array, mass: Array) -> tuple[float, int]:
    """Bound [1/ms^2] in the state of ``position`` (3, n) [mm], and the node where it is."""
    rows = np.zeros(len(mass))
    add_bounds(position, bends, rows)
    found = _divide_by_mass(rows, mass)
    return float(found.max(initial=0.0)), int(found.argmax())


def _divide_by_mass(rows: Array, mass: Array) -> Array:
    """Row sums of each node over its mass, (n_nodes,)."""
    return np.divide(rows, mass, out=np.zeros(len(mass)), where=mass > 0.0)


# Critical time step and rotary inertia of the shells from bounds on each element's stiffness.
#
# The energy of an element is a sum of squares k s^2 / 2 of strains s, each linear in the corners' motion near any
# state, so its stiffness is the highest eigenvalue of the matrix sqrt(k k') grad s . grad s', which no row sum of
# absolute values is below. The gradient of a fibre strain is a pattern of the corners, which does not change when the
# element distorts, times the fibre's direction. The patterns of warp, weft and hourglass control of a rectangle are
# orthogonal, so its stiffness is that of the stiffest and not the sum. Poisson coupling c e_a e_b is at most c (r e_a^2
# + e_b^2 / r) / 2, with r^2 the ratio of both stiffnesses. Not in the bound: an hourglass pattern as large as a tenth
# of the side adds some per cent to the squared frequency, a seventh where its control governs; shear that is as stiff
# as a fibre, whose force turns with it and whose gradients grow where fibres shorten, adds up to 0.45 in a distorted
# element (a fabric's is a thousandth). A safety factor of 0.9 leaves a quarter.
#
# A law with a kink at rest is no sum of squares: a fibre that rattles about it gains energy at random, as a ball does
# that bounces on a spring, because each bounce falls between steps as it may. The map of a bounce keeps areas, so its
# gain is 1 at the least on average: 1.03 at 0.55, 1.07 at 0.75, 1.3 at 0.8, 2.1 at 0.9 of the spring's critical step.

#: multiple of its stiffness that a kink counts as, so that a step of 0.9 is 0.55 of what the bounce would bear
KINK = (0.9 / 0.55) ** 2
#: rotations may add this share to the highest eigenvalue, so that they never govern the step
ROTARY_SHARE = 0.1


def rotary_inertia(translation: Array, rotation: Array, thickness: float) -> Array:
    """Rotary inertia per mass [mm^2]: that of the plate, t^2 / 12, or more where rotations would govern."""
    return np.maximum(thickness**2 / 12.0, rotation / (ROTARY_SHARE * translation))


def highest_stiffness(
    laminate: Laminate, position: Array, conn: NDArray[np.integer], shells: Shells
) -> tuple[Array, Array, Array]:
    """Bounds of each element's stiffness against translation [N/mm] and rotation [N mm], and its area, (n_el,) each."""
    row = element_rows(shells, len(conn))
    area, shape = row(AREA), row(SHAPE)
    distortion = 4.0 + 2.0 * (row(C31) ** 2 + row(C42) ** 2)
    corners = position[conn]
    x31, x42 = (np.sum((corners[:, i] - corners[:, j]) ** 2, axis=1) for i, j in ((2, 0), (3, 1)))
    edges = np.sum((corners - np.roll(corners, 1, axis=1)) ** 2, axis=(1, 2))
    rotation = shape * (2.0 * distortion * laminate.hourglass_bending + 0.5 * edges * laminate.hourglass_transverse)
    # shares of the patterns (-1, 0, 1, 0) and (0, -1, 0, 1); that of the hourglass control adds (1, -1, 1, -1)
    patterns = ((row(ALPHA_A), row(BETA_A)), (row(ALPHA_B), row(BETA_B)), (row(C31), row(C42)))
    tangent = [_largest_tangent(laminate, i) for i in range(2)]
    if laminate.energy is not None:
        tangent = np.maximum(laminate.energy_tangents[0], KINK * laminate.energy_tangents[1]).tolist()
    bent = [2.0 * float(laminate.outer[i]) * laminate.layer_offset**2 for i in range(2)]
    tangent = _bounding_stiffnesses(tangent, laminate.coupling_membrane)
    bent = _bounding_stiffnesses(bent, laminate.coupling_bending)
    stiffness = [area * (tangent[i] + laminate.transverse[i]) for i in range(2)]
    # of both fibres, as shear may turn one onto the other
    control = row(ALONG_A) * laminate.hourglass_fibre[0] + row(ALONG_B) * laminate.hourglass_fibre[1]
    control = control + (row(LEAN_A) + row(LEAN_B)) * laminate.hourglass_shear
    translation = _largest_row_sum(patterns, [*stiffness, control]) + 8.0 * shape * laminate.hourglass_transverse
    # warp turned against weft: gradients of both, which add where the fibres lean and an element is no rectangle
    lean = np.abs(row(ALPHA_A) * row(ALPHA_B) + row(BETA_A) * row(BETA_B))
    stick = laminate.shear_stick if laminate.shear_friction > 0.0 else 0.0
    shear_tangent = (1.0 - laminate.shear_friction) * float(np.cumsum(laminate.shear_slope).max()) + stick
    for i, (alpha, beta) in enumerate(patterns[:2]):
        gradient2 = 2.0 * (alpha**2 + beta**2)
        translation += area * (gradient2 + 2.0 * lean) * shear_tangent
        bending = bent[i] + 2.0 * laminate.twist
        rotation += area * (gradient2 * bending + 0.5 * laminate.transverse[i] * (alpha**2 * x31 + beta**2 * x42))
        # a turn is that of the fibres less that of the corner: its square is at most twice the sum of both squares
        translation += 0.5 * area * laminate.drilling * gradient2
    return translation, rotation + 0.5 * area * laminate.drilling, area


def _bounding_stiffnesses(stiffness: list[float], coupling: float) -> list[float]:
    """Two uncoupled stiffnesses that are at least two coupled ones in every state."""
    ratio = np.sqrt(stiffness[0] / stiffness[1]) if coupling != 0.0 else 1.0
    return [stiffness[0] + abs(coupling) * ratio, stiffness[1] + abs(coupling) / ratio]


def element_rows(shells: Shells, n_el: int) -> Callable[[np.integer], Array]:
    """Function that returns an element constant (n_el,) by its row."""
    blocks = shells.state.reshape(-1, STATE_ROWS, SHELL_BLOCK)
    return lambda start: blocks[:, int(start) // SHELL_BLOCK].ravel()[:n_el]


def _largest_row_sum(patterns: Sequence[tuple[Array, Array]], stiffness: Sequence[Array]) -> Array:
    """Largest sum over j of sqrt(k_i k_j) |p_i . p_j| of the elements' patterns, the last of hourglass control."""
    sums = []
    for i, (p, k) in enumerate(zip(patterns, stiffness, strict=True)):
        total = 4.0 * k if i == len(patterns) - 1 else 0.0 * k
        for q, other in zip(patterns, stiffness, strict=True):
            total = total + 2.0 * np.sqrt(k * other) * np.abs(p[0] * q[0] + p[1] * q[1])
        sums.append(total)
    return np.max(sums, axis=0)


def _largest_tangent(laminate: Laminate, direction: int) -> float:
    """Largest tangent of the membrane force, pulled or pushed, along the fibre [N/mm], or :data:`KINK` times the kink
    between both at rest.

    Across it resists by the force over the stretch, which stays below: the force is at most this times the strain.
    """
    tangent = 2.0 * laminate.outer[direction] + np.cumsum(laminate.slope[direction])
    pushed = 2.0 * float(laminate.outer[direction]) + float(laminate.compression[direction])
    pulled = laminate.slope[direction][laminate.knee[direction] <= 0.0].sum()
    kink = abs(float(pulled) - float(laminate.compression[direction]))
    return max(float(tangent.max()), pushed, KINK * kink)


#: nodes nearer to the line of a yarn than this share of the size of the shells are on it
ON_LINE = 0.02
#: largest error of a stencil's derivatives of linear and quadratic fields, in sizes of shells
EXACT = 1e-6
#: largest sum of the sizes of a stencil's weights, in sizes of shells (4 for a second difference): more come from a
#: mesh that determines the derivative by its own unevenness only
LARGEST = 12.0
#: how much less a node off the line bears: weights are least in the sum of w^2 (NEAR + distance^2)^2
NEAR = 0.1
#: difference of weights, over the largest, that is rounding
ALIKE = 1e-9
#: difference that counts as unevenness of the sheet and is averaged over a block: a slope of 0.05, as of heights of
#: 0.05 mm on shells of 2 mm, shortens sides by 1e-3
UNEVEN = 2e-3
#: least cosine of the angle between a shell and the mean round a node: below, directions jump at a seam, or normals
#: at a fold
SEAM, FOLD = 0.94, 0.7


class Stencils(NamedTuple):
    """Stencils of equal size: ``node`` (n,), ``member`` (n, m) nodes, ``weight`` (n, 4, m) as in :class:`Bends`, and
    whether a second derivative of warp and weft is ``known`` (n, 2).
    """

    node: Index
    member: Index
    weight: Array
    known: Flags


def build_bends(points: Array, cells: Index, shells: Shells, stiffness: Array) -> Bends:
    """Stencils of shells at rest in ``points`` (n, 3) [mm] with corners ``cells`` (n_el, 4).

    ``stiffness`` of warp and weft (2,) [N mm]: that of a yarn over the distance of the yarns; zeros build nothing.
    """
    if stiffness.max() <= 0.0:
        return no_bends()
    corner = (cells.ravel(), np.repeat(np.arange(len(cells)), 4))
    around = sparse.csr_matrix((np.ones(cells.size), corner), (len(points), len(cells)))  # 1 where a node is a corner
    frame, area, whole = _frames(points, cells, shells, around)
    stencils = [_stencils(points, nodes, member, frame, area) for nodes, member in _rings(around, whole)]
    return _build_blocks(points, [s for group in stencils for s in _group_by_size(group)], around, area, stiffness)


def _frames(points: Array, cells: Index, shells: Shells, around: sparse.csr_matrix) -> tuple[Array, Array, Flags]:
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


def _rings(around: sparse.csr_matrix, whole: Flags) -> list[tuple[Index, Index]]:
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
    warp, a_known = _derivative(s, t, 1)
    weft, b_known = _derivative(t, s, 1)
    warp_s, known = _derivative(s, t, 2)
    weft_t, also = _derivative(t, s, 2)
    known, also = known & a_known & b_known, also & a_known & b_known
    per_size = 1.0 / size[:, None]
    weight = np.stack([warp, weft, warp_s * known[:, None] * per_size, weft_t * also[:, None] * per_size], axis=1)
    return Stencils(nodes, member, weight * per_size[:, None], np.column_stack([known, also]))


def _derivative(s: Array, t: Array, order: int) -> tuple[Array, Flags]:
    """Weights (k, m) of members at ``s`` along and ``t`` across a yarn for a derivative along it; whether they exist.

    First derivatives are exact for linear, second ones for quadratic fields. Members on the line of the yarn are tried
    alone first, as if it went through them.
    """
    weight, known = _least_weights(s, np.zeros_like(t), (np.abs(t) < ON_LINE).astype(float), order)
    rest = ~known
    if rest.any():
        weight[rest], known[rest] = _least_weights(s[rest], t[rest], 1.0 / (NEAR + t[rest] ** 2), order)
    return weight, known


def _least_weights(s: Array, t: Array, trust: Array, order: int) -> tuple[Array, Flags]:
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


def _group_by_size(group: Stencils) -> list[Stencils]:
    """The stencils of a group with any second derivative, without members of no weight, by their size."""
    counts = (np.abs(group.weight).max(axis=1) > 0.0).sum(axis=1)
    found = []
    for m in np.unique(counts[group.known.any(axis=1)]):
        pick = np.flatnonzero((counts == m) & group.known.any(axis=1))
        weight = group.weight[pick]
        order = np.argsort(np.abs(weight).max(axis=1) == 0.0, axis=1, kind="stable")[:, :m]
        member = np.take_along_axis(group.member[pick], order, axis=1)
        weight = np.take_along_axis(weight, order[:, None], axis=2)
        found.append(Stencils(group.node[pick], member, weight, group.known[pick]))
    return found


def _build_blocks(
    points: Array, groups: list[Stencils], around: sparse.csr_matrix, area: Array, stiffness: Array
) -> Bends:
    """Arrays of the kernel: each group fills blocks of its own, in the order of its nodes."""
    member, weight, centre, known, first = [], [], [], [], [0]
    for group in groups:
        for start in range(0, len(group.node), BLOCK):
            lane = np.minimum(np.arange(start, start + BLOCK), len(group.node) - 1)
            real = np.arange(start, start + BLOCK) < len(group.node)
            member.append(group.member[lane].T)
            weight.append(group.weight[lane].transpose(2, 1, 0))
            centre.append(np.where(real, group.node[lane], -1))
            known.append(group.known[lane] & real[:, None])
            first.append(first[-1] + group.member.shape[1])
    if not member:
        return no_bends()
    members, (weights, spread) = (
        np.concatenate(member),
        _round_weights(np.concatenate([_even_weights(w) for w in weight])),
    )
    node, real = np.concatenate(centre), np.concatenate(known)
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
        natural=_natural_curvatures(points, members, weights, rows),
        stiffness=np.ascontiguousarray((real * stiffness).T * area[node]),
        alive=(node >= 0).astype(float),
        around=shells,
        around_start=shell_start,
        broken=np.zeros(PARTITIONS),
    )


def _even_weights(weight: Array) -> Array:
    """``weight`` (m, 4, 64) of a block, or its mean for all stencils if all are that but for the unevenness of a sheet.

    All or none: means of sums that vanish vanish, so that a stencil still gives nothing of a sheet that moves.
    """
    mean = weight.mean(axis=2, keepdims=True)
    size = np.abs(mean).max(axis=0)
    return np.broadcast_to(mean, weight.shape) if (np.abs(weight - mean) <= UNEVEN * size).all() else weight


def _round_weights(weight: Array) -> tuple[Array, NDArray[np.int8]]:
    """``weight`` (n_rows, 4, 64) without rounding, and how each is spread: on even meshes most are alike, or 0."""
    size = np.abs(weight).max(axis=(0, 2))[:, None]
    weight = np.where(np.abs(weight) > ALIKE * size, weight, 0.0)
    alike = (np.abs(weight - weight[..., :1]) <= ALIKE * size).all(axis=2)
    weight = np.where(alike[..., None], weight[..., :1], weight)
    spread = np.where(alike, np.where(weight[..., 0] == 0.0, NOWHERE, SAME), OWN_EACH)
    return weight, spread.astype(np.int8)


def _entries(members: Index, alive: Flags, n_nodes: int) -> tuple[Index, Index]:
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


def _natural_curvatures(points: Array, members: Index, weights: Array, block: Index) -> Array:
    """Curvatures at rest (2, n) [1/mm]: second derivatives along the part of one fibre across the other."""
    sums = np.zeros((int(block.max()) + 1, BLOCK, WEIGHTS, 3))
    np.add.at(sums, block, np.einsum("rwl,rlx->rlwx", weights, points[members]))
    a, b, *second = sums.reshape(-1, WEIGHTS, 3).transpose(1, 0, 2)
    found = []
    for along, other, change in ((a, b, second[0]), (b, a, second[1])):
        share = np.sum(along * other, axis=1) / np.sum(along**2, axis=1)
        found.append(np.sum(change * _unit(other - share[:, None] * along), axis=1))
    return np.stack(found)
