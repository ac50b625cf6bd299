"""The law of a soft yarn: a dense core in a shell of loose fibres, and its table for the kernels."""

from dataclasses import dataclass
from math import pi, sin

import numpy as np

from knittest.base.arrays import Array
from knittest.kernels.state import SoftLaw

#: z = (d - core) / (outer - core) below which the law continues along its tangent: its stiffness there is 6e5 times
#: the rigidity at an exponent of 2.4
LEAST_SHARE = 0.02
#: rows of the table
ROWS = 4000
#: z at which sticking is as stiff as pressing, times the tangential ratio
STICKING = 0.2
#: length [outer diameters] along a yarn within which it does not touch itself: 2.1 radii (Singal et al., 2024)
ALONG = 1.05
#: cores that touch at once on a node, for the bound of the time step
CORES = 2.0


@dataclass(frozen=True)
class SoftShell:
    """Shell of loose fibres around the core of a yarn: diameters [mm], ``rigidity`` k [N/mm3], ``exponent`` p [-].

    Energies by :mod:`knittest.kernels.soft_contact`.
    """

    outer: float
    core: float
    rigidity: float
    exponent: float

    @property
    def depth(self) -> float:
        """Outer less core diameter [mm]."""
        return self.outer - self.core

    def energy(self, distance: Array) -> Array:
        """V [N/mm] at a ``distance`` [mm] of two centre-lines above that of the cores."""
        p, z = self.exponent, np.minimum((np.asarray(distance, float) - self.core) / self.depth, 1.0)
        scale = self.rigidity * self.depth**2 / (p * (p - 1.0))
        return np.asarray(scale * (z ** (1.0 - p) - 1.0 + (1.0 - p) * (1.0 - z)))

    def pressure(self, distance: Array) -> Array:
        """-dV/dd [N/mm2]."""
        p, z = self.exponent, np.minimum((np.asarray(distance, float) - self.core) / self.depth, 1.0)
        return np.asarray(self.rigidity * self.depth / p * (z**-p - 1.0))

    def stiffness(self, share: float) -> float:
        """Stiffness d2V/dd2 [N/mm3] at z = ``share``."""
        return self.rigidity * share ** (-self.exponent - 1.0)

    def crossing_force(self, distance: float, angle: float) -> float:
        """Force [N] of two straight yarns that cross at ``angle`` [rad] at a ``distance`` [mm]: 2 pi d V / sin."""
        return 2.0 * pi * distance * float(self.energy(np.array(distance))) / sin(angle)

    def law(self, friction: float, tangential_ratio: float) -> SoftLaw:
        """Table for the kernels."""
        least = self.core + LEAST_SHARE * self.depth
        at = np.linspace(least, self.outer, ROWS + 1)
        pressure = self.pressure(at)
        step = float(at[1] - at[0])
        # what the table stores is the exact integral of its pieces
        energy = np.append(np.cumsum((0.5 * step * (pressure[1:] + pressure[:-1]))[::-1])[::-1], 0.0)
        return SoftLaw(
            self.outer, least, 1.0 / step, pressure, energy, self.stiffness(LEAST_SHARE),
            tangential_ratio * self.stiffness(STICKING), friction,
        )  # fmt: skip

    @property
    def along(self) -> float:
        """Length [mm] of a yarn within which it does not touch itself."""
        return ALONG * self.outer

    def stiffest(self, length: float) -> float:
        """Largest stiffness [N/mm] that touching cores give a node, each of a ``length`` [mm] of its yarn."""
        return CORES * self.stiffness(LEAST_SHARE) * length**2
