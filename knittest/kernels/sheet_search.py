"""Search for nodes near shells, with a cell grid of the shells' centres.

Only where nodes moved by half the skin since they were last looked at is the list renewed. Pairs that are tracked keep
their place and spring; a shell beside one that a node faces already needs no look.
"""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.sheet_contact import is_clamped
from knittest.kernels.sheet_surface import find_facing_place, limits, node_normals, node_values, separation, surface
from knittest.kernels.shell_state import ALIVE, state_index
from knittest.kernels.vec import (
    ALLOCATING,
    GRID_ROWS,
    KERNEL,
    PART,
    combine,
    cross,
    dot,
    place_of,
    row_near,
    rows3,
    sub,
)

#: Newton steps that place a new contact from the middle of a shell, and the largest move in one
ROUNDS, LARGEST_STEP = 6, 0.3
#: how far beyond a shell's rim a node may lie that faces it, over the reach: the tangent of half the bend at its edges
LEAN = 0.5
#: place outside a shell that is still on it, and distance from the line along the normal over the reach: rounding
ON_SHELL, OFF_LINE = 1e-9, 1e-3


@njit(**KERNEL)
def shell_centres(position, conn, centre, half):
    """Fill centres (3, n_el) and the largest distance of a corner from each (n_el,), both in mm."""
    for e in range(half.size):
        far2 = 0.0
        for k in range(3):
            x = position[k]
            centre[k, e] = 0.25 * (x[conn[e, 0]] + x[conn[e, 1]] + x[conn[e, 2]] + x[conn[e, 3]])
        for c in range(4):
            i, d2 = conn[e, c], 0.0
            for k in range(3):
                d2 += (position[k, i] - centre[k, e]) ** 2
            far2 = max(far2, d2)
        half[e] = sqrt(far2)


@njit(**KERNEL)
def mark_cells(moved, conn, cell_of, shape, shell_moved, active):
    """Flag shells with a moved corner, (n_el,), and the cells within one of them, (n_cells,)."""
    for e in range(shell_moved.size):
        shell_moved[e] = moved[conn[e, 0]] or moved[conn[e, 1]] or moved[conn[e, 2]] or moved[conn[e, 3]]
        if shell_moved[e]:
            place = place_of(cell_of[e], shape)
            for row in range(GRID_ROWS):
                start, stop = row_near(place, shape, row)
                active[start:stop] = True


@njit(**PART)
def _copy(source, a, target, b):
    target.node[b], target.shell[b], target.owners[b] = source.node[a], source.shell[a], source.owners[a]
    target.side[b], target.slipping[b], target.reach[b] = source.side[a], source.slipping[a], source.reach[a]
    target.gap[b], target.damping[b], target.cut[b] = source.gap[a], source.damping[a], source.cut[a]
    for k in range(2):
        target.uv[k, b], target.spring[k, b] = source.uv[k, a], source.spring[k, a]
    for k in range(3):
        target.force[k, b], target.moment[k, b] = source.force[k, a], source.moment[k, a]


@njit(**PART)
def _is_near_listed(e, first, count, new, conn):
    """Return whether shell ``e`` is, or shares a corner with, the shell of a contact first..count."""
    for c in range(first, count):
        for a in range(4):
            for b in range(4):
                if conn[e, a] == conn[new.shell[c], b]:
                    return True
    return False


@njit(**PART)
def _keep_contacts(first, last, stamp, old, reach, shells, new, needed):
    """Copy the contacts first..last of one node that are still near; returns the number then in ``new``."""
    begin = needed
    for c in range(first, last):
        e = old.shell[c]
        if old.gap[c] > reach or stamp[e] == old.node[c] or shells.state[state_index(e) + ALIVE] == 0.0:
            continue
        if _is_near_listed(e, begin, min(needed, new.node.size), new, shells.conn):  # two ran into one place
            continue
        if needed < new.node.size:
            _copy(old, c, new, needed)
        needed += 1
    return needed


