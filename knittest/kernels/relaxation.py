"""Static relaxation of a periodic cell of yarns: stretching, bending about a rest shape, penalty contact, FIRE.

Yarns are polylines, each continued in the next cell. FIRE: Bitzek et al., Phys. Rev. Lett. 97 (2006) 170201. Units mm
and N; pseudo-masses equal to the largest stiffness a node can see make the pseudo-time dimensionless, so that a step
of 2 is the limit of stability whatever the yarns are made of.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from knittest.base.arrays import Array, Index
from knittest.kernels.section import closest_sections, segment_closest
from knittest.kernels.vec import ALLOCATING, INLINE, KERNEL, PART, add, combine, dot, scale, sub

#: images of the cell that are searched in each direction: a loop is at most three courses high
IMAGES = 3
#: FIRE: mixing at the start and its decay, growth and cut of the step, steps before growth
MIX, MIX_DECAY, GROW, CUT, PATIENCE = 0.1, 0.99, 1.1, 0.5, 5
#: pseudo-time step: at the start, largest and smallest
FIRST_STEP, LARGEST_STEP, SMALLEST_STEP = 0.1, 1.0, 0.002
#: contacts that a node feels at once, in its pseudo-mass
CONTACTS = 4.0
#: a node moves at most this far along an axis in one iteration [mm]
LARGEST_MOVE = 0.01


class Yarns(NamedTuple):
    """Periodic chains. Node i is followed by ``after[i]`` shifted by ``after_shift[i]`` (likewise before).

    Of each node: ``chain`` (n,), ``arc`` (n,) [mm] rest arc length of the middle of segment i, ``rest`` (n, 3) [mm]
    rest value of x[before] - 2 x + x[after]. Of each chain: rest ``length`` of a segment and of the ``total`` period
    [mm], stretching EA [N], bending EI [N mm^2], ``radius`` [mm], ``exclude`` [mm] arc along which it does not touch
    itself, ``period`` (n_chains, 2) cells between its ends; ``half_width`` [mm] of elliptic sections that lie flat in
    the plane of the fabric, ``radius`` their half height; equal for circles. ``spacing`` (2,) [mm] of the cells along x
    and y.
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
    radius: Array
    half_width: Array
    exclude: Array
    period: Index
    spacing: Array


@njit(**INLINE)
def _row(array, i):
    return array[i, 0], array[i, 1], array[i, 2]


@njit(**INLINE)
def _push(array, i, factor, u):
    array[i, 0] += factor * u[0]
    array[i, 1] += factor * u[1]
    array[i, 2] += factor * u[2]


@njit(**INLINE)
def _chord(x, yarns, i):
    """Vector of segment i [mm]."""
    return sub(add(_row(x, yarns.after[i]), _row(yarns.after_shift, i)), _row(x, i))


@njit(**PART)
def _is_excluded(yarns, i, j, a, b):
    """Return whether segments i and j (image a, b) are neighbours along one yarn."""
    c = yarns.chain[i]
    if c != yarns.chain[j]:
        return False
    px, py = yarns.period[c, 0], yarns.period[c, 1]
    if (px == 0 and a != 0) or (py == 0 and b != 0):
        return False
    turns = a // px if px != 0 else b // py
    return abs(yarns.arc[j] + turns * yarns.total[c] - yarns.arc[i]) < yarns.exclude[c]


@njit(**INLINE)
def _bound(yarns, c):
    """Radius of the circle around the section of chain ``c`` [mm]."""
    return max(yarns.radius[c], yarns.half_width[c])


@njit(**INLINE)
def _section(yarns, c):
    """Section of chain ``c``, upright across the fabric, as :mod:`knittest.kernels.section` takes it."""
    square = yarns.half_width[c] * yarns.half_width[c]
    return (0.0, 0.0, 1.0), square, yarns.radius[c] * yarns.radius[c] - square


@njit(**KERNEL)
def periodic_pairs(x, yarns, skin, pairs):
    """Fill ``pairs`` with segments that may touch, rows (i, j, image x, image y).

    Returns their number, which may exceed the capacity.
    """
    n, count = len(x), 0
    for i in range(n):
        u = _chord(x, yarns, i)
        for j in range(i, n):
            v = _chord(x, yarns, j)
            reach = _bound(yarns, yarns.chain[i]) + _bound(yarns, yarns.chain[j]) + skin
            reach += 0.5 * (sqrt(dot(u, u)) + sqrt(dot(v, v)))
            between = sub(add(_row(x, j), scale(0.5, v)), add(_row(x, i), scale(0.5, u)))
            for a in range(-IMAGES, IMAGES + 1):
                for b in range(-IMAGES, IMAGES + 1):
                    if i == j and (a < 0 or (a == 0 and b <= 0)):
                        continue
                    d = add(between, (a * yarns.spacing[0], b * yarns.spacing[1], 0.0))
                    if dot(d, d) > reach * reach or _is_excluded(yarns, i, j, a, b):
                        continue
                    if count < len(pairs):
                        pairs[count, 0], pairs[count, 1], pairs[count, 2], pairs[count, 3] = i, j, a, b
                    count += 1
    return count


