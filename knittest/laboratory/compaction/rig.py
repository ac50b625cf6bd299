"""Compaction: two smooth plates close on a square of yarns, each at half the speed, until a pressure is reached.

Both plates move, so that the fabric's middle stands still: its drag and its inertia press on both alike. The
plates are smaller than the piece, as a presser foot is: loops at cut edges stick out and would carry the first
pressure. The yarns' cut ends, and the loops' arcs beyond the edge, stay where they are in the plane.
"""

import numpy as np
from numpy.typing import NDArray

from knittest.laboratory.compaction.config import CompactionRun
from knittest.models.boundary import TOOL_STIFFNESS, Boundary
from knittest.models.readings import Readings
from knittest.models.table import Table, ramp
from knittest.models.tool import plate

Array = NDArray[np.float64]

#: thickness of the plates, and radius of their edges, outside their nominal size [mm]
THICKNESS, EDGE = 10.0, 1.0
#: distance between fabric and plates in which it comes to rest, and way of the plates on which they creep, at a share
#: of the speed, until they press [mm]
GAP, CREEP, CREEP_SHARE = 0.1, 0.3, 0.1
#: time in which the fabric comes to rest before the plates move [ms]
REST = 12.0
#: share of the thickness at the start by which the plates close at most
MOST = 0.5
#: stiffness of the plates against a node over m / dt^2 by which a node at the edge of stability would just be stable,
#: and largest factor on what tools have usually: 1 MPa shall not press the yarns into the plates
ROOM, STIFFEST = 3.6, 4.0


class CompactionTest:
    """Plates of ``size`` (2,) [mm] at heights ``faces`` (lower, upper) [mm] on the middle of a piece.

    ``radius`` [mm] is at which its nodes touch; those of the ``rim`` stay where they are in the plane.
    """

    coordinate, force = "compaction_mm", "plate_force_n"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(
        self, run: CompactionRun, faces: tuple[float, float], size: Array, radius: Array, rim: NDArray[np.int64]
    ) -> None:
        self.rim, self.size, area = rim, size, float(np.prod(size))
        self.faces, self.area, self.radius = (faces[0] - GAP, faces[1] + GAP), area, radius
        self.stiffness = plate_stiffness(run.solver.safety)
        self.start = self.faces[1] - self.faces[0]
        self.most = run.rig.max_pressure_mpa * area
        speed = run.solver.speed_mm_per_ms
        self.closing = _closing(speed, run.solver.ramp_ms)
        end = self.closing.time[-1]
        self.duration = end + (MOST * self.start - self.closing.integral(end)) / speed

    def constrain(self, boundary: Boundary) -> None:
        """Plates below and above the middle of the piece."""
        position = boundary.model.position()
        boundary.radius[:] = self.radius
        boundary.move(self.rim, ("x", "y"))
        speeds = self.closing.value
        for centre, side in zip(plate_centres(position, self.faces), (-1.0, 1.0), strict=True):
            tool = plate(centre, plate_lengths(self.size), EDGE)
            tool.stiffness = self.stiffness
            boundary.move_tool(
                boundary.add_tool(tool), "z", Table(self.closing.time, tuple(-0.5 * side * v for v in speeds))
            )

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs through the thickness."""
        return self.start / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Way of the plates, thickness between them, force (mean of both), and pressure on the square."""
        closed = self.closing.integral(time)
        lower, upper = readings.tool_force
        force = 0.5 * float(upper[2] - lower[2])
        return {
            "compaction_mm": closed,
            "thickness_mm": self.start - closed,
            "pressure_kpa": 1e3 * force / self.area,
            "plate_force_n": force,
            "lower_force_n": -float(lower[2]),
            "upper_force_n": float(upper[2]),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over at the pressure."""
        return force >= self.most


def plate_lengths(size: Array) -> Array:
    """Lengths (3,) [mm] of a plate with its rounded edges, of a nominal ``size`` (2,) [mm]."""
    return np.append(size + 2.0 * EDGE, THICKNESS)


def plate_centres(position: Array, faces: tuple[float, float]) -> Array:
    """Centres (2, 3) [mm] of the plates with their ``faces`` (lower, upper) [mm] on the middle of a piece with nodes at
    ``position`` (n, 3).
    """
    centres = np.tile(0.5 * (position.min(axis=0) + position.max(axis=0)), (2, 1))
    centres[:, 2] = [faces[0] - 0.5 * THICKNESS, faces[1] + 0.5 * THICKNESS]
    return centres


def _closing(speed: float, ramp_time: float) -> Table:
    """Velocity [mm/ms] at which the plates close: at rest, creeping, at full speed, each after a smooth
    ramp.
    """
    slow, faster = ramp(ramp_time, CREEP_SHARE * speed), ramp(ramp_time, (1.0 - CREEP_SHARE) * speed)
    creeping = slow.time[-1] + max(CREEP / (CREEP_SHARE * speed) - ramp_time, 0.0)
    time = (0.0, *(REST + t for t in slow.time), *(REST + creeping + t for t in faster.time))
    return Table(time, (0.0, *slow.value, *(slow.value[-1] + v for v in faster.value)))


def plate_stiffness(safety: float) -> float:
    """Factor on the usual stiffness of a tool: what the time step at ``safety`` leaves room for.

    A node feels at most 4 safety^2 m / dt^2 of yarns and may feel 4 in all.
    """
    return min(max((ROOM - 4.0 * safety**2) / TOOL_STIFFNESS, 1.0), STIFFEST)


def touching_radius(position: Array, joined: NDArray[np.int64], radius: Array) -> Array:
    """Distance [mm] at which each node of ``position`` (n, 3) touches a plate: its yarn's ``radius`` (n,), less what
    the node lies off the centre line, which passes at (P[i-1] + 6 P[i] + P[i+1]) / 8 beside it.

    ``joined`` (n_el, 2) are the nodes of the beams. Ends of yarns lie on their centre line.
    """
    z = position[:, 2]
    step, both = np.zeros(len(z)), np.zeros(len(z))
    for here, there in (joined.T, joined.T[::-1]):
        np.add.at(step, here, z[there] - z[here])
        np.add.at(both, here, 1.0)
    off = np.where(both > 1.0, np.abs(step) / 8.0, 0.0)
    return np.asarray(np.maximum(radius - off, 0.5 * radius))