@njit(**PART)
def _may_face(point, e, centre, half, reach, nodes, shells):
    """Cheap look at whether the point may face shell ``e`` within ``reach``."""
    w = (point[0] - centre[0, e], point[1] - centre[1, e], point[2] - centre[2, e])
    away2 = dot(w, w)
    if away2 > (half[e] + reach) ** 2 or shells.state[state_index(e) + ALIVE] == 0.0:
        return False
    p = node_values(e, nodes.position, shells)
    n = cross(sub(p[2], p[0]), sub(p[3], p[1]))
    height2 = dot(w, n) ** 2 / max(dot(n, n), 1e-30)
    return away2 - height2 < (half[e] + LEAN * reach) ** 2


@njit(**PART)
def _find_place(point, e, nodes, shells, mesh):
    """Place, gap and side of a point that faces shell ``e``: (u, v, gap, side); side 0 if it does not."""
    p, m = node_values(e, nodes.position, shells), node_normals(e, nodes.position, shells)
    bounds = limits(e, mesh, shells)
    u, v = find_facing_place(p, m, point, 0.5, 0.5, bounds, ROUNDS, LARGEST_STEP)
    inside = u >= -ON_SHELL and u <= 1.0 + ON_SHELL and v >= -ON_SHELL and v <= 1.0 + ON_SHELL
    at_edge = is_clamped(u, v, bounds)
    x, n = surface(p, m, u, v)
    q = sub(point, x)
    off = combine(1.0, q, -dot(q, n) / max(dot(n, n), 1e-30), n)
    if not inside or (not at_edge and dot(off, off) > (OFF_LINE * sqrt(dot(q, q)) + ON_SHELL) ** 2):
        return u, v, 0.0, 0.0
    side = 1.0 if dot(q, n) >= 0.0 else -1.0
    gap, _, side = separation(p, m, point, u, v, side, at_edge)
    return u, v, gap, side


@njit(**PART)
def _add(c, i, e, place, thickness, new):
    u, v, gap, side = place
    new.node[c], new.shell[c], new.uv[0, c], new.uv[1, c] = i, e, u, v
    new.side[c], new.gap[c], new.reach[c] = side, gap, min(thickness, gap)
    new.slipping[c], new.damping[c], new.cut[c], new.owners[c] = 0.0, 0.0, 0.0, 0
    new.spring[:, c], new.force[:, c], new.moment[:, c] = 0.0, 0.0, 0.0


@njit(**PART)
def _cell(value, origin, cell, count):
    return min(max(int((value - origin) / cell), 0), count - 1)


@njit(**ALLOCATING)
def find_sheet_contacts(
    nodes, shells, mesh, moved, shell_moved, active, grid, centre, half, law, skin, old, count, new
):
    """Renew the list ``old`` of ``count`` contacts into ``new``; returns the number needed, which may exceed its room.

    ``grid`` (cell [mm], origin (3,), shape (3,), head, order) of the shells' centres as
    :func:`knittest.kernels.search.fill_cells` fills it; a cell is no smaller than the largest ``half`` plus reach.
    """
    cell, origin, shape, head, order = grid
    x, y, z = rows3(nodes.position)
    stamp, reach, needed, c = np.full(half.size, -1), law.thickness + skin, 0, 0
    for i in range(moved.size):
        first = c
        while c < count and old.node[c] == i:
            c += 1
        a, b = _cell(x[i], origin[0], cell, shape[0]), _cell(y[i], origin[1], cell, shape[1])
        d = _cell(z[i], origin[2], cell, shape[2])
        looked = moved[i] or active[(a * shape[1] + b) * shape[2] + d]
        if first == c and not looked:
            continue
        for k in range(mesh.near_start[i], mesh.near_start[i + 1]):
            stamp[mesh.near[k]] = i
        begin = needed
        needed = _keep_contacts(first, c, stamp, old, reach, shells, new, needed)
        if not looked:
            continue
        point = (x[i], y[i], z[i])
        for row in range(GRID_ROWS):
            start, stop = row_near((a, b, d), shape, row)
            for k in range(head[start], head[stop]):
                e = order[k]
                if stamp[e] == i or not (moved[i] or shell_moved[e]):
                    continue
                if not _may_face(point, e, centre, half, reach, nodes, shells):
                    continue
                if _is_near_listed(e, begin, min(needed, new.node.size), new, shells.conn):
                    continue
                place = _find_place(point, e, nodes, shells, mesh)
                if place[3] == 0.0 or place[2] > reach:
                    continue
                if needed < new.node.size:
                    _add(needed, i, e, place, law.thickness, new)
                needed += 1
    return needed
