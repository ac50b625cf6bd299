"""Strip tensile test after DIN EN ISO 13934-1: one clamp fixed, one pulled at constant speed after a smooth start."""

import numpy as np
from numpy.typing import NDArray

from knittest.laboratory.tensile.config import TensileRun
from knittest.models.boundary import ALL, Boundary
from knittest.models.readings import Readings
from knittest.models.table import ramp

Array = NDArray[np.float64]

#: a node this close to a clamp edge is gripped [mm]
EDGE = 1e-6


class TensileTest:
    """Pulls the strip along ``axis`` (0: x, 1: y) over a ``gauge`` length [mm] about ``middle`` [mm].

    The middle is that of the yarns that are pulled: loops reach beyond their ends.
    """

    coordinate, force = "strain_pct", "force_n"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(self, run: TensileRun, axis: int, gauge: float, middle: float) -> None:
        self.axis, self.gauge, self.middle = axis, gauge, middle
        self.speed = run.solver.speed_mm_per_ms
        self.pull = ramp(run.solver.ramp_ms, self.speed)
        self.max_strain = run.rig.max_strain_fraction
        self.stop_ratio = run.rig.stop_force_ratio
        self.duration = 0.5 * run.solver.ramp_ms + self.max_strain * self.gauge / self.speed

    @property
    def faces(self) -> tuple[float, float]:
        """Place [mm] along the axis from which the fixed clamp holds the strip, and the moving one at the start."""
        return self.middle - 0.5 * self.gauge, self.middle + 0.5 * self.gauge

    def constrain(self, boundary: Boundary) -> None:
        """Grip all nodes outside the gauge length."""
        along = boundary.model.position()[:, self.axis] - self.middle
        fixed = np.flatnonzero(along <= -0.5 * self.gauge + EDGE)
        moving = np.flatnonzero(along >= 0.5 * self.gauge - EDGE)
        axis = ALL[self.axis]
        boundary.grip(fixed, axis)
        boundary.grip(moving, axis, self.pull)

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along the gauge length."""
        return self.gauge / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Displacement, engineering strain of the gauge and force: the mean of both clamps, and each.

        Right after a yarn breaks the moving clamp still feels what the fixed one has lost, by the inertia between them.
        """
        travel = self.pull.integral(time)
        return {
            "displacement_mm": travel,
            "strain_pct": 100.0 * travel / self.gauge,
            "force_n": 0.5 * float(readings.reaction[1] - readings.reaction[0]),
            "force_moving_n": float(readings.reaction[1]),
            "force_fixed_n": -float(readings.reaction[0]),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over when something has failed and the force has fallen to a share of its peak."""
        return broken and force < self.stop_ratio * peak
