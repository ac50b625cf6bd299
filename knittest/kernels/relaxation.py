"""Static relaxation of a periodic cell of yarns: stretching, bending about a rest shape, penalty contact, FIRE.

Yarns are closed polylines over the periods of the cell. FIRE: Bitzek et al., Phys. Rev. Lett. 97 (2006) 170201.
Units mm and N; the pseudo-time has no physical meaning.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from knittest.kernels.options import INLINE, KERNEL

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: images of the cell that are searched in each direction
IMAGES = 2
#: FIRE: mixing at the start and its decay, growth and cut of the step, steps before growth
MIX, MIX_DECAY, GROW, CUT, PATIENCE = 0.1, 0.99, 1.1, 0.5, 5
#: a node moves at most this far in one iteration [mm]
LARGEST_MOVE = 0.01


class Yarns(NamedTuple):
    """Periodic chains. Node i is followed by ``after[i]`` shifted by ``after_shift[i]`` (likewise before).

    ``chain`` (n,), ``arc`` (n,) [mm] rest arc length of the middle of segment i, ``rest`` (n, 3) rest value of
    x[before] - 2 x + x[after]; of each chain: ``length`` rest length of a segment, ``total`` of the chain [mm],
    stretching EA [N], bending EI [N mm^2], line ``tension`` [N], ``radius`` [mm], ``exclude`` [mm] arc along which
    it does not touch itself, ``period`` (n_chains, 2) cells between its ends.
    """

    after: Index
    before: Index
    after_shift: Array
    before_shift: Array
    chain: Index
    arc: Array
    rest: Array
    length: Array
    total: Array
    stretching: Array
    bending: Array
    tension: Array
    radius: Array
    exclude: Array
    period: Index


@njit(**INLINE)
def segment_closest(rx, ry, rz, ux, uy, uz, vx, vy, vz):
    """Parameters s, t in [0, 1] of the closest points of segments P + s u and Q + t v with r = P - Q (Ericson, 2005)."""
    a = ux * ux + uy * uy + uz * uz
    e = vx * vx + vy * vy + vz * vz
    f = vx * rx + vy * ry + vz * rz
    c = ux * rx + uy * ry + uz * rz
    b = ux * vx + uy * vy + uz * vz
    det = a * e - b * b
    s = min(max((b * f - c * e) / det, 0.0), 1.0) if det > 1e-9 * a * e else 0.5
    t = (b * s + f) / e
    if t < 0.0:
        return min(max(-c / a, 0.0), 1.0), 0.0
    if t > 1.0:
        return min(max((b - c) / a, 0.0), 1.0), 1.0
    return s, t


@njit(**KERNEL)
def _excluded(yarns, i, j, a, b):
    """Whether segments i and j (image a, b) are neighbours along one yarn."""
    c = yarns.chain[i]
    if c != yarns.chain[j]:
        return False
    px, py = yarns.period[c, 0], yarns.period[c, 1]
    if (px == 0 and a != 0) or (py == 0 and b != 0):
        return False
    turns = a // px if px != 0 else b // py
    return abs(yarns.arc[j] + turns * yarns.total[c] - yarns.arc[i]) < yarns.exclude[c]


@njit(**KERNEL)
def periodic_pairs(x, yarns, scale, wale, course, skin, pairs):
    """Segments that may touch: rows (i, j, image x, image y); returns the number, which may exceed the capacity."""
    n = len(x)
    middle, half = np.empty((n, 3)), np.empty(n)
    for i in range(n):
        square = 0.0
        for k in range(3):
            d = x[yarns.after[i], k] + yarns.after_shift[i, k] - x[i, k]
            middle[i, k] = x[i, k] + 0.5 * d
            square += d * d
        half[i] = 0.5 * sqrt(square)
    count = 0
    for i in range(n):
        for j in range(i, n):
            near = scale * (yarns.radius[yarns.chain[i]] + yarns.radius[yarns.chain[j]]) + half[i] + half[j] + skin
            for a in range(-IMAGES, IMAGES + 1):
                dx = middle[j, 0] + a * wale - middle[i, 0]
                if abs(dx) > near:
                    continue
                for b in range(-IMAGES, IMAGES + 1):
                    if i == j and (a < 0 or (a == 0 and b <= 0)):
                        continue
                    dy = middle[j, 1] + b * course - middle[i, 1]
                    dz = middle[j, 2] - middle[i, 2]
                    if dx * dx + dy * dy + dz * dz > near * near or _excluded(yarns, i, j, a, b):
                        continue
                    if count < len(pairs):
                        pairs[count, 0], pairs[count, 1], pairs[count, 2], pairs[count, 3] = i, j, a, b
                    count += 1
    return count


@njit(**KERNEL)
def _yarn_forces(x, yarns, force):
    for i in range(len(x)):
        c, j, h = yarns.chain[i], yarns.after[i], yarns.before[i]
        square = 0.0
        for k in range(3):
            d = x[j, k] + yarns.after_shift[i, k] - x[i, k]
            square += d * d
        length = sqrt(square)
        pull = (yarns.tension[c] + yarns.stretching[c] * (length / yarns.length[c] - 1.0)) / length
        stiff = yarns.bending[c] / yarns.length[c] ** 3
        for k in range(3):
            d = x[j, k] + yarns.after_shift[i, k] - x[i, k]
            force[i, k] += pull * d
            force[j, k] -= pull * d
            bend = x[h, k] + yarns.before_shift[i, k] - 2.0 * x[i, k] + x[j, k] + yarns.after_shift[i, k]
            bend = stiff * (bend - yarns.rest[i, k])
            force[i, k] += 2.0 * bend
            force[h, k] -= bend
            force[j, k] -= bend


@njit(**KERNEL)
def _contact_forces(x, yarns, scale, pairs, count, wale, course, penalty, force):
    """Adds penalty forces; returns the largest penetration over the smaller radius."""
    deepest = 0.0
    for m in range(count):
        i, j = pairs[m, 0], pairs[m, 1]
        i2, j2 = yarns.after[i], yarns.after[j]
        ux, uy, uz = (
            x[i2, 0] + yarns.after_shift[i, 0] - x[i, 0],
            x[i2, 1] + yarns.after_shift[i, 1] - x[i, 1],
            x[i2, 2] + yarns.after_shift[i, 2] - x[i, 2],
        )
        vx, vy, vz = (
            x[j2, 0] + yarns.after_shift[j, 0] - x[j, 0],
            x[j2, 1] + yarns.after_shift[j, 1] - x[j, 1],
            x[j2, 2] + yarns.after_shift[j, 2] - x[j, 2],
        )
        rx, ry, rz = x[i, 0] - x[j, 0] - pairs[m, 2] * wale, x[i, 1] - x[j, 1] - pairs[m, 3] * course, x[i, 2] - x[j, 2]
        s, t = segment_closest(rx, ry, rz, ux, uy, uz, vx, vy, vz)
        gx, gy, gz = rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz
        gap = sqrt(gx * gx + gy * gy + gz * gz)
        ri, rj = scale * yarns.radius[yarns.chain[i]], scale * yarns.radius[yarns.chain[j]]
        depth = ri + rj - gap
        if depth <= 0.0 or gap < 1e-9:
            continue
        deepest = max(deepest, depth / min(ri, rj))
        push = penalty * depth / gap
        for k in range(3):
            g = push * (gx if k == 0 else gy if k == 1 else gz)
            force[i, k] += (1.0 - s) * g
            force[i2, k] += s * g
            force[j, k] -= (1.0 - t) * g
            force[j2, k] -= t * g
    return deepest


@njit(**KERNEL)
def relax(x, yarns, scale, pairs, count, wale, course, penalty, step, largest_step, tolerance, iterations, skin):
    """FIRE until the largest force component is below ``tolerance`` [N] or a node moved by a quarter of ``skin``.

    Moves ``x`` (n, 3) [mm] in place. Returns (iterations done, largest force [N], largest penetration over radius
    seen, the same at the end).
    """
    velocity, force, start = np.zeros_like(x), np.zeros_like(x), x.copy()
    mix, good, worst, residual, deepest = MIX, 0, 0.0, np.inf, 0.0
    first_step = step
    for iteration in range(iterations):
        force[:] = 0.0
        _yarn_forces(x, yarns, force)
        deepest = _contact_forces(x, yarns, scale, pairs, count, wale, course, penalty, force)
        worst = max(worst, deepest)
        residual = np.abs(force).max()
        if residual < tolerance:
            return iteration, residual, worst, deepest
        if (force * velocity).sum() > 0.0:
            ratio = mix * sqrt((velocity**2).sum() / (force**2).sum())
            velocity[:] = (1.0 - mix) * velocity + ratio * force
            good += 1
            if good > PATIENCE:
                step, mix = min(step * GROW, largest_step), mix * MIX_DECAY
        else:
            velocity[:] = 0.0
            step, mix, good = max(step * CUT, 0.02 * first_step), MIX, 0
        farthest = 0.0
        for i in range(len(x)):
            for k in range(3):
                velocity[i, k] += step * force[i, k]
                velocity[i, k] = min(max(velocity[i, k], -LARGEST_MOVE / step), LARGEST_MOVE / step)
                x[i, k] += step * velocity[i, k]
                farthest = max(farthest, abs(x[i, k] - start[i, k]))
        if farthest > 0.25 * skin:
            return iteration + 1, residual, worst, deepest
    return iterations, residual, worst, deepest
