"""Looks for what must not happen, over the whole model: collapsed elements, pierced contacts, overloaded nodes.

Called every few steps, so the usual answer, nothing, is counted without branches; who it is is only asked afterwards.
"""

import numpy as np
from numba import njit

from knittest.kernels.contact import penalty, spline_weights
from knittest.kernels.options import KERNEL
from knittest.kernels.rows import rows3
from knittest.kernels.shell_state import AREA, state_index


@njit(**KERNEL)
def count_short_beams(position, alive, inv_length, limit):
    """Living beams shorter than ``limit`` times their rest length."""
    x, y, z = rows3(position)
    count, limit2 = 0, limit * limit
    for i in range(alive.size):
        dx, dy, dz = x[i + 1] - x[i], y[i + 1] - y[i], z[i + 1] - z[i]
        stretch2 = (dx * dx + dy * dy + dz * dz) * inv_length[i] * inv_length[i]
        count += (stretch2 < limit2) & (alive[i] > 0.0)
    return count


@njit(**KERNEL)
def count_pierced(offset, reach, line, count, limit):
    """Crossings whose centre-lines are nearer than ``limit`` times the reach: one yarn is about to pass the other."""
    gx, gy, gz = rows3(offset)
    found, limit2 = 0, limit * limit
    for c in range(count):
        gap2 = gx[c] * gx[c] + gy[c] * gy[c] + gz[c] * gz[c]
        found += (gap2 < limit2 * reach[c] * reach[c]) & (line[c] == 0.0)
    return found


@njit(**KERNEL)
def stiffest_node(contacts, count, law, own, inv_mass, load):
    """Node with the largest bound of its squared frequency [1/ms^2], and that bound; -1 if none moves.

    ``own`` (n,) stiffness of a node's beams [N/mm]; each loaded contact adds the tangent of ``law`` times the node's
    share of it, twice, for the pair (Gershgorin). ``load`` (n,) is work space, zero before and after.
    """
    piece, parameter = contacts.piece, contacts.parameter
    fx, fy, fz = rows3(contacts.force)
    gx, gy, gz = rows3(contacts.offset)
    for c in range(count):
        if fx[c] != 0.0 or fy[c] != 0.0 or fz[c] != 0.0:
            depth = max(contacts.reach[c] - np.sqrt(gx[c] ** 2 + gy[c] ** 2 + gz[c] ** 2), 0.0)
            normal = penalty(depth, law.normal, law.linear, law.square, law.cubic, law.cap)[1]
            for side in range(2):
                i = piece[side, c]
                before, at, after = spline_weights(parameter[side, c])
                load[i - 1] += 2.0 * normal * before
                load[i] += 2.0 * normal * at
                load[i + 1] += 2.0 * normal * after
    worst, largest = -1, 0.0
    for c in range(count):
        for side in range(2):
            for i in range(piece[side, c] - 1, piece[side, c] + 2):
                if load[i] > 0.0:
                    bound = (load[i] + own[i]) * inv_mass[i]
                    if bound > largest:
                        worst, largest = i, bound
                    load[i] = 0.0
    return worst, largest


@njit(**KERNEL)
def smallest_shell(position, conn, fail_time, state):
    """Living shell with the smallest area over its reference area [-], and that ratio; -1 if none lives."""
    x, y, z = rows3(position)
    worst, least = -1, np.inf
    for e in range(fail_time.size):
        if fail_time[e] != np.inf:
            continue
        i, j, k, m = conn[e, 0], conn[e, 1], conn[e, 2], conn[e, 3]
        ax, ay, az = x[k] - x[i], y[k] - y[i], z[k] - z[i]
        bx, by, bz = x[m] - x[j], y[m] - y[j], z[m] - z[j]
        nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        area = 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)
        ratio = area / state[state_index(e) + AREA]
        if ratio < least:
            worst, least = e, ratio
    return worst, least
