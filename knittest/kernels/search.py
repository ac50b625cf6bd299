"""Neighbour search for yarn contact: crossings found with a cell grid and tracked from step to step.

Only pieces that moved by some share of the skin since they were last looked at are searched again, so a few recoiling
yarns do not cost a search over the whole fabric.
"""

from math import sqrt

import numpy as np
from numba import njit

from knittest.kernels.contact import closest_step
from knittest.kernels.options import INLINE, KERNEL
from knittest.kernels.rows import rows3, rows4

#: pieces within this angle of parallel (14 degrees) are line contacts: sin^2
PARALLEL_SIN2 = 0.06
#: Newton steps that place a new crossing
NEWTON_STEPS = 4
#: share of the way that calls for a search from which on pieces are looked at along with it
SOON = 0.5
#: distance along both yarns [elements] within which a found crossing is the tracked one, and two tracked ones merge
SAME = 0.9
MERGE = 0.25


@njit(**KERNEL)
def fill_cells(x, y, z, is_piece, cell, origin, shape, head, order):
    """Counting sort of pieces into cubic cells; ``head`` (n_cells + 1,) starts, ``order`` piece numbers by cell."""
    head[:] = 0
    n = is_piece.size
    cell_of = np.full(n, -1, np.int64)
    for i in range(n):
        if is_piece[i]:
            a = int((x[i] - origin[0]) / cell)
            b = int((y[i] - origin[1]) / cell)
            c = int((z[i] - origin[2]) / cell)
            cell_of[i] = (a * shape[1] + b) * shape[2] + c
            head[cell_of[i] + 1] += 1
    for c in range(head.size - 1):
        head[c + 1] += head[c]
    cursor = head[:-1].copy()
    for i in range(n):
        if cell_of[i] >= 0:
            order[cursor[cell_of[i]]] = i
            cursor[cell_of[i]] += 1
    return cell_of


@njit(**KERNEL)
def flag_moved(nodes, since, ahead, limit, moved):
    """Count nodes that moved, or will within ``ahead`` [ms], by ``limit`` [mm] from ``since`` (3, n).

    Fills ``moved`` (n,) with those that went :data:`SOON` of it, whose turn would come next: a search goes through all
    lists whatever it looks for. Returns the count and the largest speed [mm/ms].
    """
    x, y, z = rows3(nodes.position)
    x0, y0, z0 = rows3(since)
    vx, vy, vz = rows3(nodes.velocity)
    count, fastest2 = 0, 0.0
    for i in range(moved.size):
        speed2 = vx[i] ** 2 + vy[i] ** 2 + vz[i] ** 2
        distance = sqrt((x[i] - x0[i]) ** 2 + (y[i] - y0[i]) ** 2 + (z[i] - z0[i]) ** 2)
        reached = distance + sqrt(speed2) * ahead
        moved[i] = reached >= SOON * limit
        count += reached >= limit
        fastest2 = max(fastest2, speed2)
    return count, sqrt(fastest2)


@njit(**KERNEL)
def piece(x, y, z, i):
    """Coefficients c0, c1, c2 (each 3) of spline piece ``i``: c(s) = c0 + s c1 + s^2 c2."""
    ux, uy, uz = x[i] - x[i - 1], y[i] - y[i - 1], z[i] - z[i - 1]
    return (
        0.5 * (x[i] + x[i - 1]), 0.5 * (y[i] + y[i - 1]), 0.5 * (z[i] + z[i - 1]), ux, uy, uz,
        0.5 * (x[i + 1] - x[i] - ux), 0.5 * (y[i + 1] - y[i] - uy), 0.5 * (z[i + 1] - z[i] - uz),
    )  # fmt: skip


