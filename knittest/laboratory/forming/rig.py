"""Forming: a stamp forms a blank in a die, with a blank holder or without; notes on the blank, and advice.

The holder is loaded first. Then the stamp moves down between a smooth start and a smooth stop, and rests for as long as
its start takes. Between them its speed is constant, or rises while the kinetic energy stays small.
"""

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from math import sqrt

import numpy as np

from knittest.base.history import Array, Frame, Mesh
from knittest.base.units import round_down
from knittest.config.structure import DIRECTIONS
from knittest.config.suspicious_values import can_derive_bending
from knittest.kernels.state import Tables
from knittest.kernels.tool_contact import FREE
from knittest.laboratory.fabric_test import TestRig
from knittest.laboratory.forming.config import FREE_BLANK, FormingRun
from knittest.laboratory.quality_checks import TRY_TEXT, SuggestedSetting, advise_finer_shells, kinetic_ratios
from knittest.laboratory.strips import pitch_vectors, stitch_counts
from knittest.models.boundary import Boundary, Readings
from knittest.models.explicit_model import State, checked_array
from knittest.models.meso import has_compliant_loops
from knittest.models.tool import Table, Tool, plane, put_table, ramp
from knittest.solve.state import Simulation
from knittest.tooling.toolset import ToolSet

#: time over which the holder's force is applied and over which the blank then settles [ms]
PRESS, SETTLE = 2.0, 1.0
#: penalty of the tools over the usual one: yarns pressed on a tool by others are near the limit of the step, and a
#: shell may lie between two tools
CONTACT_STIFFNESS_FACTORS = {"macro": 0.75, "meso": 0.25}
#: share of its limit that the kinetic energy over the work has while the stamp accelerates
KINETIC_SHARE = 0.4
#: rows of the curve before the end of which the stamp begins to stop
ROWS_AHEAD = 2.0
#: energies of which the kinetic ratio is made
KINETIC_COLUMNS = ("kinetic_mj", "external_mj", "kinetic_ratio")


class FormingTest(TestRig):
    """Form a blank of ``thickness`` [mm] with ``tools``; contact ``radius`` [mm] and ``weight`` [N] of its nodes."""

    coordinate, force = "stamp_travel_mm", "stamp_force_n"

    def __init__(self, run: FormingRun, tools: ToolSet, thickness: float, radius: Array, weight: Array) -> None:
        self.rig, self.scale, self.tools, self.radius, self.weight = run.rig, run.model.scale, tools, radius, weight
        gap = run.rig.die.floor_gap
        self.ring_length = max(self.rig.blank_length_mm, self.rig.blank_width_mm)
        self.floor = None if gap is None else -run.rig.depth_mm - 0.5 * thickness - gap
        self.holder_force = run.rig.blank_holder_force_n
        start = run.solver.ramp_ms
        begin = PRESS + SETTLE if tools.holder is not None else 0.0
        if self.scale == "meso" and has_compliant_loops(run.fabric):
            # the holder presses soft loops flat with a hundred times the work of the stamp
            self.mounted_at = begin
        self.move, stop = _stroke(begin, run.solver.speed_mm_per_ms, start, run.rig.depth_mm)
        self.duration = self.end = stop + start
        self.rise, self.full_speed_at = start, begin + start
        self.speed = max(-v for v in self.move.value)
        self.largest_speed = self.rig.stamp_speedup * self.speed
        self.run, self.table, self.now, self.stops = run, 0, 0.0, False

    def constrain(self, boundary: Boundary) -> None:
        """Tools about the blank, whose nodes are free."""
        boundary.radius[:] = self.radius
        boundary.gravity(self.weight)
        stamp, die = self._set_friction(self.tools.stamp.tool), self._set_friction(self.tools.die.tool)
        room = 3 * self.run.output.samples if self.largest_speed > self.speed else 0
        self.table = stamp.motion[2] = boundary.table(replace(self.move, room=room))
        boundary.add_tool(stamp)
        boundary.add_tool(die)
        if self.tools.holder is not None:
            holder, card = self._set_friction(self.tools.holder.tool), self.rig.holder
            holder.motion[2], holder.load[2] = FREE, boundary.table(ramp(PRESS, -self.holder_force))
            holder.mass = float(boundary.model.mass.sum()) if card.mass_g is None else card.mass_g
            holder.drag = card.damping_rate_per_ms
            boundary.add_tool(holder)
        if self.floor is not None:
            boundary.add_tool(self._set_friction(plane((0.0, 0.0, self.floor), (0.0, 0.0, 1.0))))

    def _set_friction(self, tool: Tool) -> Tool:
        tool.friction = (self.rig.static_coefficient, self.rig.kinetic_coefficient)
        tool.stiffness = CONTACT_STIFFNESS_FACTORS[self.scale]
        return tool

    def travel(self, time: float) -> float:
        """Travel of the stamp [mm] at ``time`` [ms]."""
        return -self.move.integral(time)

    def share_done(self, time: float) -> float:
        """See :class:`Rig`: the rest of the stroke continues at the present speed."""
        return time / self.end

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """See :class:`Rig`: a stamp that has accelerated ends before ``duration``."""
        return self.now >= self.end

    def adjust(self, run: Simulation) -> None:
        """Change the speed of the stamp with the kinetic energy of the newest row, or begin its stop.

        Damping falls as the speed rises, so that the damping force remains.
        """
        self.now = now = run.time
        if self.largest_speed <= self.speed or self.stops or now < self.full_speed_at or len(run.rows) < 2:
            return
        speed, way = -self.move.at(now), self.rig.depth_mm - self.travel(now)
        row = speed * (now - run.energy_rows[-2]["time_ms"])
        self.stops = way - 0.5 * speed * self.rise < ROWS_AHEAD * row
        if self.stops:
            rise = min(self.rise, 2.0 * way / speed)
            begin, brake = now + way / speed - 0.5 * rise, ramp(rise, speed)
            time, value = [begin + t for t in brake.time], [v - speed for v in brake.value]
            self.end = begin + rise + self.rise
        else:
            wanted = self._wanted_speed(run, speed)
            time, value = [now + self.rise * abs(wanted / speed - 1.0)], [-wanted]
            self.end = now + way / speed + 1.5 * self.rise
        self.move = self.move.continued(now, time, value)
        put_table(run.drive.tables, self.table, self.move)
        run.set_damping(self.speed / speed)

    def _wanted_speed(self, run: Simulation, speed: float) -> float:
        """Speed [mm/ms] at which the kinetic energy has its share of the work, from that at the present ``speed``."""
        energies = {name: np.array([row[name] for row in run.energy_rows]) for name in KINETIC_COLUMNS}
        ratio = float(kinetic_ratios(self.run, energies)[-1])
        aim = KINETIC_SHARE * 0.01 * run.solver.max_kinetic_ratio
        return float(np.clip(speed * sqrt(aim / max(ratio, 1e-9)), self.speed, self.largest_speed))

    def state(self) -> State:
        """See :class:`Rig`."""
        numbers = np.array([self.end, self.stops])
        return {"time": np.array(self.move.time), "value": np.array(self.move.value), "numbers": numbers}

    def restore(self, state: State, tables: Tables) -> None:
        """See :class:`Rig`."""
        time, value = (tuple(checked_array(state, name).tolist()) for name in ("time", "value"))
        self.move = Table(time, value)
        self.end, stops = checked_array(state, "numbers", (2,)).tolist()
        self.stops = bool(stops)
        put_table(tables, self.table, self.move)

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


