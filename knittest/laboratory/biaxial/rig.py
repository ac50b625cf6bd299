"""Biaxial test: sides that move apart both ways at a constant ratio of the strains.

The needles slide along the sides, so that every held point moves as the fabric would if it were strained evenly:
x (1 + e_x), y (1 + e_y). What they do along one axis is then the force per width times the area: N L_x L_y de.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.config.fabric import Direction
from knittest.laboratory.biaxial.config import BiaxialRun
from knittest.models.boundary import ALL, Boundary
from knittest.models.readings import Readings
from knittest.models.table import ramp


class BiaxialTest:
    """Strains the points ``held`` along ``axis`` (0: x, 1: y) and across it; ``size`` (2,) is the rectangle's [mm]."""

    coordinate, force = "strain_pct", "force_n"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(self, run: BiaxialRun, held: NDArray[np.int64], axis: int, size: NDArray[np.float64]) -> None:
        rig, most = run.rig, max(1.0, run.rig.ratio)
        self.held, self.axis, self.size, self.ratio = held, axis, size, rig.ratio
        self.stop_ratio = rig.stop_force_ratio
        self.ends_at_break = run.model.scale == "macro" and _other_first(run)
        rate = run.solver.speed_mm_per_ms / float(size[axis])  # of the system that is strained more
        self.strain, self.cross = (ramp(run.solver.ramp_ms, share * rate / most) for share in (1.0, rig.ratio))
        self.duration = 0.5 * run.solver.ramp_ms + rig.max_strain_fraction / rate

    def constrain(self, boundary: Boundary) -> None:
        """Move the needles with their sides; the yarns may turn on them."""
        position = boundary.model.position()[self.held]
        for axis, strain in ((self.axis, self.strain), (1 - self.axis, self.cross)):
            boundary.move(self.held, ALL[axis], strain, position[:, axis])
        boundary.move(self.held, "z")

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along a side."""
        return float(self.size.max()) / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Strain and force of the direction, [N] and per width, and of the other system."""
        strain, area = self.strain.integral(time), float(np.prod(self.size))
        own, other = (float(r) / area for r in readings.reaction[:2])
        return {
            "strain_pct": 100.0 * strain,
            "cross_strain_pct": 100.0 * self.ratio * strain,
            "force_n": own * float(self.size[1 - self.axis]),
            "force_n_per_mm": own,
            "cross_force_n_per_mm": other,
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over when something has failed and the force of the direction has fallen to a share of its peak, or the
        shells have failed across it.
        """
        return broken and (self.ends_at_break or force < self.stop_ratio * peak)


def across(direction: Direction) -> Direction:
    """The other yarn system."""
    return "weft" if direction == "warp" else "warp"


def _other_first(run: BiaxialRun) -> bool:
    """Tell whether shells fail across the direction before they do along it."""
    fracture, direction = run.fabric.macro.fracture_strain, run.rig.direction
    return run.rig.ratio * fracture.of(direction).value > fracture.of(across(direction)).value
