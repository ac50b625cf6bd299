"""Picture frame: four hinged sides shear a square of fabric; the crosshead pulls one diagonal.

The model lies with the pulled diagonal along y, the other along x. With stretches p = cos(gamma/2) + sin(gamma/2) along
y and q = cos(gamma/2) - sin(gamma/2) along x every point of the frame moves as (x q, y p), and the crosshead by
d = sqrt(2) L (p - 1): Eq. 1 of Pham et al. (2019). A frame of longer sides than the fabric holds it by arms, which
follow the frame and carry no shear. Before that the sides close in by the slack of the mounting.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import PictureFrameRun
from knittest.models.boundary import Boundary, Readings, Table, ramp
from knittest.trellis import crosshead, frame_angle, normalised_force

Array = NDArray[np.float64]

#: shear angles at which results are read [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: knots of the motion tables, for each way of the crosshead
KNOTS = 2000


class PictureFrameTest:
    """Shears all ``held`` nodes with the frame, forth and back between the angles of ``rig.turns``."""

    coordinate, force = "frame_shear_angle_deg", "shear_force_n"

    def __init__(self, run: PictureFrameRun, held: NDArray[np.int64]) -> None:
        rig = run.rig
        self.fabric_side, self.held = rig.kernel("side"), held
        self.side = self.fabric_side if rig.frame_side is None else rig.kernel("frame_side")
        self.slack = rig.kernel("mounting_slack")
        start = run.solver.kernel("ramp")
        self.close = ramp(start, self.slack)
        stops = [crosshead(np.deg2rad(a), self.side) for a in (*rig.turns, rig.max_angle)]
        self.pull = _there_and_back(start, run.solver.kernel("speed"), stops)
        self.duration = self.pull.time[-1]
        self.times = np.linspace(0.0, self.duration, KNOTS * len(stops))
        travel = np.array([self.pull.integral(t) for t in self.times])
        reached = (crosshead(np.deg2rad(a), self.side) for a in ANGLES if a <= rig.max_angle)
        self.marks = tuple(float(np.argmax(travel >= min(d, travel.max()))) / len(travel) for d in reached)

    def stretches(self, time: float) -> tuple[float, float]:
        """p and q at ``time`` [ms]."""
        p = 1.0 + self.pull.integral(time) / (sqrt(2.0) * self.side)
        return p, sqrt(2.0 - p * p)

    def constrain(self, boundary: Boundary) -> None:
        """Sides hinged on each other carry the needles, on which the fabric may turn."""
        times = self.times
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
        return self.fabric_side / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Crosshead displacement, shear angle, the force that is work-conjugate to the displacement, and normalised."""
        p, q = self.stretches(time)
        travel = sqrt(2.0) * self.side * (p - 1.0)
        angle = frame_angle(travel, self.side)
        along, across = readings.reaction[:2]
        force = (1.0 - self.slack) * float(along - across * p / q) / (sqrt(2.0) * self.side)
        return {
            "displacement_mm": travel,
            "frame_shear_angle_deg": float(np.rad2deg(angle)),
            "shear_force_n": force,
            "normalised_shear_force_n_per_mm": float(normalised_force(force, angle, self.fabric_side, self.side)),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Only the largest angle ends the test."""
        return False


def _there_and_back(start: float, speed: float, stops: Sequence[float]) -> Table:
    """Velocity [mm/ms] that from ``start`` [ms] on drives from 0 to each of ``stops`` [mm], smoothly within ``start``
    from rest to ``speed`` and, before a turn, back; a way too short for that is driven slower.
    """
    time, value = [0.0], [0.0]
    begin = start
    for k, (here, there) in enumerate(pairwise([0.0, *stops])):
        rate = min(speed, abs(there - here) / start) if start > 0.0 else speed
        rise = ramp(start, float(np.sign(there - here)) * rate)
        stopping = 0.5 if k == len(stops) - 1 else 0.0  # the test ends at full speed
        slow = begin + abs(there - here) / rate + stopping * start
        time += [begin + t for t in rise.time]
        value += rise.value
        if stopping:
            time, value, begin = [*time, slow], [*value, rise.value[-1]], slow
        else:
            time += [slow + t for t in rise.time]
            value += rise.value[::-1]
            begin = slow + start
    return Table(tuple(time), tuple(value))
