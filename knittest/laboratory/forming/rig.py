"""Forming: a stamp forms a blank in a die; a blank holder, if there is one, is pressed on the blank by a force. Notes
on the blank and advice where the test fails.

The holder is loaded first; then the stamp moves down at constant speed between a smooth start and a smooth stop, and
rests for as long as its start takes.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, Mesh
from knittest.base.units import rounded_down
from knittest.kernels.tool_contact import FREE
from knittest.laboratory.forming.config import FREE_BLANK, FormingRun
from knittest.laboratory.judging import Setting, finer_shells
from knittest.laboratory.strips import pieces
from knittest.models.boundary import Boundary, Readings
from knittest.models.tool import Table, Tool, plane, ramp
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


def free_yarns(run: FormingRun) -> tuple[str, ...]:
    """A note on shells of ``run`` whose inlays do not bend in the plane; none on others, and none on yarns."""
    if run.model.scale == "meso" or run.fabric.macro.in_plane_bending is not None:
        return ()
    return (
        "inlays do not bend in the plane of the shells: a compressed flange folds into bands of shear one element "
        f"wide, and forces fall with the element size; {in_plane_bending(run)}",
    )


def in_plane_bending(run: FormingRun) -> str:
    """Settings of ``run`` that make the inlays bend in the plane: the switch, or numbers that cannot be derived."""
    if run.fabric.reinforcing is None:
        return (
            "the fabric describes no inlays to derive the stiffness from: give fabric.macro.in_plane_bending.warp and "
            ".weft [N mm], EI of an inlay x inlays per width"
        )
    return "use --set rig.in_plane_bending=true"


def above(mesh: Mesh, frame: Frame) -> Array:
    """Distance [mm] of the warp above the weft along their common normal at every crossing, (n_warp, n_weft)."""
    (warp, at_warp), (weft, at_weft) = (pieces(mesh, frame, system) for system in ("warp", "weft"))
    across, at = weft.transpose(1, 0, 2), at_weft.transpose(1, 0, 2)
    normal = np.cross(across, warp)
    height: Array = np.sum((at_warp - at) * normal, axis=2) / np.linalg.norm(normal, axis=2)
    return height


def out_of_order(mesh: Mesh, first: Frame, last: Frame) -> int:
    """Crossings whose warp has come to lie on the other side of the weft between two frames."""
    return int(np.count_nonzero(above(mesh, first) * above(mesh, last) < 0.0))


def less_damping(run: FormingRun, share: float) -> Setting | str:
    """Damping, with the speed of a free blank, at which its loss comes down to ``share`` of itself."""
    damping, speed = run.solver.damping, run.solver.speed
    free_damping, free_speed = FREE_BLANK["damping"], FREE_BLANK["speed"]
    if run.rig.blank_holder_force == 0.0 and (damping > free_damping or speed > free_speed):
        if run.model.scale == "meso":
            return f"lower solver.damping, which is {damping:g}, and solver.speed, which is {speed:g}"
        return f"solver.damping={free_damping:g} with solver.speed={free_speed:g} passes on shells of quick"
    # a flange that is damped less swings more, so its loss falls about with the root of the damping
    why = "it goes with the root of the damping"
    return Setting(why, "solver.damping", damping, rounded_down(damping * share**2), "try {}")


def held_in_the_plane(run: FormingRun, share: float) -> Setting | str:
    """Inlays that bend in the plane: without, finer shells only fold into finer bands, at more hourglass energy."""
    if run.fabric.macro.in_plane_bending is not None:
        return finer_shells(run, share)
    return f"shells whose inlays do not bend in the plane fold into bands, the finer the more: {in_plane_bending(run)}"


ADVICE: dict[str, Callable[[FormingRun, float], Setting | str]] = {
    "damping_over_work_max": less_damping,
    "drag_over_weight": less_damping,
    "hourglass_over_internal_max": held_in_the_plane,
}
