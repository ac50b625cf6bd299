"""Friction: a strip between two plates, pressed together under force control, is pulled out; the pressure between them.

In the model the clamp stands still and the plates move, which is the same test at constant speed: the strip is nearly
at rest, so damping and inertia do not change the pull force.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array, History, Mesh
from knittest.config.structure import direction_of
from knittest.laboratory.fabric_test import TestRig
from knittest.laboratory.friction.config import FrictionRig, FrictionRun
from knittest.laboratory.strips import AXIS, creep_speed, pitch
from knittest.models.boundary import Boundary, Readings
from knittest.models.tool import plate, ramp

Index = NDArray[np.int64]

#: least time over which the normal force is applied, then settles, and at which the pull begins [ms]: longer by
#: :meth:`FrictionRun.slowness`
PRESS, SETTLE, PRESSED = 1.0, 0.5, 1.5
#: drag of a plate that falls slowly [1/ms], as it bounces on soft loops at some 1.5 kHz, and least time to settle [ms]
SOFT_DRAG, SETTLE_SOFT = 2.0, 15.0
#: share of the travel, at its end, over which the kinetic level and the pressure are means
KINETIC_SHARE = 0.5
#: travel [mm] at a share of the speed, in which a strip of shells begins to slip: a faster one would swing
CREEP, CREEP_SHARE = 0.5, 0.05
#: thickness of the plates and radius of their edges, outside their nominal size [mm]
THICKNESS, EDGE = 10.0, 1.0


class FrictionTest(TestRig):
    """Plates at heights ``faces`` (lower, upper) [mm], a strip along ``axis``; contact ``radius`` [mm] of its nodes.

    The nodes ``edges`` keep their place across the strip.
    """

    coordinate, force = "displacement_mm", "pull_force_n"

    def __init__(
        self, run: FrictionRun, axis: int, faces: tuple[float, float], radius: Array, edges: Index | None = None
    ) -> None:
        self.rig, self.axis, self.faces, self.radius = run.rig, axis, faces, radius
        self.edges = np.zeros(0, np.int64) if edges is None else edges
        self.facts = {"lower_face_mm": faces[0], "upper_face_mm": faces[1]}
        self.ring_length = self.rig.length_mm
        self.least_grip = pitch(run, run.rig.direction) if run.pulls_loops and run.model.scale == "meso" else 0.0
        self.slower = run.slowness(faces[1] - faces[0], self.rig.normal_force_n)
        soft = self.slower > 1.0
        self.drag = SOFT_DRAG if soft else 0.0
        self.pressed = PRESS * self.slower + max(SETTLE * self.slower, SETTLE_SOFT) if soft else PRESSED
        speed, rise = run.solver.speed_mm_per_ms, run.solver.ramp_ms
        share = 1.0 if run.pulls_loops else CREEP_SHARE
        full = self.pressed + (rise if run.pulls_loops else 0.5 * rise + CREEP / (CREEP_SHARE * speed))
        self.pull = creep_speed(-speed, share, rise, self.pressed, full)
        end = self.pull.time[-1]
        kinetic_from = (1.0 - KINETIC_SHARE) * run.rig.travel_mm
        self.averaged_from = end + max(kinetic_from + self.pull.integral(end), 0.0) / speed
        self.duration = end + (run.rig.travel_mm + self.pull.integral(end)) / speed

    def constrain(self, boundary: Boundary) -> None:
        """Plates under all but the pulled end of the strip, which is gripped."""
        position = boundary.model.position()
        along = position[:, self.axis]
        boundary.radius[:] = self.radius
        mass, pull = float(boundary.model.mass.sum()), boundary.table(self.pull)
        # gripped is the last tenth of what lies outside the plates, a pitch at least
        grip = max(0.1 * (float(np.ptp(along)) - self.rig.plate_length_mm), self.least_grip)
        gripped = along >= along.max() - grip
        boundary.grip(np.flatnonzero(gripped), "xyz"[self.axis])
        if len(self.edges):
            boundary.move(self.edges[~gripped[self.edges]], "xy"[1 - self.axis])
        centres, lengths = plates(self.rig, self.axis, position, self.faces)
        for centre, side in zip(centres, (-1.0, 1.0), strict=True):
            tool = plate(centre, lengths, EDGE)
            tool.friction = (self.rig.static_coefficient, self.rig.kinetic_coefficient)
            tool.motion[self.axis] = pull
            if side > 0.0:
                tool.motion[2], tool.load[2] = -2, boundary.table(ramp(PRESS * self.slower, -self.rig.normal_force_n))
                # without drag on stiff loops: its loss would exceed 5 % of the pressing work
                tool.mass, tool.drag = mass, self.drag
            boundary.add_tool(tool)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Travel of the clamp against the plates, pull force, force on the lower plate and height of the upper one."""
        lower, upper = readings.tool_force
        return {
            "displacement_mm": -self.pull.integral(time),
            "pull_force_n": float(readings.reaction[0]),
            "normal_force_n": -float(lower[2]),
            "upper_force_n": float(upper[2]),
            "plate_travel_mm": float(readings.tool_position[1, 2]) - self.faces[1] - 0.5 * THICKNESS,
        }


