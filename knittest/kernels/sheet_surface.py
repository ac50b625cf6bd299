"""The surface of the shells with normals that do not jump, the place on it that faces a point, and the arrays of sheet
contact.

Normals at the nodes are those of the shells around them, weighted by area; n(u, v) interpolates them bilinearly, as the
patch x(u, v) does the nodes. A point x_s faces the place where x_s - x is along n. Neighbours share edges and normals,
so a point that slides from shell to shell sees no step, on either side of a bend (Yang, Laursen & Meng, 2005, average
normals for the same reason).
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from knittest.base.arrays import Array, Index
from knittest.kernels.shell_state import ALIVE, BLOCK, CORNER_ROWS, state_index
from knittest.kernels.vec import INLINE, KERNEL, PART, add, combine, cross, dot, rows3, scale, sub


class SheetMesh(NamedTuple):
    """Topology of the shells, which stays: ``neighbour`` (n_el, 4) is 4 e + k if corners c, c + 1 of a shell are edge k
    of shell e, -1 at an edge that is free; ``owner`` (n_nodes,) partition of each node; ``stiffness`` (n_nodes,)
    penalty of each [N/mm]. Shells that a node never touches: ``near`` from near_start[node] to near_start[node + 1].
    """

    neighbour: NDArray[np.int32]
    owner: Index
    stiffness: Array
    near_start: Index
    near: NDArray[np.int32]


class SheetContacts(NamedTuple):
    """A node against a shell, in the first ``count`` columns, sorted by node.

    ``node``, ``shell`` and the place ``uv`` (2, n) in [0, 1] on it, from corner 1 towards 2 and 4; ``side`` of the
    shell's normal on which the node belongs, 1 or -1; stretch of the sticking ``spring`` (2, n) in units of the shell's
    sides, so that it turns with the shell; ``slipping`` 1 while the contact slips; ``reach`` [mm] distance at which it
    touches, ``gap`` [mm] its distance, ``cut`` [mm] what the reach lost since it was found; ``force`` [N] and
    ``moment`` [N mm] on the node, (3, n); ``owners`` bits of the partitions whose nodes it loads, 0 where it does not
    touch; ``damping`` [N] is the viscous part of the last force.
    """

    node: Index
    shell: Index
    uv: Array
    side: Array
    spring: Array
    slipping: Array
    reach: Array
    gap: Array
    force: Array
    moment: Array
    owners: Index
    damping: Array
    cut: Array


class SheetLaw(NamedTuple):
    """``thickness`` [mm]; ``viscous`` coefficient over penalty [ms]; Coulomb coefficients before and while slipping."""

    thickness: float
    viscous: float
    static: float
    kinetic: float


def empty_contacts(capacity: int) -> SheetContacts:
    """Room for ``capacity`` contacts."""
    pair, triple = [np.zeros((2, capacity)) for _ in range(2)], [np.zeros((3, capacity)) for _ in range(2)]
    one, whole = [np.zeros(capacity) for _ in range(6)], [np.zeros(capacity, np.int64) for _ in range(3)]
    return SheetContacts(
        whole[0], whole[1], pair[0], one[0], pair[1], one[1], one[2], one[3], triple[0], triple[1], whole[2],
        one[4], one[5],
    )  # fmt: skip


#: a model whose sheets do not see each other
NO_MESH = SheetMesh(
    np.zeros((0, 4), np.int32), np.zeros(0, np.int64), np.zeros(0), np.zeros(1, np.int64), np.zeros(0, np.int32)
)
NO_LAW = SheetLaw(0.0, 0.0, 0.0, 0.0)


#: share of the flat area that a curved one keeps in the Newton step: where normals meet, places are not unique
LEAST_AREA = 0.1


@njit(**INLINE)
def weights(u, v):
    """Bilinear weights of the four corners."""
    return (1.0 - u) * (1.0 - v), u * (1.0 - v), u * v, (1.0 - u) * v


@njit(**INLINE)
def blend(w, p):
    """Sum of the four vectors ``p`` times the weights ``w``."""
    return add(combine(w[0], p[0], w[1], p[1]), combine(w[2], p[2], w[3], p[3]))


@njit(**INLINE)
def sides(p, u, v):
    """Derivatives of a bilinear field of corner values ``p`` along u and v."""
    along = combine(1.0 - v, sub(p[1], p[0]), v, sub(p[2], p[3]))
    return along, combine(1.0 - u, sub(p[3], p[0]), u, sub(p[2], p[1]))


@njit(**INLINE)
def shell_of(entry):
    """Shell to whose corner an entry of ``Shells.node_entry`` belongs."""
    return entry // (CORNER_ROWS * BLOCK) * BLOCK + entry % BLOCK


@njit(**PART)
def node_normal(n, position, shells):
    """Unit normal at node ``n`` of the living shells around it (3); zero if none lives."""
    x, y, z = rows3(position)
    total = (0.0, 0.0, 0.0)
    for i in range(shells.node_start[n], shells.node_start[n + 1]):
        e = shell_of(shells.node_entry[i])
        a, b, c, d = shells.conn[e, 0], shells.conn[e, 1], shells.conn[e, 2], shells.conn[e, 3]
        twice = cross((x[c] - x[a], y[c] - y[a], z[c] - z[a]), (x[d] - x[b], y[d] - y[b], z[d] - z[b]))
        total = combine(1.0, total, shells.state[state_index(e) + ALIVE], twice)
    return scale(1.0 / max(sqrt(dot(total, total)), 1e-30), total)


@njit(**INLINE)
def node_values(e, field, shells):
    """Values (3) of a (3, n) ``field`` at the four corners of shell ``e``."""
    x, y, z = rows3(field)
    a, b, c, d = shells.conn[e, 0], shells.conn[e, 1], shells.conn[e, 2], shells.conn[e, 3]
    return (x[a], y[a], z[a]), (x[b], y[b], z[b]), (x[c], y[c], z[c]), (x[d], y[d], z[d])


@njit(**PART)
def node_normals(e, position, shells):
    """Normals at the four corners of shell ``e``."""
    return (
        node_normal(shells.conn[e, 0], position, shells),
        node_normal(shells.conn[e, 1], position, shells),
        node_normal(shells.conn[e, 2], position, shells),
        node_normal(shells.conn[e, 3], position, shells),
    )


@njit(**INLINE)
def surface(p, m, u, v):
    """Point of the surface [mm] and its normal [-] from corners ``p`` and their normals ``m``."""
    w = weights(u, v)
    return blend(w, p), blend(w, m)


@njit(**PART)
def limits(e, mesh, shells):
    """Least and largest u and v on shell ``e``: 0 or 1 at a free edge, beyond where a neighbour goes on."""
    low_v, high_u, high_v, low_u = -1.0, 2.0, 2.0, -1.0
    if is_free(e, 0, mesh, shells):
        low_v = 0.0
    if is_free(e, 1, mesh, shells):
        high_u = 1.0
    if is_free(e, 2, mesh, shells):
        high_v = 1.0
    if is_free(e, 3, mesh, shells):
        low_u = 0.0
    return low_u, high_u, low_v, high_v


@njit(**INLINE)
def is_free(e, edge, mesh, shells):
    """Return whether no living shell goes on beyond an edge of shell ``e``."""
    other = mesh.neighbour[e, edge]
    return other < 0 or shells.state[state_index(np.int64(other) // 4) + ALIVE] == 0.0


@njit(**KERNEL)
def find_facing_place(p, m, point, u, v, bounds, rounds, most):
    """Place (u, v) whose normal goes through ``point``, within ``bounds``, from a first guess in ``rounds`` steps of at
    ``most`` so much.

    Newton's steps for x + h n = point; rounding keeps them from diverging where normals meet.
    """
    low_u, high_u, low_v, high_v = bounds
    for _ in range(rounds):
        x, n = surface(p, m, u, v)
        q = sub(point, x)
        h = dot(q, n) / max(dot(n, n), 1e-30)
        rest = combine(1.0, q, -h, n)
        (xu, xv), (nu, nv) = sides(p, u, v), sides(m, u, v)
        a, b = combine(1.0, xu, h, nu), combine(1.0, xv, h, nv)
        area = max(dot(cross(a, b), n), LEAST_AREA * dot(cross(xu, xv), n))
        inv = 1.0 / max(area, 1e-30)
        du, dv = inv * dot(cross(rest, b), n), inv * dot(cross(a, rest), n)
        u = min(max(u + min(max(du, -most), most), low_u), high_u)
        v = min(max(v + min(max(dv, -most), most), low_v), high_v)
    return u, v


@njit(**INLINE)
def separation(p, m, point, u, v, side, clamped):
    """Distance of ``point`` from the place (u, v) on its ``side`` [mm], unit direction to it (3) and its side.

    Round a free edge (``clamped``) the distance is that of the edge, and the side is where the point is.
    """
    x, n = surface(p, m, u, v)
    q = sub(point, x)
    n = scale(1.0 / max(sqrt(dot(n, n)), 1e-30), n)
    along = dot(q, n)
    size = sqrt(dot(q, q))
    if clamped and size > 1e-9:
        return size, scale(1.0 / size, q), 1.0 if along >= 0.0 else -1.0
    return side * along, scale(side, n), side