@njit(**INLINE)
def _along(x, y, z, i, wx, wy, wz):
    """Bound of how far piece ``i`` reaches from its middle along ``w``, times the length of that."""
    chord = (x[i + 1] - x[i - 1]) * wx + (y[i + 1] - y[i - 1]) * wy + (z[i + 1] - z[i - 1]) * wz
    bow = (x[i + 1] + x[i - 1] - 2.0 * x[i]) * wx + (y[i + 1] + y[i - 1] - 2.0 * y[i]) * wy
    bow += (z[i + 1] + z[i - 1] - 2.0 * z[i]) * wz
    return 0.25 * abs(chord) + 0.125 * abs(bow)


@njit(**INLINE)
def _apart(x, y, z, i, j, gap):
    """Whether a slab of thickness ``gap`` [mm] across the line of their middles separates pieces i and j.

    About the middle a piece is c(s) = m + (s - 1/2) (P[i+1] - P[i-1])/2 + (s - 1/2)^2 (P[i+1] - 2 P[i] + P[i-1])/2.
    """
    wx = 0.125 * (x[i - 1] + x[i + 1] - x[j - 1] - x[j + 1]) + 0.75 * (x[i] - x[j])
    wy = 0.125 * (y[i - 1] + y[i + 1] - y[j - 1] - y[j + 1]) + 0.75 * (y[i] - y[j])
    wz = 0.125 * (z[i - 1] + z[i + 1] - z[j - 1] - z[j + 1]) + 0.75 * (z[i] - z[j])
    length2 = wx * wx + wy * wy + wz * wz
    reach = _along(x, y, z, i, wx, wy, wz) + _along(x, y, z, j, wx, wy, wz)
    return length2 - reach > gap * sqrt(length2)


@njit(**KERNEL)
def crossing(x, y, z, i, j):
    """Closest points of pieces i and j: (s, t, offset (3), line flag); parameters may leave [0, 1)."""
    ax, ay, az, ux, uy, uz, px, py, pz = piece(x, y, z, i)
    bx, by, bz, vx, vy, vz, qx, qy, qz = piece(x, y, z, j)
    s, t = 0.5, 0.5
    mx, my, mz = ux + px, uy + py, uz + pz
    nx, ny, nz = vx + qx, vy + qy, vz + qz
    mn = mx * nx + my * ny + mz * nz
    lengths = (mx * mx + my * my + mz * mz) * (nx * nx + ny * ny + nz * nz)
    line = 1.0 if mn * mn > (1.0 - PARALLEL_SIN2) * lengths else 0.0
    wx, wy, wz = 0.0, 0.0, 0.0
    for step in range(NEWTON_STEPS + 1):
        wx = ax - bx + s * (ux + s * px) - t * (vx + t * qx)
        wy = ay - by + s * (uy + s * py) - t * (vy + t * qy)
        wz = az - bz + s * (uz + s * pz) - t * (vz + t * qz)
        if step < NEWTON_STEPS:
            ds, dt = closest_step(
                wx, wy, wz, ux + 2 * s * px, uy + 2 * s * py, uz + 2 * s * pz,
                vx + 2 * t * qx, vy + 2 * t * qy, vz + 2 * t * qz,
                2 * px, 2 * py, 2 * pz, 2 * qx, 2 * qy, 2 * qz, line,
            )  # fmt: skip
            s, t = s - ds, t - dt
    return s, t, wx, wy, wz, line


@njit(**KERNEL)
def _copy(source, a, target, b):
    for side in range(2):
        target.piece[side, b], target.parameter[side, b] = source.piece[side, a], source.parameter[side, a]
    for k in range(3):
        target.spring[k, b], target.offset[k, b] = source.spring[k, a], source.offset[k, a]
        target.force[k, b] = source.force[k, a]
    target.slipping[b], target.line[b] = source.slipping[a], source.line[a]
    target.reach[b], target.arm[b] = source.reach[a], source.arm[a]


