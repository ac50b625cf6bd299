"""Bias extension: one clamp fixed, one pulled after a smooth start.

Yarns are pulled at constant speed up to the first angle at which a force is read, and from there in proportion to the
travel. The work grows faster than the square of the travel, so that the kinetic energy stays as small a share of it.
"""

from math import log

import numpy as np
from numpy.typing import NDArray

from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip
from knittest.models.boundary import Boundary
from knittest.models.readings import Readings
from knittest.models.table import Table, ramp

#: shear angles at which results are read [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: largest speed of yarns over that of the start, and knots of its growth
FASTEST, KNOTS = 4.0, 200


class BiasExtensionTest:
    """Pulls the nodes ``moving`` along y from those ``fixed`` until the middle of ``strip`` is sheared enough."""

    coordinate, force = "shear_angle_deg", "force_n"
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(
        self, run: BiasExtensionRun, strip: BiasStrip, fixed: NDArray[np.int64], moving: NDArray[np.int64]
    ) -> None:
        self.strip, self.fixed, self.moving = strip, fixed, moving
        speed, start = run.solver.speed_mm_per_ms, run.solver.ramp_ms
        self.speed, self.start = speed, start
        self.fastest = FASTEST if run.model.scale == "meso" else 1.0
        self.pull = self._pull()
        self.duration = self._time(self._travel(run.rig.max_angle))
        self.marks = tuple(
            self._time(self._travel(angle)) / self.duration for angle in ANGLES if angle <= run.rig.max_angle
        )

    def _travel(self, angle: float) -> float:
        """Travel [mm] that shears the middle of pin-jointed yarns by ``angle`` [deg]."""
        return self.strip.travel(float(np.deg2rad(angle)))

    def _pull(self) -> Table:
        """Speed [mm/ms] of the clamp: v up to the travel x1 of the first angle, then v x / x1 = v exp(v t / x1) up to
        the fastest.
        """
        begin = ramp(self.start, self.speed)
        if self.fastest == 1.0:
            return begin
        first, speed = self._travel(ANGLES[0]), self.speed
        since = max(0.5 * self.start + first / speed, self.start)
        later = np.linspace(0.0, first / speed * log(self.fastest), KNOTS)
        return Table((*begin.time, *(since + later)), (*begin.value, *(speed * np.exp(later * speed / first))))

    def _time(self, travel: float) -> float:
        """Time [ms] at which the clamp has gone ``travel`` [mm]."""
        time, speed = np.array(self.pull.time), np.array(self.pull.value)
        gone = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
        if travel >= gone[-1]:
            return float(time[-1] + (travel - gone[-1]) / speed[-1])
        return float(np.interp(travel, gone, time))

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
