"""Start curve of a knitted loop: harmonic in the loop angle, right topology, length set by its bulge.

theta = 0 is the middle of the sinker arc, pi that of the needle arc; x across the wales, y along them, z to the
technical face. It has the topology of Choi & Lo (2003), Text. Res. J. 73, 739-748, whose half loop
x = a t^3 - 1.5 a t^2 + (a + w) t / 2, y = (c + 2 e)(1 - cos pi t) / 2, z = h (1 - cos 2 pi t) / 2 cannot, with its full
constraint set, be as short as the loops measured in variant 1 (14.78 against 14.4 mm); relaxation decides the shape.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.fabric.spline import polyline_length

Array = NDArray[np.float64]

#: the two cells whose start curves were studied (0.75 and 0.50 mm yarns, wale spacing 3.5714 mm), from dense to open:
#: course over wale spacing [-]; overlap H - C, zs, zn, zl, y_w [mm]
STUDIED_RATIO = (0.6829, 1.0)
STUDIED_SHAPE = np.array([[1.2317, -0.6414, -0.0317, 1.3655, 0.1238], [1.1161, -0.458, -0.1604, 1.1979, 0.0955]])
STUDIED_REACH = 0.625  # half the sum of the studied diameters [mm]
#: bulge over wale spacing: with less than the first the loops hardly interlace, with more than the last legs collide
BULGE = (0.2, 0.45)


@dataclass(frozen=True)
class Loop:
    """Harmonic loop [mm]: wale spacing, height, bulge, levels z of sinker arc, needle arc and legs, y of the weft."""

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


def start_loop(wale: float, course: float, loop_length: float, reach: float) -> Loop:
    """Loop on ``wale`` x ``course`` spacing, of ``loop_length`` or, if that interlaces badly, longer; all [mm].

    ``reach`` is half the sum of both diameters [mm]. Shape parameters are interpolated between the two studied cells by
    course over wale spacing and scaled with ``reach``. Raises :class:`InputError` for a loop too long for its cell.
    """
    from scipy.optimize import brentq

    shape = [np.interp(course / wale, STUDIED_RATIO, column) for column in STUDIED_SHAPE.T]
    overlap, sinker, needle, leg, weft = (float(v) * reach / STUDIED_REACH for v in shape)

    def loop(bulge: float) -> Loop:
        return Loop(wale, course + overlap, bulge, sinker, needle, leg, weft)

    tight, wide = (loop(share * wale) for share in BULGE)
    if loop_length <= tight.length():
        return tight
    if loop_length >= wide.length():
        raise InputError(
            f"fabric.loop_length = {loop_length:g} mm is too long for {wale:.3f} x {course:.3f} mm spacing: "
            f"expected less than {wide.length():.2f} mm"
        )
    return loop(float(brentq(lambda b: loop(b).length() - loop_length, tight.bulge, wide.bulge, xtol=1e-12)))