@njit(**KERNEL)
def _tracked(contacts, head, following, chain, i, j, s, t, line, near):
    """Number of the contact in the lists ``head`` within ``near`` elements of the crossing (i + s, j + t), or -1."""
    for ii in range(max(i - 1, 0), min(i + 2, chain.size)):
        c = head[ii]
        while c >= 0:
            if (
                contacts.line[c] == line
                and chain[contacts.piece[0, c]] == chain[i]
                and chain[contacts.piece[1, c]] == chain[j]
                and abs(contacts.piece[0, c] + contacts.parameter[0, c] - i - s) < near
                and abs(contacts.piece[1, c] + contacts.parameter[1, c] - j - t) < near
            ):
                return c
            c = following[c]
    return -1


@njit(**KERNEL)
def _push(contacts, c, head, following):
    following[c] = head[contacts.piece[0, c]]
    head[contacts.piece[0, c]] = c


@njit(**KERNEL)
def keep_contacts(old, count, radius, chain, alive, moved, skin, new, head, following):
    """Copy tracked contacts that are still near into ``new`` and its lists; returns how many.

    Two contacts that ran into the same crossing become one. A reach that was cut when the contact was found inside
    (see :func:`find_contacts`) grows back as the gap opens.
    """
    kept = 0
    for c in range(count):
        s, t = old.parameter[0, c], old.parameter[1, c]
        i, j, line = old.piece[0, c], old.piece[1, c], old.line[c]
        if s < -0.5 or s > 1.5 or t < -0.5 or t > 1.5 or (line == 1.0 and (moved[i] or moved[j])):
            continue
        if alive[i - 1] * alive[i] * alive[j - 1] * alive[j] == 0.0:
            continue
        gap = sqrt(old.offset[0, c] ** 2 + old.offset[1, c] ** 2 + old.offset[2, c] ** 2)
        if gap >= old.reach[c] + skin:
            continue
        reach = min(radius[i] + radius[j], max(old.reach[c], gap))
        same = _tracked(new, head, following, chain, i, j, s, t, line, MERGE)
        if same >= 0:
            new.reach[same] = max(new.reach[same], reach)
            continue
        _copy(old, c, new, kept)
        new.reach[kept] = reach
        _push(new, kept, head, following)
        kept += 1
    return kept


@njit(**KERNEL)
def _add_contact(i, j, s, t, wx, wy, wz, line, touch, arm, old, before, new, c):
    """Write contact ``c``; it inherits the spring of ``before`` in ``old`` unless that is -1.

    One of the same pieces goes on where it was. Any other looks back on no step: its offset is the present one, and
    without a force the kernel counts no turn of its surfaces as slide.
    """
    reach = min(touch, sqrt(wx * wx + wy * wy + wz * wz))
    new.spring[:, c], new.slipping[c] = 0.0, 0.0
    goes_on = False
    if before >= 0:
        _copy(old, before, new, c)
        reach = min(touch, max(reach, new.reach[c]))
        goes_on = new.piece[0, c] == i and new.piece[1, c] == j
    if not goes_on:
        new.force[:, c] = 0.0
        new.piece[0, c], new.piece[1, c] = i, j
        new.parameter[0, c], new.parameter[1, c] = s, t
        new.offset[0, c], new.offset[1, c], new.offset[2, c] = wx, wy, wz
    new.reach[c], new.arm[c], new.line[c] = reach, arm, line


@njit(**KERNEL)
def _by_cell(x, y, z, radius, half_piece, order, used):
    """Position and extent [mm] of the first ``used`` pieces of ``order``, (4, used): a cell's are neighbours there."""
    sorted_ = np.empty((4, used))
    for k in range(used):
        i = order[k]
        sorted_[0, k], sorted_[1, k], sorted_[2, k] = x[i], y[i], z[i]
        sorted_[3, k] = radius[i] + half_piece[i]
    return sorted_


