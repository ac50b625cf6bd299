"""Angle between warp and weft of a pin-jointed net on a sphere: omega_uv = -K sin omega (Chebyshev, 1878)."""

import numpy as np


def net_shear(radius, longest, steps=400):
    """Shear angle [rad] over the distance [mm] along each yarn of the points on the bias line u = v.

    The net is laid along two great circles that cross at the pole, so omega is a right angle on both axes; sine-Gordon
    in characteristic coordinates by the second-order scheme of Goursat's problem.
    """
    h = longest / steps
    omega = np.full((steps + 1, steps + 1), 0.5 * np.pi)
    for i in range(steps):
        for j in range(steps):
            known = omega[i + 1, j] + omega[i, j + 1] - omega[i, j]
            middle = 0.5 * (omega[i + 1, j] + omega[i, j + 1])
            omega[i + 1, j + 1] = known - (h / radius) ** 2 * np.sin(middle)
    return h * np.arange(steps + 1), 0.5 * np.pi - np.diag(omega)
