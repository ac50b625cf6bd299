"""Neighbour search for yarn contact: candidate pairs by a cell grid, then crossings tracked from step to step."""

import numpy as np
from numba import njit

from knittest.kernels.contact import closest_step
from knittest.kernels.options import KERNEL

#: pieces within this angle of parallel (14 degrees) are line contacts: sin^2
PARALLEL_SIN2 = 0.06
#: Newton steps that place a new crossing
NEWTON_STEPS = 4


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
def candidate_pairs(x, y, z, radius, half_piece, chain, exclude, cell_of, shape, head, order, skin, start, partner):
    """Pairs i < j of spline pieces whose bounding spheres come within ``skin`` [mm].

    ``half_piece`` (n,) [mm] half the length of a piece, ``exclude`` (n,) pieces along the same yarn that never touch.
    Fills CSR ``start`` (n + 1,), ``partner``; returns the number needed, which may exceed the capacity.
    """
    n = radius.size
    needed = 0
    for i in range(n):
        start[i] = min(needed, partner.size)
        if cell_of[i] < 0:
            continue
        c = cell_of[i] % shape[2]
        b = (cell_of[i] // shape[2]) % shape[1]
        a = cell_of[i] // (shape[2] * shape[1])
        for aa in range(max(a - 1, 0), min(a + 2, shape[0])):
            for bb in range(max(b - 1, 0), min(b + 2, shape[1])):
                row = (aa * shape[1] + bb) * shape[2]
                for q in range(head[row + max(c - 1, 0)], head[row + min(c + 2, shape[2])]):
                    j = order[q]
                    if j <= i or (chain[j] == chain[i] and j - i <= exclude[i]):
                        continue
                    near = radius[i] + radius[j] + half_piece[i] + half_piece[j] + skin
                    dx, dy, dz = x[i] - x[j], y[i] - y[j], z[i] - z[j]
                    if dx * dx + dy * dy + dz * dz < near * near:
                        if needed < partner.size:
                            partner[needed] = j
                        needed += 1
    start[n] = min(needed, partner.size)
    return needed


@njit(**KERNEL)
def piece(x, y, z, i):
    """Coefficients c0, c1, c2 (each 3) of spline piece ``i``: c(s) = c0 + s c1 + s^2 c2."""
    ux, uy, uz = x[i] - x[i - 1], y[i] - y[i - 1], z[i] - z[i - 1]
    return (
        0.5 * (x[i] + x[i - 1]), 0.5 * (y[i] + y[i - 1]), 0.5 * (z[i] + z[i - 1]), ux, uy, uz,
        0.5 * (x[i + 1] - x[i] - ux), 0.5 * (y[i + 1] - y[i] - uy), 0.5 * (z[i + 1] - z[i] - uz),
    )  # fmt: skip


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
    target.reach[b], target.line[b] = source.reach[a], source.line[a]


@njit(**KERNEL)
def keep_contacts(old, count, skin, new):
    """Copy tracked crossings that are still near into ``new``; returns how many."""
    kept = 0
    for c in range(count):
        s, t = old.parameter[0, c], old.parameter[1, c]
        if old.line[c] == 1.0 or s < -0.5 or s > 1.5 or t < -0.5 or t > 1.5:
            continue
        near = old.reach[c] + skin
        if old.offset[0, c] ** 2 + old.offset[1, c] ** 2 + old.offset[2, c] ** 2 < near * near:
            _copy(old, c, new, kept)
            kept += 1
    return kept


@njit(**KERNEL)
def _tracked(contacts, head, following, chain, i, j, s, t, line):
    """Number of the contact in the lists ``head`` that is the crossing (i + s, j + t), or -1."""
    for ii in range(max(i - 1, 0), min(i + 2, chain.size)):
        c = head[ii]
        while c >= 0:
            if (
                contacts.line[c] == line
                and chain[contacts.piece[0, c]] == chain[i]
                and chain[contacts.piece[1, c]] == chain[j]
                and abs(contacts.piece[0, c] + contacts.parameter[0, c] - i - s) < 0.9
                and abs(contacts.piece[1, c] + contacts.parameter[1, c] - j - t) < 0.9
            ):
                return c
            c = following[c]
    return -1


@njit(**KERNEL)
def _link(contacts, count, head, following):
    head[:] = -1
    for c in range(count):
        following[c] = head[contacts.piece[0, c]]
        head[contacts.piece[0, c]] = c


@njit(**KERNEL)
def find_contacts(x, y, z, radius, chain, start, partner, skin, old, old_count, new):
    """Crossings and line contacts with a gap below ``skin`` [mm]; tracked ones keep parameters and springs.

    Returns the number needed, which may exceed the capacity of ``new``; nothing is dropped silently.
    """
    kept = keep_contacts(old, old_count, skin, new)
    needed = kept
    head, old_head = np.empty(chain.size, np.int64), np.empty(chain.size, np.int64)
    following, old_following = np.empty(new.reach.size, np.int64), np.empty(old.reach.size, np.int64)
    _link(new, kept, head, following)
    _link(old, old_count, old_head, old_following)
    for i in range(chain.size):
        for q in range(start[i], start[i + 1]):
            j = partner[q]
            near = radius[i] + radius[j] + skin
            s, t, wx, wy, wz, line = crossing(x, y, z, i, j)
            if s < 0.0 or s >= 1.0 or t < 0.0 or t >= 1.0 or wx * wx + wy * wy + wz * wz > near * near:
                continue
            if line == 0.0 and _tracked(new, head, following, chain, i, j, s, t, line) >= 0:
                continue
            if needed < new.reach.size:
                c = needed
                before = _tracked(old, old_head, old_following, chain, i, j, s, t, line)
                if before >= 0:
                    _copy(old, before, new, c)
                else:
                    new.spring[:, c] = 0.0
                    new.force[:, c] = 0.0
                new.piece[0, c], new.piece[1, c] = i, j
                new.parameter[0, c], new.parameter[1, c] = s, t
                new.offset[0, c], new.offset[1, c], new.offset[2, c] = wx, wy, wz
                new.reach[c], new.line[c] = radius[i] + radius[j], line
                following[c] = head[i]
                head[i] = c
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
