"""Start curve of a knitted loop: harmonic in the loop angle, right topology, length tuned by its width.

theta = 0 is the middle of the sinker arc, pi that of the needle arc; x across the wales, y along them, z to the
technical face. It has the topology of Choi & Lo (2003), Text. Res. J. 73, 739, whose cubic with its full constraint
set cannot be as short as the loops measured in variant 1 (14.78 against 14.4 mm).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.errors import InputError

Array = NDArray[np.float64]

#: height, sinker, needle and leg levels and weft height [mm] of the two studied cells (0.75 and 0.50 mm yarns, wale
#: spacing 3.5714 mm) at course over wale spacing 1.0 and 0.6829: overlap H - C, zs, zn, zl, y_w
STUDIED = np.array([[1.0, 1.1161, -0.458, -0.1604, 1.1979, 0.0955], [0.6829, 1.2317, -0.6414, -0.0317, 1.3655, 0.1238]])
STUDIED_REACH = 0.625  # half the sum of the studied diameters [mm]
#: bulge of the loop over the wale spacing, searched for the loop length
BULGE = (0.0, 0.45)


@dataclass(frozen=True)
class Loop:
    """Harmonic loop: wale spacing, height, bulge, levels of sinker arc, needle arc and legs, height of the weft [mm]."""

    wale: float
    height: float
    bulge: float
    sinker: float
    needle: float
    leg: float
    weft: float

    def points(self, theta: Array) -> Array:
        """Centre-line [mm], (n, 3), at loop angles ``theta`` (n,)."""
        second = 0.5 * (0.5 * (self.sinker + self.needle) - self.leg)
        x = self.wale * (theta - np.pi) / (2.0 * np.pi) + self.bulge * np.sin(2.0 * theta)
        y = -0.5 * self.height * np.cos(theta)
        z = self.leg + second + 0.5 * (self.sinker - self.needle) * np.cos(theta) + second * np.cos(2.0 * theta)
        return np.column_stack([x, y, z])

    def length(self) -> float:
        """Arc length of one loop [mm]."""
        return polyline_length(self.points(np.linspace(0.0, 2.0 * np.pi, 2001)))


def polyline_length(points: Array) -> float:
    """Length [mm] of a polyline (n, 3)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def start_loop(wale: float, course: float, loop_length: float, reach: float) -> Loop:
    """Loop of ``loop_length`` on ``wale`` x ``course`` spacing; ``reach`` half the sum of both diameters [mm].

    Shape parameters are interpolated between the two studied cells by course over wale spacing and scaled with the
    yarns. Raises :class:`InputError` naming the possible lengths.
    """
    from scipy.optimize import brentq

    ratio = float(np.clip(course / wale, STUDIED[1, 0], STUDIED[0, 0]))
    share = (ratio - STUDIED[1, 0]) / (STUDIED[0, 0] - STUDIED[1, 0])
    overlap, sinker, needle, leg, weft = STUDIED[1, 1:] + share * (STUDIED[0, 1:] - STUDIED[1, 1:])
    scale = reach / STUDIED_REACH

    def loop(bulge: float) -> Loop:
        return Loop(wale, course + scale * overlap, bulge, scale * sinker, scale * needle, scale * leg, scale * weft)

    low, high = (loop(b * wale).length() for b in BULGE)
    if not low < loop_length < high:
        raise InputError(
            f"fabric.loop_length = {loop_length:g} mm does not fit {wale:.3f} x {course:.3f} mm spacing and these "
            f"yarn diameters: expected {low:.2f} to {high:.2f} mm"
        )
    return loop(brentq(lambda b: loop(b).length() - loop_length, BULGE[0] * wale, BULGE[1] * wale, xtol=1e-12))
