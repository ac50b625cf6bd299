"""Bias extension: one clamp fixed, one pulled at constant speed after a smooth start."""

import numpy as np
from numpy.typing import NDArray

from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip
from knittest.models.boundary import Boundary
from knittest.models.readings import Readings
from knittest.models.table import ramp

#: shear angles at which results are read [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)


class BiasExtensionTest:
    """Pulls the nodes ``moving`` along y from those ``fixed`` until the middle of ``strip`` is sheared enough."""

    coordinate, force = "shear_angle_deg", "force_n"
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(
        self, run: BiasExtensionRun, strip: BiasStrip, fixed: NDArray[np.int64], moving: NDArray[np.int64]
    ) -> None:
        self.strip, self.fixed, self.moving = strip, fixed, moving
        speed, start = run.solver.speed_mm_per_ms, run.solver.ramp_ms
        self.pull = ramp(start, speed)
        self.duration = self._time(run.rig.max_angle, speed, start)
        self.marks = tuple(
            self._time(angle, speed, start) / self.duration for angle in ANGLES if angle <= run.rig.max_angle
        )

    def _time(self, angle: float, speed: float, start: float) -> float:
        """Time [ms] at which the middle is sheared by ``angle`` [deg], beyond the ``start`` [ms] of the motion."""
        return 0.5 * start + self.strip.travel(float(np.deg2rad(angle))) / speed

    def constrain(self, boundary: Boundary) -> None:
        """Grip both ends."""
        boundary.grip(self.fixed, "y")
        boundary.grip(self.moving, "y", self.pull)

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs from clamp to clamp along the yarns."""
        return float(np.sqrt(2.0)) * self.strip.length / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Displacement, shear angle of pin-jointed yarns and force: the mean of both clamps, and each."""
        travel = self.pull.integral(time)
        return {
            "displacement_mm": travel,
            "shear_angle_deg": float(np.rad2deg(self.strip.angle(travel))),
            "force_n": 0.5 * float(readings.reaction[1] - readings.reaction[0]),
            "force_moving_n": float(readings.reaction[1]),
            "force_fixed_n": -float(readings.reaction[0]),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Only the largest angle ends the test."""
        return False
