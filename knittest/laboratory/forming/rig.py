"""Forming: a stamp draws a blank into a die; a blank holder, if there is one, is pressed on the blank by a force.

The holder is loaded first; then the stamp moves down at constant speed between a smooth start and a smooth stop, and
rests for as long as its start takes.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.tool_contact import FREE
from knittest.laboratory.forming.config import FormingRun
from knittest.models.boundary import Boundary
from knittest.models.readings import Readings
from knittest.models.table import Table, ramp
from knittest.models.tool import Tool, plane
from knittest.tooling.toolset import ToolSet

Array = NDArray[np.float64]

#: time over which the holder's force is applied and over which the blank then settles [ms]
PRESS, SETTLE = 2.0, 1.0
#: penalty of the tools over the usual one: yarns that are pressed on a tool by others are near the limit of the step,
#: and a shell may lie between two tools
SOFTER = {"macro": 0.75, "meso": 0.25}


class FormingTest:
    """Draws a blank of ``thickness`` [mm] by ``tools``; ``radius`` [mm] of its nodes against them, ``weight`` [N] of
    each, (n,).
    """

    coordinate, force = "stamp_travel_mm", "stamp_force_n"
    mounted_at, averaged_from, locks = 0.0, np.inf, False
    marks: tuple[float, ...] = ()

    def __init__(self, run: FormingRun, tools: ToolSet, thickness: float, radius: Array, weight: Array) -> None:
        self.rig, self.scale, self.tools, self.radius, self.weight = run.rig, run.model.scale, tools, radius, weight
        gap = run.rig.die.floor_gap
        self.floor = None if gap is None else -run.rig.depth_mm - 0.5 * thickness - gap
        self.holder_force = run.rig.blank_holder_force_n
        start = run.solver.ramp_ms
        begin = PRESS + SETTLE if tools.holder is not None else 0.0
        self.move, stop = _stroke(begin, run.solver.speed_mm_per_ms, start, run.rig.depth_mm)
        self.duration = stop + start

    def constrain(self, boundary: Boundary) -> None:
        """Tools about the blank, whose nodes are free."""
        boundary.radius[:] = self.radius
        boundary.gravity(self.weight)
        stamp, die = self._rubbing(self.tools.stamp.tool), self._rubbing(self.tools.die.tool)
        stamp.motion[2] = boundary.table(self.move)
        boundary.add_tool(stamp)
        boundary.add_tool(die)
        if self.tools.holder is not None:
            holder, card = self._rubbing(self.tools.holder.tool), self.rig.holder
            holder.motion[2], holder.load[2] = FREE, boundary.table(ramp(PRESS, -self.holder_force))
            holder.mass = float(boundary.model.mass.sum()) if card.mass_g is None else card.mass_g
            holder.drag = card.drag_per_ms
            boundary.add_tool(holder)
        if self.floor is not None:
            boundary.add_tool(self._rubbing(plane((0.0, 0.0, self.floor), (0.0, 0.0, 1.0))))

    def _rubbing(self, tool: Tool) -> Tool:
        tool.friction = (self.rig.static_coefficient, self.rig.kinetic_coefficient)
        tool.stiffness = SOFTER[self.scale]
        return tool

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs across the blank."""
        return max(self.rig.blank_length_mm, self.rig.blank_width_mm) / wave_speed

    def travel(self, time: float) -> float:
        """Travel of the stamp [mm] at ``time`` [ms]."""
        return -self.move.integral(time)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Travel and force of the stamp, force on the die, force and travel of the holder."""
        force, place = readings.tool_force, readings.tool_position
        found = {
            "stamp_travel_mm": self.travel(time),
            "stamp_force_n": float(force[0, 2]),
            "die_force_n": -float(force[1, 2]),
        }
        if self.tools.holder is not None:
            start = float(self.tools.holder.tool.position[2])
            found |= {"holder_force_n": float(force[2, 2]), "holder_travel_mm": float(place[2, 2]) - start}
        if self.floor is not None:
            found["floor_force_n"] = -float(force[-1, 2])
        return found

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Only the depth ends the test."""
        return False


def _stroke(begin: float, speed: float, rise: float, depth: float) -> tuple[Table, float]:
    """Velocity of the stamp [mm/ms] over time [ms] from ``begin`` on, and when it stops.

    A ``depth`` [mm] too small for ``speed`` is drawn slower.
    """
    speed = min(speed, depth / rise) if rise > 0.0 else speed
    up = ramp(rise, -speed)
    stop = begin + rise + depth / speed
    time = (*(begin + t for t in up.time), *(stop - rise + t for t in up.time))
    return Table(time, (*up.value, *up.value[::-1])), stop