def pull_axis(run: FrictionRun) -> int:
    """Axis (0: x, 1: y) along which the strip is pulled: always y of shells."""
    return AXIS[run.rig.direction] if run.model.scale == "meso" else 1


def plates(rig: FrictionRig, axis: int, position: Array, faces: tuple[float, float]) -> tuple[Array, Array]:
    """Centres (2, 3) and lengths (3,) [mm] of plates with ``faces`` on a strip of nodes (n, 3), from its free end."""
    low, high = position.min(axis=0), position.max(axis=0)
    centres, lengths = np.tile(0.5 * (low + high), (2, 1)), np.full(3, THICKNESS)
    centres[:, axis] = low[axis] + 0.5 * rig.plate_length_mm
    centres[:, 2] = [faces[0] - 0.5 * THICKNESS, faces[1] + 0.5 * THICKNESS]
    lengths[[axis, 1 - axis]] = rig.plate_length_mm + 2.0 * EDGE, rig.plate_width_mm + 2.0 * EDGE
    return centres, lengths


#: tools of the friction rig, in their order: the lower plate lies on the technical back, the upper on the face
PLATES = ("back", "face")


@dataclass(frozen=True)
class PressureMap:
    """Mean pressure [MPa] of each plate, (n_tools, n_x, n_y), in cells between ``x`` and ``y`` [mm]."""

    x: Array
    y: Array
    pressure: Array

    @property
    def force(self) -> Array:
        """Normal force [N] of each plate, (n_tools,)."""
        area = np.diff(self.x)[:, None] * np.diff(self.y)
        return np.array([float((p * area).sum()) for p in self.pressure])

    def table(self) -> dict[str, Array]:
        """One row a cell: its centre and the pressure of both plates."""
        middle = (0.5 * (edges[1:] + edges[:-1]) for edges in (self.x, self.y))
        x, y = np.meshgrid(*middle, indexing="ij")
        columns = {"x_mm": x.ravel(), "y_mm": y.ravel()}
        return columns | {f"pressure_{p}_mpa": v.ravel() for p, v in zip(PLATES, self.pressure, strict=True)}


def pressure_map(history: History, cell: float) -> PressureMap:
    """Mean pressure in cells of side ``cell`` [mm] in the last frame; elements share the force on a node evenly."""
    mesh, position = history.mesh, history.frames[-1].position
    centre = position[mesh.cells].mean(axis=1)[:, :2]
    forces = [_element_forces(mesh, force) for force in history.tool_force]
    edges = [_cell_edges(centre[:, axis], cell) for axis in (0, 1)]
    grids = [np.histogram2d(centre[:, 0], centre[:, 1], edges, weights=f)[0] / cell**2 for f in forces]
    return PressureMap(edges[0], edges[1], np.array(grids))


def _element_forces(mesh: Mesh, force: Array) -> Array:
    """Force of each element, (n_el,), from those of the nodes; nodes without elements carry none."""
    degree = np.bincount(mesh.cells.ravel(), minlength=len(force))
    return np.asarray((force / np.maximum(degree, 1))[mesh.cells].sum(axis=1))


def _cell_edges(at: Array, cell: float) -> Array:
    low, high = float(at.min()), float(at.max())
    count = int((high - low) / cell + 1e-6) + 1
    half = 0.5 * cell * count
    return np.linspace(0.5 * (low + high) - half, 0.5 * (low + high) + half, count + 1)


def force_shares(history: History) -> dict[str, float]:
    """Share of the plates' force [%] that the loops and the inlays of each direction carry."""
    mesh = history.mesh
    total = np.zeros(len(mesh.part_names))
    for force in history.tool_force:
        total += np.bincount(mesh.part, _element_forces(mesh, force), len(mesh.part_names))
    whole = max(float(total.sum()), 1e-12)
    found: dict[str, float] = {}
    for name, value in zip(mesh.part_names, total, strict=True):
        found[direction_of(name)] = found.get(direction_of(name), 0.0) + 100.0 * float(value) / whole
    return found
