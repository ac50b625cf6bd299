"""Friction: a strip between two plates, pressed together under force control, is pulled out by one end."""

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import FrictionRun
from knittest.models.boundary import Boundary, Readings, Table, plate, ramp

Array = NDArray[np.float64]

#: time over which the normal force is applied and over which it then settles [ms]
PRESS, SETTLE = 3.0, 3.0
#: mass of the pressing plate [g] and its drag [1/ms]
PLATE_MASS, PLATE_DRAG = 50.0, 50.0
#: thickness of the plates and radius of their edges, outside their nominal size [mm]
THICKNESS, EDGE = 10.0, 1.0


class FrictionTest:
    """Plates at heights ``faces`` (lower, upper) [mm], a strip along ``axis``; contact ``radius`` [mm] of its nodes."""

    coordinate, force = "displacement_mm", "pull_force_n"
    marks: tuple[float, ...] = ()

    def __init__(self, run: FrictionRun, axis: int, faces: tuple[float, float], radius: Array) -> None:
        self.rig, self.axis, self.faces, self.radius = run.rig, axis, faces, radius
        pull = ramp(run.solver.kernel("ramp"), run.solver.kernel("speed"))
        self.start = PRESS + SETTLE
        self.pull = Table((0.0, *(self.start + t for t in pull.time)), (0.0, *pull.value))
        self.duration = self.start + 0.5 * run.solver.kernel("ramp") + run.rig.kernel("travel") / pull.value[-1]

    def constrain(self, boundary: Boundary) -> None:
        """Plates under all but the pulled end of the strip, which is gripped."""
        position = boundary.model.position()
        low, high = position.min(axis=0), position.max(axis=0)
        along = position[:, self.axis]
        boundary.radius[:] = self.radius
        boundary.grip(np.flatnonzero(along >= high[self.axis] - self._grip(along)), "xyz"[self.axis], self.pull)
        centre = 0.5 * (low + high)
        centre[self.axis] = low[self.axis] + 0.5 * self.rig.kernel("plate_length")
        lengths = np.full(3, THICKNESS)
        lengths[self.axis] = self.rig.kernel("plate_length") + 2.0 * EDGE
        lengths[1 - self.axis] = self.rig.kernel("plate_width") + 2.0 * EDGE
        for face, side in zip(self.faces, (-1.0, 1.0), strict=True):
            centre[2] = face + 0.5 * side * THICKNESS
            tool = plate(centre, lengths, EDGE)
            tool.friction = (self.rig.static_coefficient, self.rig.kinetic_coefficient)
            if side > 0.0:
                tool.motion[2], tool.load[2] = -2, boundary.table(ramp(PRESS, -self.rig.kernel("normal_force")))
                tool.mass, tool.drag = PLATE_MASS, PLATE_DRAG
            boundary.add_tool(tool)

    def _grip(self, along: Array) -> float:
        """Length of the end that is gripped: the last tenth of what sticks out of the plates."""
        return 0.1 * (float(np.ptp(along)) - self.rig.kernel("plate_length"))

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along the strip."""
        return self.rig.kernel("length") / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Travel of the clamp, pull force, force on the lower plate and height of the upper one."""
        lower, upper = readings.tool_force
        return {
            "displacement_mm": self.pull.integral(time),
            "pull_force_n": float(readings.reaction[0]),
            "normal_force_n": -float(lower[2]),
            "upper_force_n": float(upper[2]),
            "plate_travel_mm": float(readings.tool_position[1, 2]) - self.faces[1] - 0.5 * THICKNESS,
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Only the travel ends the test."""
        return False
