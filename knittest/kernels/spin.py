"""Friction moment of a crossing: yarns that touch over a patch resist spin about its normal, with one limit for both.

Slip and spin share the limit (f / mu N)^2 + (M / (mu N l))^2 <= 1, l the lever of the patch: 2/3 R for a disc of even
pressure. It is the ellipsoid by which Howe & Cutkosky (1996) replace the limit surface of a disc (Goyal, Ruina &
Papadopoulos 1991). What slips does so along the normal of that surface, so that a disc which slides at v and spins at w
resists with f : M / l = v : l w.
"""

from math import sqrt

from numba import njit

from knittest.kernels.options import INLINE

#: no force [N] and no lever [mm]
NOTHING = 1e-30


@njit(**INLINE)
def lever_of(pressure, coefficient, most, softening):
    """Lever [mm] of the friction moment under ``pressure`` [N]: min(coefficient N^p, most), p = 1/8 for a ``softening``
    of 3, 1/4 for one of 1.
    """
    root = sqrt(sqrt(pressure))
    return min(coefficient * (sqrt(root) if softening > 1.0 else root), most)


@njit(**INLINE)
def shares_left(slid2, spun2, limit, ratio):
    """Shares of force and moment left on the limit [N], by its normal: f / x and m / y, y - 1 = ``ratio`` (x - 1).

    ``slid2``, ``spun2`` squares of force and moment over lever [N^2] beyond the limit, ``ratio`` of their stiffnesses.
    x from two Newton steps for 1/sqrt(slid2/x^2 + spun2/y^2) = 1/limit, exact in one for a ratio of 1; what is left
    of the error goes along the ray.
    """
    inv_limit, square = 1.0 / max(limit, NOTHING), slid2 + spun2
    over = max(sqrt(square) * inv_limit - 1.0, 0.0)
    x = 1.0 + over * square / max(slid2 + spun2 * ratio, NOTHING * NOTHING)
    p, q = 1.0 / x, 1.0 / (1.0 + (x - 1.0) * ratio)
    f2, m2 = slid2 * p * p, spun2 * q * q
    over = max(sqrt(f2 + m2) * inv_limit - 1.0, 0.0)
    x += over * (f2 + m2) / max(f2 * p + m2 * q * ratio, NOTHING * NOTHING * NOTHING)
    p, q = 1.0 / x, 1.0 / (1.0 + (x - 1.0) * ratio)
    ray = limit / max(sqrt(slid2 * p * p + spun2 * q * q), NOTHING * NOTHING)
    return ray * p, ray * q