@njit(**KERNEL)
def find_contacts(x, y, z, group, chain, alive, moved, cell_of, shape, head, order, skin, old, old_count, new):
    """Crossings and line contacts with a gap below ``skin`` [mm]; tracked ones keep parameters and springs.

    ``group`` holds radius and half piece length [mm] and the pieces along a yarn that never touch, each (n_nodes,);
    ``cell_of``, ``shape``, ``head``, ``order`` the grid of :func:`fill_cells`. A pair found overlapping (at the start,
    or where a broken end slid in) touches from its present gap on, so that it brings no energy. Returns the number
    needed, which may exceed the capacity of ``new``; nothing is dropped.
    """
    radius, half_piece, exclude = group
    n = chain.size
    lists, old_lists = np.full(n, -1), np.full(n, -1)
    following, old_following = np.empty(new.reach.size, np.int64), np.empty(old.reach.size, np.int64)
    for c in range(old_count):
        _push(old, c, old_lists, old_following)
    needed = keep_contacts(old, old_count, radius, chain, alive, moved, skin, new, lists, following)
    px, py, pz, extent = rows4(_by_cell(x, y, z, radius, half_piece, order, head[-1]))
    for q in range(n):
        if not moved[q] or cell_of[q] < 0 or alive[q - 1] * alive[q] == 0.0:
            continue
        c2 = cell_of[q] % shape[2]
        c1 = (cell_of[q] // shape[2]) % shape[1]
        c0 = cell_of[q] // (shape[2] * shape[1])
        xq, yq, zq, reach = x[q], y[q], z[q], radius[q] + half_piece[q] + skin
        for a in range(max(c0 - 1, 0), min(c0 + 2, shape[0])):
            for b in range(max(c1 - 1, 0), min(c1 + 2, shape[1])):
                row = (a * shape[1] + b) * shape[2]
                for k in range(head[row + max(c2 - 1, 0)], head[row + min(c2 + 2, shape[2])]):
                    dx, dy, dz, near = px[k] - xq, py[k] - yq, pz[k] - zq, extent[k] + reach
                    if dx * dx + dy * dy + dz * dz > near * near:
                        continue
                    i, j = min(q, order[k]), max(q, order[k])
                    # a pair of two moved pieces is looked at once, from the lower one
                    if i == j or (i != q and moved[i]) or (chain[j] == chain[i] and j - i <= exclude[i]):
                        continue
                    touch = radius[i] + radius[j]
                    if alive[i - 1] * alive[i] * alive[j - 1] * alive[j] == 0.0:
                        continue
                    if _apart(x, y, z, i, j, touch + skin):
                        continue
                    s, t, wx, wy, wz, line = crossing(x, y, z, i, j)
                    inside = s >= 0.0 and s < 1.0 and t >= 0.0 and t < 1.0
                    if not inside or wx * wx + wy * wy + wz * wz > (touch + skin) ** 2:
                        continue
                    if line == 0.0 and _tracked(new, lists, following, chain, i, j, s, t, line, SAME) >= 0:
                        continue
                    if needed < new.reach.size:
                        before = _tracked(old, old_lists, old_following, chain, i, j, s, t, line, SAME)
                        arm = radius[i] / touch
                        _add_contact(i, j, s, t, wx, wy, wz, line, touch, arm, old, before, new, needed)
                        _push(new, needed, lists, following)
                    needed += 1
    return needed


@njit(**KERNEL)
def assign_halves(contacts, count, node_cut):
    """Sort both sides of every contact by the partition that owns the node; fills half and half_start."""
    parts = node_cut.size - 1
    owner = np.zeros(node_cut[parts] + 1, np.int64)
    for p in range(parts):
        owner[node_cut[p] : node_cut[p + 1]] = p
    contacts.half_start[:] = 0
    for c in range(count):
        for side in range(2):
            contacts.half_start[owner[contacts.piece[side, c]] + 1] += 1
    for p in range(parts):
        contacts.half_start[p + 1] += contacts.half_start[p]
    cursor = contacts.half_start.copy()
    for c in range(count):
        for side in range(2):
            p = owner[contacts.piece[side, c]]
            contacts.half[cursor[p]] = 2 * c + side
            cursor[p] += 1
