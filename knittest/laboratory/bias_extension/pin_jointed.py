"""Pin-jointed kinematics of the bias extension test: yarns that keep their length and are hinged where they cross.

A strip of length H between the clamps and width W, H >= 2 W, its yarns at +-45 deg to the pull, has three zones. Next
to the clamps both yarns of a crossing are held: nothing is sheared. In the middle neither is: the shear angle is gamma
over an area of W (2 H - 3 W) / 2. Between them one is, and the angle is gamma / 2 over an area of W^2. The middle is a
frame with the diagonal L0 = H - W (Lebrun et al. 2003), so that

    gamma = 90 deg - 2 acos((L0 + d) / (sqrt(2) L0)),    dd/dgamma = L0 (cos gamma/2 - sin gamma/2) / 2.

With S, the shear force conjugate to the angle (:mod:`knittest.materials.trellis`), the power F dd is that of both
zones:

    F L0 (cos gamma/2 - sin gamma/2) = W (2 H - 3 W) S(gamma) + W^2 S(gamma/2).

Solved for S(gamma) = F_sh(gamma) cos gamma this is the normalised shear force F_sh of Cao et al. (2008), Composites
Part A 39, 1037-1053, and of Launay et al. (2008), Compos. Sci. Technol. 68, 506-515. Lengths in mm, forces in N.
"""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.materials.trellis import crosshead, frame_angle

Array = NDArray[np.float64]

#: length over width from which on the middle is a zone of its own
SLENDER = 2.0


@dataclass(frozen=True)
class BiasStrip:
    """Length between the clamps and width [mm] of a strip at least twice as long as wide."""

    length: float
    width: float

    def __post_init__(self) -> None:
        if not self.length >= SLENDER * self.width * (1.0 - 1e-9):
            raise InputError(
                f"a strip {self.length:g} mm long and {self.width:g} mm wide: expected at least {SLENDER:g} times its "
                f"width between the clamps, {SLENDER * self.width:g} mm: in shorter ones yarns run from clamp to clamp"
            )

    @property
    def middle(self) -> float:
        """L0 = H - W [mm]: diagonal of the frame that the middle is."""
        return self.length - self.width

    @property
    def areas(self) -> tuple[float, float]:
        """Area [mm2] that is sheared by gamma, and that is sheared by gamma / 2."""
        return 0.5 * self.width * (2.0 * self.length - 3.0 * self.width), self.width**2

    def angle(self, travel: float) -> float:
        """Shear angle [rad] of the middle at a travel [mm] of the clamp.

        >>> round(np.rad2deg(BiasStrip(200.0, 100.0).angle(22.474)).item(), 2)
        30.0
        """
        return frame_angle(travel, self.middle / sqrt(2.0))

    def travel(self, angle: float) -> float:
        """Travel [mm] of the clamp at a shear angle [rad]."""
        return crosshead(angle, self.middle / sqrt(2.0))

    @property
    def longest(self) -> float:
        """Travel [mm] at which the yarns of the middle lie side by side."""
        return (sqrt(2.0) - 1.0) * self.middle

    def force(self, shear: Array, half: Array, angle: Array) -> Array:
        """Force of the clamp [N] of S(gamma) ``shear`` and S(gamma / 2) ``half`` [N/mm] at ``angle`` [rad], (n,).

        >>> angle = np.deg2rad([20.0])  # S = 0.1 N/mm times the angle
        >>> BiasStrip(200.0, 100.0).force(0.1 * angle, 0.05 * angle, angle).round(2)
        array([6.45])
        """
        whole, partly = self.areas
        force: Array = 2.0 * (shear * whole + 0.5 * half * partly) / (self.middle * _lever(angle))
        return force

    def conjugate(self, force: Array, angle: Array) -> Array:
        """S [N/mm] of the clamp's force [N] at ``angle`` [rad], rising, (n,) each.

        S(gamma) hangs on S(gamma / 2), which lies between two angles before it on straight lines: a triangular system.
        From 0 to the first angle the force counts as that at the first.
        """
        from scipy.sparse import csr_array
        from scipy.sparse.linalg import spsolve_triangular

        grid, pull = (np.append(0.0, angle), np.append(force[0], force)) if angle[0] > 0.0 else (angle, force)
        whole, partly = self.areas
        n = len(grid)
        after = np.searchsorted(grid, 0.5 * grid, side="right").clip(1, n - 1)
        share = (0.5 * grid - grid[after - 1]) / (grid[after] - grid[after - 1])
        rows = np.arange(n)
        system = csr_array(
            (
                np.concatenate([np.full(n, whole), 0.5 * partly * (1.0 - share), 0.5 * partly * share]),
                (np.tile(rows, 3), np.concatenate([rows, after - 1, after])),
            ),
            shape=(n, n),
        )
        found: Array = spsolve_triangular(system, 0.5 * pull * self.middle * _lever(grid))
        return found[n - len(angle) :]

    def normalised(self, force: Array, angle: Array) -> Array:
        """Normalised shear force F_sh = S / cos gamma [N/mm] of the clamp's force [N] at ``angle`` [rad], (n,) each."""
        found: Array = self.conjugate(force, angle) / np.cos(angle)
        return found


def strip_of(run: BiasExtensionRun) -> BiasStrip:
    """Strip of a run."""
    return BiasStrip(run.rig.gauge_length_mm, run.rig.width_mm)


def _lever(angle: Array) -> Array:
    """2 / L0 dd/dgamma: cos gamma/2 - sin gamma/2."""
    lever: Array = np.cos(0.5 * angle) - np.sin(0.5 * angle)
    return lever
