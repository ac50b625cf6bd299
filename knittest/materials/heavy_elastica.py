"""The heavy elastica: shape of a strip that bends over an edge under its own weight."""

from functools import cache

import numpy as np

from knittest.base.arrays import Array

#: chord [deg] of the standard's plane (DIN 53362), at which B = w (L / 2)^3 holds
STANDARD_ANGLE = 41.5
#: loads w L^3 / B between which a stiffness is looked for: chords of 0.7 and 86 deg
LIGHT, HEAVY = 0.1, 500.0


def heavy_elastica(arc: Array, overhang: float, weight: float, stiffness: float) -> tuple[Array, Array, Array]:
    """Reach [mm], drop [mm] and slope [rad] of the centre-line at ``arc`` [mm], (n,), measured from the edge.

    B theta'' = -w (L - s) cos theta, theta(0) = 0, theta'(L) = 0 with bending stiffness B ``stiffness`` [N mm^2],
    weight per length w ``weight`` [N/mm] and ``overhang`` L (Bickley 1934, The heavy elastica). Behind the edge the
    line is straight.

    >>> reach, drop, slope = heavy_elastica(np.array([100.0]), 100.0, weight=4e-4, stiffness=50.0)
    >>> round(reach.item(), 2), round(drop.item(), 2)
    (72.44, 64.06)
    """
    from scipy.integrate import cumulative_trapezoid, solve_bvp

    load = weight * overhang**3 / stiffness
    start = np.linspace(0.0, 1.0, 201)

    def slopes(s: Array, y: Array) -> Array:
        return np.vstack([y[1], -load * (1.0 - s) * np.cos(y[0])])

    def ends(a: Array, b: Array) -> Array:
        return np.array([a[0], b[1]])

    linear = load * np.vstack([start / 2 - start**2 / 2 + start**3 / 6, 0.5 * (1.0 - start) ** 2])
    solution = solve_bvp(slopes, ends, start, np.arctan(linear), tol=1e-8, max_nodes=20_000)
    samples = np.linspace(0.0, 1.0, 4001)
    angle = solution.sol(samples)[0]
    s = np.clip(arc / overhang, 0.0, 1.0)
    x, z = (overhang * cumulative_trapezoid(v, samples, initial=0) for v in (np.cos(angle), np.sin(angle)))
    reach, drop, slope = (np.interp(s, samples, v) for v in (x, z, angle))
    beyond = arc - overhang * s  # before the edge and beyond the free end the line goes on straight
    return reach + beyond * np.cos(slope), drop + beyond * np.sin(slope), slope


def bending_stiffness(overhang: float, weight: float) -> float:
    """B = w (L / 2)^3 [N mm^2] of the ``overhang`` L [mm] at :data:`STANDARD_ANGLE` (DIN 53362; Eq. 2 of Pham et al.,
    2019).

    ``weight`` w is per length [N/mm]; with that per area [N/mm^2], B is per width [N mm].

    >>> bending_stiffness(100.0, 8.0e-6)  # 0.816 kg/m2
    1.0
    """
    return weight * (0.5 * overhang) ** 3


def chord_angle(overhang: float, weight: float, stiffness: float) -> float:
    """Angle [deg] from the edge to the free end; arguments as those of :func:`heavy_elastica`.

    >>> round(chord_angle(100.0, 8e-6, stiffness=bending_stiffness(100.0, 8e-6)), 1)  # the plane of DIN 53362
    41.5
    """
    reach, drop, _ = heavy_elastica(np.array([overhang]), overhang, weight, stiffness)
    return float(np.rad2deg(np.arctan2(drop[0], reach[0])))


@cache
def stiffness_of(angle: float, overhang: float, weight: float) -> float:
    """The stiffness B at which :func:`chord_angle` is ``angle`` [deg], to 1e-6; raises :class:`ValueError` beyond the
    loads :data:`LIGHT` and :data:`HEAVY`.

    >>> round(stiffness_of(41.5, 100.0, 8e-6), 3)  # Eq. 2 gives 1
    0.999
    """
    from scipy.optimize import brentq

    scale = weight * overhang**3

    def off(logarithm: float) -> float:
        return chord_angle(overhang, weight, scale * float(np.exp(-logarithm))) - angle

    return scale * float(np.exp(-brentq(off, np.log(LIGHT), np.log(HEAVY), xtol=1e-6)))


def overhang_ratio(angle: float, other: float) -> float:
    """Overhang of a strip at the chord ``angle`` over that at the chord ``other`` [deg]: loads go with its cube.

    >>> round(overhang_ratio(45.0, 41.5), 3)
    1.05
    """
    if abs(angle - other) < 1e-9:
        return 1.0
    return float(np.cbrt(stiffness_of(other, 1.0, 1.0) / stiffness_of(angle, 1.0, 1.0)))
