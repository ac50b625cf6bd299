"""Contact of sheets with themselves and each other: a node against the surface of shells, penalty and friction.

The pair touches at the middle between the node and the mid-surface it faces. Slide and force are taken there, so they
turn and shift node and corners, and momentum and angular momentum are kept. Contacts store their own force; every
partition then collects those on its nodes in the order of the contacts, so the bits do not depend on the number of
threads.
"""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.sheet_surface import (
    blend,
    find_facing_place,
    is_free,
    limits,
    node_normals,
    node_values,
    separation,
    sides,
    weights,
)
from knittest.kernels.shell_state import ALIVE, state_index
from knittest.kernels.tool_contact import touch_force
from knittest.kernels.vec import ALLOCATING, INLINE, KERNEL, PART, add, combine, cross, dot, rows3, scale, sub

#: Newton steps a time step after the place on the surface
ROUNDS = 2
#: largest move of a place in one of them
TRACKING_STEP = 0.05
#: depth over the thickness that the curves of smooth surfaces may add in a step to what their points close
CURVED = 1e-3
#: sticking stiffness over the penalty
TANGENTIAL = 0.5


@njit(**INLINE)
def is_clamped(u, v, bounds):
    """Return whether a place lies on a free edge that ends its way."""
    return (
        (bounds[0] == 0.0 and u == 0.0)
        or (bounds[1] == 1.0 and u == 1.0)
        or (bounds[2] == 0.0 and v == 0.0)
        or (bounds[3] == 1.0 and v == 1.0)
    )


@njit(**INLINE)
def components_in_sides(vector, along, across):
    """Components of a vector in the plane of two sides."""
    aa, ab, bb = dot(along, along), dot(along, across), dot(across, across)
    fa, fb = dot(vector, along), dot(vector, across)
    inv = 1.0 / max(aa * bb - ab * ab, 1e-30)
    return inv * (bb * fa - ab * fb), inv * (aa * fb - ab * fa)


@njit(**INLINE)
def _crossed_edge(u, v):
    """Edge over which a place has left its shell (-1: none), how far along it [0, 1], how far over."""
    if v < 0.0:
        return 0, u, -v
    if u > 1.0:
        return 1, v, u - 1.0
    if v > 1.0:
        return 2, 1.0 - u, v - 1.0
    if u < 0.0:
        return 3, 1.0 - v, -u
    return -1, 0.0, 0.0


@njit(**INLINE)
def _place_at_edge(edge, along, inward):
    """Place (u, v) at a share ``along`` an edge and ``inward`` of it."""
    if edge == 0:
        return along, inward
    if edge == 1:
        return 1.0 - inward, along
    if edge == 2:
        return 1.0 - along, 1.0 - inward
    return inward, 1.0 - along


@njit(**PART)
def _never_touches(i, e, mesh):
    """Return whether node ``i`` never touches shell ``e``."""
    found = False
    for k in range(mesh.near_start[i], mesh.near_start[i + 1]):
        found |= mesh.near[k] == e
    return found


