"""Picture frame: four hinged sides shear a square of fabric; the crosshead pulls one diagonal.

The model lies with the pulled diagonal along y, the other along x. With stretches p = cos(gamma/2) + sin(gamma/2) along
y and q = cos(gamma/2) - sin(gamma/2) along x every point of the frame moves as (x q, y p), and the crosshead by
d = sqrt(2) L (p - 1): Eq. 1 of Pham et al. (2019). Before that the sides close in by the slack of the mounting.
"""

from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import PictureFrameRun
from knittest.models.boundary import Boundary, Readings, Table, ramp

Array = NDArray[np.float64]

#: shear angles at which results are read [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: knots of the motion tables
KNOTS = 2000


def frame_angle(displacement: float, side: float) -> float:
    """Shear angle [rad] at a crosshead displacement [mm] (Eq. 1; the print's sqrt(2L) is a misprint)."""
    return pi / 2.0 - 2.0 * float(np.arccos(min((sqrt(2.0) * side + displacement) / (2.0 * side), 1.0)))


def crosshead(angle: float, side: float) -> float:
    """Crosshead displacement [mm] at a shear angle [rad]: the inverse of :func:`frame_angle`."""
    return sqrt(2.0) * side * (np.cos(0.5 * angle) + np.sin(0.5 * angle) - 1.0)


class PictureFrameTest:
    """Shears all ``held`` nodes with the frame."""

    coordinate, force = "frame_shear_angle_deg", "shear_force_n"

    def __init__(self, run: PictureFrameRun, held: NDArray[np.int64]) -> None:
        self.side, self.held = run.rig.kernel("side"), held
        self.end = crosshead(np.deg2rad(run.rig.max_angle), self.side)
        self.slack = run.rig.kernel("mounting_slack")
        start = run.solver.kernel("ramp")
        pull = ramp(start, run.solver.kernel("speed"))
        self.close = ramp(start, self.slack)
        self.pull = Table((0.0, *(start + t for t in pull.time)), (0.0, *pull.value))
        speed = pull.value[-1]
        self.duration = 1.5 * start + self.end / speed
        marks = [crosshead(np.deg2rad(a), self.side) / speed for a in ANGLES if a <= run.rig.max_angle]
        self.marks = tuple(min((1.5 * start + t) / self.duration, 1.0) for t in marks)

    def stretches(self, time: float) -> tuple[float, float]:
        """p and q at ``time`` [ms]."""
        p = 1.0 + min(self.pull.integral(time), self.end) / (sqrt(2.0) * self.side)
        return p, sqrt(2.0 - p * p)

    def constrain(self, boundary: Boundary) -> None:
        """Sides hinged on each other carry the needles, on which the fabric may turn."""
        times = np.linspace(0.0, self.duration, KNOTS)
        open_share = 1.0 - np.interp(times, self.close.time, self.close.value)
        p, q = np.array([self.stretches(t) for t in times]).T * open_share
        position = boundary.model.position()[self.held]
        for dof, stretch in (("y", p), ("x", q)):
            boundary.move(
                self.held, dof, Table(tuple(times), tuple(np.gradient(stretch, times))), position[:, "xy".index(dof)]
            )
        boundary.move(self.held, "z")

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along a side."""
        return self.side / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Crosshead displacement, shear angle and the force that is work-conjugate to the displacement."""
        p, q = self.stretches(time)
        travel = sqrt(2.0) * self.side * (p - 1.0)
        along, across = readings.reaction[:2]
        return {
            "displacement_mm": travel,
            "frame_shear_angle_deg": float(np.rad2deg(frame_angle(travel, self.side))),
            "shear_force_n": (1.0 - self.slack) * float(along - across * p / q) / (sqrt(2.0) * self.side),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Only the largest angle ends the test."""
        return False