def _stroke(begin: float, speed: float, rise: float, depth: float) -> tuple[Table, float]:
    """Velocity of the stamp [mm/ms] over time [ms] from ``begin`` on, slower for a small ``depth``, and its stop."""
    speed = min(speed, depth / rise) if rise > 0.0 else speed
    up = ramp(rise, -speed)
    stop = begin + rise + depth / speed
    time = (*(begin + t for t in up.time), *(stop - rise + t for t in up.time))
    return Table(time, (*up.value, *up.value[::-1])), stop


def no_bending_note(run: FormingRun) -> tuple[str, ...]:
    """Note on a macro model whose inlays do not bend in the plane; empty otherwise."""
    if run.model.scale == "meso" or run.fabric.macro.in_plane_bending is not None:
        return ()
    return (
        "inlays have no in-plane bending stiffness: a compressed flange folds into shear bands one element wide, and "
        f"forces fall with the element size; {in_plane_bending_remedy(run)}",
    )


def in_plane_bending_remedy(run: FormingRun) -> str:
    """Settings that give the inlays an in-plane bending stiffness: the switch, or numbers that cannot be derived."""
    if not can_derive_bending(run.fabric):
        return (
            "the fabric has no inlays to derive it from: give fabric.macro.in_plane_bending.warp and "
            ".weft [N mm], EI "
            "of an inlay x inlays per width"
        )
    return "use --set rig.in_plane_bending=true"


def count_swapped_crossings(run: FormingRun, mesh: Mesh, *frames: Frame) -> int:
    """Count the crossings whose warp has changed its side of the weft between two ``frames``, in all layers."""
    wales, courses = stitch_counts(run, mesh)
    along, across = (run.fabric.inlays_along(direction) for direction in DIRECTIONS)
    count = 0
    for one, other in product(along, across):
        with_warp = [w for w in range(wales) if one.has_inlay(w)]
        with_weft = [c for c in range(courses) if other.has_inlay(c)]
        heights = []
        for frame in frames:
            warp, at_warp = (v[:, with_weft] for v in pitch_vectors(mesh, frame, one.name, courses))
            weft, at_weft = (v[:, with_warp].transpose(1, 0, 2) for v in pitch_vectors(mesh, frame, other.name, wales))
            heights.append(np.sum((at_warp - at_weft) * np.cross(weft, warp), axis=2))
        count += int(np.count_nonzero(heights[0] * heights[1] < 0.0))
    return count


def advise_damping(run: FormingRun, share: float) -> SuggestedSetting | str:
    """Damping, and the speed of a free blank, that would reduce its loss to ``share`` of itself."""
    damping, speed = run.solver.damping, run.solver.speed
    free_damping, free_speed = FREE_BLANK["damping"], FREE_BLANK["speed"]
    if run.rig.blank_holder_force == 0.0 and (damping > free_damping or speed > free_speed):
        if run.model.scale == "meso":
            return f"lower solver.damping (now {damping:g}) and solver.speed (now {speed:g})"
        return f"preset quick passes with --set solver.damping={free_damping:g} --set solver.speed={free_speed:g}"
    # a flange that is damped less swings more
    why = "it grows with the root of the damping"
    return SuggestedSetting(why, "solver.damping", damping, round_down(damping * share**2), TRY_TEXT)


def advise_in_plane_bending(run: FormingRun, share: float) -> SuggestedSetting | str:
    """Finer shells, or in-plane bending, without which finer shells only fold into finer bands."""
    if run.fabric.macro.in_plane_bending is not None:
        return advise_finer_shells(run, share)
    return f"without in-plane bending finer shells only fold into finer bands: {in_plane_bending_remedy(run)}"


ADVICE: dict[str, Callable[[FormingRun, float], SuggestedSetting | str]] = {
    "damping_over_work_max": advise_damping,
    "drag_over_weight": advise_damping,
    "hourglass_over_internal_max": advise_in_plane_bending,
}