@njit(**PART)
def move_to_next_shell(c, nodes, shells, mesh, contacts):
    """Move a contact that left its shell to the neighbour, with the spring of its sticking.

    One that has nowhere to go gets an infinite gap: it carries nothing until the next search drops it.
    """
    e, u, v = contacts.shell[c], contacts.uv[0, c], contacts.uv[1, c]
    edge, along, over = _crossed_edge(u, v)
    if edge < 0 or is_free(e, edge, mesh, shells):
        return
    other = np.int64(mesh.neighbour[e, edge])
    if _never_touches(contacts.node[c], other // 4, mesh):  # it slid round a fold into its own surroundings
        contacts.gap[c] = np.inf
        return
    xu, xv = sides(node_values(e, nodes.position, shells), u, v)
    spring = combine(contacts.spring[0, c], xu, contacts.spring[1, c], xv)
    e = other // 4
    u, v = _place_at_edge(other % 4, 1.0 - along, over)
    xu, xv = sides(node_values(e, nodes.position, shells), u, v)
    contacts.shell[c], contacts.uv[0, c], contacts.uv[1, c] = e, u, v
    contacts.spring[0, c], contacts.spring[1, c] = components_in_sides(spring, xu, xv)


@njit(**INLINE)
def _release(c, contacts):
    """A contact that does not touch carries nothing and forgets its spring."""
    contacts.owners[c], contacts.slipping[c], contacts.damping[c] = 0, 0.0, 0.0
    contacts.spring[0, c], contacts.spring[1, c] = 0.0, 0.0


@njit(**INLINE)
def _node(field, i):
    x, y, z = rows3(field)
    return x[i], y[i], z[i]


@njit(**INLINE)
def penalty_at(c, w, shells, mesh, contacts):
    """Penalty [N/mm] of a contact: that of the lighter side."""
    e = contacts.shell[c]
    of_shell = 0.0
    for k in range(4):
        of_shell += w[k] * mesh.stiffness[shells.conn[e, k]]
    return min(mesh.stiffness[contacts.node[c]], of_shell)


@njit(**PART)
def follow_place(c, rounds, nodes, shells, mesh, law, contacts):
    """Follow the place of a contact; renews its gap and reach. Returns depth [mm] and direction to the node (3)."""
    e, point = contacts.shell[c], _node(nodes.position, contacts.node[c])
    p, m = node_values(e, nodes.position, shells), node_normals(e, nodes.position, shells)
    bounds = limits(e, mesh, shells)
    u, v = find_facing_place(p, m, point, contacts.uv[0, c], contacts.uv[1, c], bounds, rounds, TRACKING_STEP)
    gap, direction, side = separation(p, m, point, u, v, contacts.side[c], is_clamped(u, v, bounds))
    contacts.uv[0, c], contacts.uv[1, c], contacts.side[c], contacts.gap[c] = u, v, side, gap
    # a pair that was found too near touches from there on, so that it brings no energy
    contacts.reach[c] = min(law.thickness, max(contacts.reach[c], gap))
    contacts.cut[c] = min(contacts.cut[c], law.thickness - contacts.reach[c])
    return contacts.reach[c] - gap, direction


@njit(**INLINE)
def _limit_closing(c, depth, earlier, closing, law, contacts):
    """Depth [mm] that the sheets closed themselves, from the ``earlier`` one by ``closing``; the reach is cut to it.

    A place that runs along a fold, or normals that turn where shells fold onto each other, would make energy.
    """
    most = max(earlier, 0.0) + max(closing, 0.0)
    if depth > most + CURVED * law.thickness:
        contacts.reach[c] -= depth - most
        contacts.cut[c] += depth - most
        return most
    return depth


@njit(**PART)
def _press(c, depth, earlier, direction, dt, nodes, shells, mesh, law, contacts):
    """Force and moment of a contact that touches, ``earlier`` [mm] deep a step ago; returns the energies lost to
    friction and to damping [mJ].
    """
    i, e, u, v = contacts.node[c], contacts.shell[c], contacts.uv[0, c], contacts.uv[1, c]
    p, w = node_values(e, nodes.position, shells), weights(u, v)
    arm = sub(_node(nodes.position, i), blend(w, p))
    spin = add(_node(nodes.spin, i), blend(w, node_values(e, nodes.spin, shells)))
    speed = sub(_node(nodes.velocity, i), blend(w, node_values(e, nodes.velocity, shells)))
    before = combine(1.0, arm, -0.5 * dt, speed)  # the arm half a step ago, when the speeds were these
    slide = scale(dt, combine(1.0, speed, -0.5, cross(spin, before)))
    depth = _limit_closing(c, depth, earlier, -dt * dot(speed, direction), law, contacts)
    xu, xv = sides(p, u, v)
    spring = combine(contacts.spring[0, c], xu, contacts.spring[1, c], xv)
    stiffness = penalty_at(c, w, shells, mesh, contacts)
    viscous = law.viscous * stiffness
    force, pressure, spring, slips, lost, damped = touch_force(
        direction, slide, spring, depth, stiffness, viscous, TANGENTIAL * stiffness, sqrt(TANGENTIAL) * viscous,
        law.static, law.kinetic, contacts.slipping[c], dt,
    )  # fmt: skip
    # what damping took in this step is the mean of its force before and after
    damping = pressure - stiffness * depth
    damped -= 0.5 * (contacts.damping[c] - damping) * dot(slide, direction)
    contacts.slipping[c], contacts.damping[c] = slips, damping
    contacts.spring[0, c], contacts.spring[1, c] = components_in_sides(spring, xu, xv)
    moment = scale(-0.5, cross(arm, force))
    for k in range(3):
        contacts.force[k, c], contacts.moment[k, c] = force[k], moment[k]
    owners = 1 << mesh.owner[i]
    for k in range(4):
        owners |= 1 << mesh.owner[shells.conn[e, k]]
    contacts.owners[c] = owners
    return lost, damped


@njit(**KERNEL)
def sheet_forces(first, last, dt, nodes, shells, mesh, law, contacts):
    """Evaluate contacts first..last; returns the energies lost to friction and to contact damping [mJ]."""
    lost, damped = 0.0, 0.0
    for c in range(first, last):
        move_to_next_shell(c, nodes, shells, mesh, contacts)
        if contacts.gap[c] == np.inf or shells.state[state_index(contacts.shell[c]) + ALIVE] == 0.0:
            _release(c, contacts)
            continue
        before, earlier = contacts.gap[c], contacts.reach[c] - contacts.gap[c]
        depth, direction = follow_place(c, ROUNDS, nodes, shells, mesh, law, contacts)
        if depth > 0.0:
            rubbed, taken = _press(c, depth, earlier, direction, dt, nodes, shells, mesh, law, contacts)
            lost, damped = lost + rubbed, damped + taken
        else:
            damped += 0.5 * contacts.damping[c] * (before - contacts.gap[c])
            _release(c, contacts)
    return lost, damped


@njit(**INLINE)
def _load(i, push, turn, c, nodes, contacts):
    """Add shares of a contact's force and moment to node ``i``."""
    for k in range(3):
        nodes.force[k, i] += push * contacts.force[k, c]
        nodes.moment[k, i] += turn * contacts.moment[k, c]


@njit(**PART)
def scatter_sheet(partition, start, stop, count, nodes, shells, contacts):
    """Add the forces of the first ``count`` contacts on nodes start..stop, which are those of a partition."""
    bit = 1 << partition
    for c in range(count):
        if contacts.owners[c] & bit == 0:
            continue
        i, e = contacts.node[c], contacts.shell[c]
        if start <= i < stop:
            _load(i, 1.0, 1.0, c, nodes, contacts)
        w = weights(contacts.uv[0, c], contacts.uv[1, c])
        for k in range(4):
            i = shells.conn[e, k]
            if start <= i < stop:
                _load(i, -w[k], w[k], c, nodes, contacts)


@njit(**ALLOCATING)
def sheet_statistics(count, nodes, shells, mesh, law, contacts):
    """Elastic energy of the contacts [mJ], and penetration over half the thickness of those that touch (n_touching,).

    At the present positions; springs are those of the last step. What the reach was cut by counts as penetration.
    """
    energy, share, touching = 0.0, np.empty(count), 0
    for c in range(count):
        if contacts.owners[c] == 0:
            continue
        e, u, v = contacts.shell[c], contacts.uv[0, c], contacts.uv[1, c]
        p, m = node_values(e, nodes.position, shells), node_normals(e, nodes.position, shells)
        at_edge = is_clamped(u, v, limits(e, mesh, shells))
        gap = separation(p, m, _node(nodes.position, contacts.node[c]), u, v, contacts.side[c], at_edge)[0]
        depth = max(contacts.reach[c] - gap, 0.0)
        xu, xv = sides(p, u, v)
        spring = combine(contacts.spring[0, c], xu, contacts.spring[1, c], xv)
        stiffness = penalty_at(c, weights(u, v), shells, mesh, contacts)
        energy += 0.5 * stiffness * (depth * depth + TANGENTIAL * dot(spring, spring))
        share[touching] = 2.0 * (depth + contacts.cut[c]) / law.thickness
        touching += 1
    return energy, share[:touching]