@njit(**KERNEL)
def yarn_forces(x, yarns, force):
    """Adds the forces [N] of the energies EA/2 l (strain)^2 and EI/(2 l^3) |x[before] - 2 x + x[after] - rest|^2."""
    for i in range(len(x)):
        c, h, j = yarns.chain[i], yarns.before[i], yarns.after[i]
        ahead = _chord(x, yarns, i)
        length = sqrt(dot(ahead, ahead))
        pull = yarns.stretching[c] * (length / yarns.length[c] - 1.0) / length
        _push(force, i, pull, ahead)
        _push(force, j, -pull, ahead)
        back = sub(add(_row(x, h), _row(yarns.before_shift, i)), _row(x, i))
        bend = sub(add(back, ahead), _row(yarns.rest, i))
        stiff = yarns.bending[c] / yarns.length[c] ** 3
        _push(force, i, 2.0 * stiff, bend)
        _push(force, h, -stiff, bend)
        _push(force, j, -stiff, bend)


@njit(**KERNEL)
def contact_forces(x, yarns, pairs, count, penalty, force):
    """Adds penalty forces [N]; returns the largest penetration over the smaller radius (of ellipses half height).

    The force of ellipses is along their normal, at which their distance is stationary (envelope theorem).
    """
    deepest = 0.0
    for m in range(count):
        i, j = pairs[m, 0], pairs[m, 1]
        u, v = _chord(x, yarns, i), _chord(x, yarns, j)
        image = (pairs[m, 2] * yarns.spacing[0], pairs[m, 3] * yarns.spacing[1], 0.0)
        r = sub(sub(_row(x, i), _row(x, j)), image)
        s, t = segment_closest(r, u, v)
        g = add(r, combine(s, u, -t, v))
        gap = sqrt(dot(g, g))
        c, d = yarns.chain[i], yarns.chain[j]
        ri, rj = yarns.radius[c], yarns.radius[d]
        if yarns.half_width[c] == ri and yarns.half_width[d] == rj:
            depth = ri + rj - gap
        elif gap < _bound(yarns, c) + _bound(yarns, d):
            s, t, g, depth = closest_sections(r, u, v, _section(yarns, c), _section(yarns, d), 0.0)
            gap = 1.0
        else:
            continue
        if depth <= 0.0 or gap < 1e-9:
            continue
        deepest = max(deepest, depth / min(ri, rj))
        push = penalty * depth / gap
        _push(force, i, push * (1.0 - s), g)
        _push(force, yarns.after[i], push * s, g)
        _push(force, j, -push * (1.0 - t), g)
        _push(force, yarns.after[j], -push * t, g)
    return deepest


@njit(**PART)
def _power(yarns, mass, force, velocity):
    """Power F v, and the squared norms m v^2 and F^2 / m, summed over nodes; the largest force component [N]."""
    power, motion, drive, largest = 0.0, 0.0, 0.0, 0.0
    for i in range(len(force)):
        f, v, m = _row(force, i), _row(velocity, i), mass[yarns.chain[i]]
        power += dot(f, v)
        motion += m * dot(v, v)
        drive += dot(f, f) / m
        largest = max(largest, abs(f[0]), abs(f[1]), abs(f[2]))
    return power, motion, drive, largest


@njit(**PART)
def _move(x, yarns, mass, force, velocity, keep, turn, step):
    """Semi-implicit Euler step of v = ``keep`` v + ``turn`` F / m, with a limited displacement."""
    limit = LARGEST_MOVE / step
    for i in range(len(x)):
        m = mass[yarns.chain[i]]
        for k in range(3):
            v = keep * velocity[i, k] + (turn + step) * force[i, k] / m
            velocity[i, k] = min(max(v, -limit), limit)
            x[i, k] += step * velocity[i, k]


@njit(**PART)
def _largest_move(x, start):
    far = 0.0
    for i in range(len(x)):
        d = sub(_row(x, i), _row(start, i))
        far = max(far, dot(d, d))
    return sqrt(far)


@njit(**ALLOCATING)
def relax(x, yarns, pairs, count, penalty, tolerance, iterations, skin):
    """Relax yarns by FIRE until the largest force component is below ``tolerance`` [N] or a node moved by ``skin`` / 2.

    Moves ``x`` (n, 3) [mm] in place; ``penalty`` [N/mm], ``skin`` [mm]. Returns the iterations done, the largest force
    [N], and the largest penetration over radius: of all iterations, and at the end.
    """
    velocity, force, start = np.zeros_like(x), np.zeros_like(x), x.copy()
    length = yarns.length
    mass = 4.0 * yarns.stretching / length + 16.0 * yarns.bending / length**3 + CONTACTS * penalty
    mix, good, step, worst, largest, deepest = MIX, 0, FIRST_STEP, 0.0, np.inf, 0.0
    for iteration in range(iterations):
        force[:] = 0.0
        yarn_forces(x, yarns, force)
        deepest = contact_forces(x, yarns, pairs, count, penalty, force)
        worst = max(worst, deepest)
        power, motion, drive, largest = _power(yarns, mass, force, velocity)
        if largest < tolerance:
            return iteration, largest, worst, deepest
        if power > 0.0:
            keep, turn = 1.0 - mix, mix * sqrt(motion / drive)
            good += 1
            if good > PATIENCE:
                step, mix = min(step * GROW, LARGEST_STEP), mix * MIX_DECAY
        else:
            keep, turn, good = 0.0, 0.0, 0
            step, mix = max(step * CUT, SMALLEST_STEP), MIX
        _move(x, yarns, mass, force, velocity, keep, turn, step)
        if _largest_move(x, start) > 0.5 * skin:
            return iteration + 1, largest, worst, deepest
    return iterations, largest, worst, deepest
