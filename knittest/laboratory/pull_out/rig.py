"""Pull-out: the end of one inlay is drawn out of the fabric along it, all other yarns are held by clamps.

The inlay comes to rest with the fabric first. It moves slowly: its inertia is small against a friction of some
hundredths of a newton a crossing.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.laboratory.pull_out.config import PullOutRun
from knittest.models.boundary import Boundary
from knittest.models.readings import Readings
from knittest.models.table import Table, ramp

Index = NDArray[np.int64]

#: time in which the piece comes to rest before the pull [ms]
REST = 5.0
#: way of the clamp [mm] in which the inlay lets go, and frames in it: they say where its free end is
LETS_GO, FRAMES = 1.0, 16


class PullOutTest:
    """Pulls the nodes ``pulled`` along ``axis`` while those ``held`` stay; ``length`` [mm] of the inlay is embedded."""

    coordinate, force = "displacement_mm", "pull_force_n"
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(self, run: PullOutRun, axis: int, pulled: Index, held: Index, length: float) -> None:
        self.axis, self.pulled, self.held, self.length = axis, pulled, held, length
        speed = ramp(run.solver.ramp_ms, run.solver.speed_mm_per_ms)
        self.speed = Table((0.0, *(REST + t for t in speed.time)), (0.0, *speed.value))
        end = self.speed.time[-1]
        rest = run.rig.travel_mm - self.speed.integral(end)
        self.duration = end + max(rest, 0.0) / run.solver.speed_mm_per_ms
        ways = np.linspace(0.0, min(LETS_GO, run.rig.travel_mm), FRAMES + 1)
        times = np.linspace(0.0, self.duration, 2000)
        moved = np.array([self.speed.integral(t) for t in times])
        self.marks = tuple(float(t) / self.duration for t in np.interp(ways, moved[moved > 0.0], times[moved > 0.0]))

    def constrain(self, boundary: Boundary) -> None:
        """Grip the inlay's end and the piece."""
        along = "xyz"[self.axis]
        boundary.grip(self.pulled, along, self.speed)
        boundary.grip(self.held, along)

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along the inlay."""
        return self.length / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Way of the clamp, its force, and that of the piece's clamp."""
        pulled, held = readings.reaction[:2]
        return {
            "displacement_mm": self.speed.integral(time),
            "pull_force_n": float(pulled),
            "clamp_force_n": -float(held),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Only the travel ends the test."""
        return False
