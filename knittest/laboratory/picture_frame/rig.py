"""Picture frame: four hinged sides shear a square of fabric; the crosshead pulls one diagonal.

The pulled diagonal lies along y, the other along x. With stretches p = cos(gamma/2) + sin(gamma/2) along y and q =
cos(gamma/2) - sin(gamma/2) along x every point of the frame moves as (x q, y p), and the crosshead by d = sqrt(2) L (p
- 1): Eq. 1 of Pham et al. (2019). A frame with longer sides than the fabric holds it by arms, which follow the frame
and carry no shear. Before the shear the sides close in by the slack of the mounting.

The shear angle grows at a constant rate: the kinetic energy of evenly sheared fabric, m L^2 / 12 (p'^2 + q'^2) / 2, is
then constant, so its inertia does no work and the crosshead's force is that of the fabric at any speed. Damping acts on
the velocity relative to evenly sheared fabric: it damps vibrations and hardly changes the force.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from knittest.base.history import Array, Body, History
from knittest.fabric.strip import rotate_to_bias
from knittest.laboratory.fabric_test import TestRig
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.pictures import ARMS, WIDE
from knittest.laboratory.strips import plate_block, values_at_frames
from knittest.materials.trellis import crosshead, normalised_force
from knittest.models.boundary import Boundary, Readings
from knittest.models.meso import has_compliant_loops
from knittest.models.tool import Table, ramp

#: shear angles at which results are read [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: angle [deg] up to which the frame accelerates soft yarns at least: fabrics that hardly resist shear would swing on
#: after a shorter ramp, however slow the frame is
SOFT_START = 5.0
#: knots of the motion tables, for each way of the crosshead
KNOTS = 2000


class PictureFrameTest(TestRig):
    """Shear all ``held`` nodes with the frame, forth and back between the angles of ``rig.reversal_angles``."""

    coordinate, force = "frame_shear_angle_deg", "shear_force_n"
    locks = True

    def __init__(self, run: PictureFrameRun, held: NDArray[np.int64], area: float) -> None:
        """``area`` [mm2] of the fabric: in a meso model of whole pitches."""
        rig = run.rig
        self.fabric_side, self.held = sqrt(area), held
        self.ring_length = self.fabric_side
        self.side = rig.side_mm if rig.frame_side_mm is None else rig.frame_side_mm
        self.slack = rig.mounting_slack_fraction
        start = ramp_time(run)
        self.close = ramp(start, self.slack)
        stops = np.deg2rad(rig.stops).tolist()
        self.mounted_at = start
        self.shear = _shear_rate(start, sqrt(2.0) * run.solver.speed_mm_per_ms / self.side, stops, rig.cycles > 0)
        self.duration = self.shear.time[-1]
        self.times = np.linspace(0.0, self.duration, KNOTS * len(stops))
        angles = np.array([self.angle(t) for t in self.times])
        self.marks = tuple(
            float(np.argmax(angles >= min(a, angles.max()))) / len(angles)
            for a in np.deg2rad([a for a in ANGLES if a <= rig.max_angle])
        )

    def angle(self, time: float) -> float:
        """Shear angle [rad] at ``time`` [ms]."""
        return self.shear.integral(time)

    def stretches(self, time: float) -> tuple[float, float]:
        """p and q at ``time`` [ms]."""
        half = 0.5 * self.angle(time)
        return cos(half) + sin(half), cos(half) - sin(half)

    def constrain(self, boundary: Boundary) -> None:
        """Move the needles with the sides of the frame; the fabric may turn on them."""
        times = self.times
        open_share = 1.0 - np.interp(times, self.close.time, self.close.value)
        p, q = np.array([self.stretches(t) for t in times]).T * open_share
        position = boundary.model.position()
        free = np.setdiff1d(np.arange(len(position)), self.held)
        for dof, stretch in (("y", p), ("x", q)):
            place, rate = position[:, "xy".index(dof)], Table(tuple(times), tuple(np.gradient(stretch, times)))
            boundary.move(self.held, dof, rate, place[self.held])
            boundary.guide(free, dof, rate, place[free])
        boundary.move(self.held, "z")

    def carried(self, energies: dict[str, Array], mass: Array, start: Array) -> Array:
        """Kinetic energy [mJ] at the rows of ``energies`` of ``mass`` (n,) that moves from ``start`` with the frame."""
        time = energies["time_ms"]
        step = 1e-3 * self.duration
        before, after = (np.array([self.stretches(t + s) for t in time]) for s in (-0.5 * step, 0.5 * step))
        rate2 = ((after - before) / step) ** 2
        return np.asarray(0.5 * (rate2[:, 0] * (mass @ start[:, 1] ** 2) + rate2[:, 1] * (mass @ start[:, 0] ** 2)))

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Crosshead displacement, shear angle, the force that is work-conjugate to the displacement, and normalised."""
        p, q = self.stretches(time)
        angle = self.angle(time)
        along, across = readings.reaction[:2]
        force = (1.0 - self.slack) * float(along - across * p / q) / (sqrt(2.0) * self.side)
        return {
            "displacement_mm": crosshead(angle, self.side),
            "frame_shear_angle_deg": float(np.rad2deg(angle)),
            "shear_force_n": force,
            "normalised_shear_force_n_per_mm": float(normalised_force(force, angle, self.fabric_side, self.side)),
        }


def start_up_angle(run: PictureFrameRun) -> float:
    """Shear angle [deg] up to which the frame accelerates the fabric."""
    first = np.deg2rad(run.rig.stops[0])
    return float(np.rad2deg(0.5 * min(_full_rate(run) * ramp_time(run), first)))


def ramp_time(run: PictureFrameRun) -> float:
    """Time [ms] in which the frame reaches its speed: that of the solver, or longer with soft yarns."""
    if run.model.scale == "macro" or not has_compliant_loops(run.fabric):
        return run.solver.ramp_ms
    return max(run.solver.ramp_ms, 2.0 * float(np.deg2rad(SOFT_START)) / _full_rate(run))


def _full_rate(run: PictureFrameRun) -> float:
    """Rate of the shear angle [rad/ms] at the speed of the crosshead."""
    return sqrt(2.0) * run.solver.speed_mm_per_ms / (run.rig.frame_side_mm or run.rig.side_mm)


def _shear_rate(start: float, speed: float, stops: Sequence[float], halts: bool) -> Table:
    """Rate [rad/ms] from 0 to each of ``stops`` [rad] from ``start`` [ms] on, smooth, to rest if it ``halts``."""
    time, value = [0.0], [0.0]
    begin = start
    for k, (here, there) in enumerate(pairwise([0.0, *stops])):
        rate = min(speed, abs(there - here) / start) if start > 0.0 else speed
        rise = ramp(start, float(np.sign(there - here)) * rate)
        stopping = 0.5 if k == len(stops) - 1 and not halts else 0.0
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


#: bars at the ends of the weft, then at those of the warp
NAMES = (("lower left bar", "upper right bar"), ("lower right bar", "upper left bar"))
#: height of a bar above and below the fabric over its width: small, so that wrinkles are seen from the side
OUT = 0.2
#: share by which a frame is wider than the fabric where it has arms
WIDER = 1e-6


def bars(history: History, sides: tuple[float, float]) -> list[Body]:
    """Bars of a frame of ``sides`` along weft and warp [mm], from hinge to hinge, and arms to the fabric."""
    half = 0.5 * np.deg2rad(values_at_frames(history, "frame_shear_angle_deg"))
    stretch = np.column_stack([np.cos(half) - np.sin(half), np.cos(half) + np.sin(half), np.ones_like(half)])
    found = []
    for normal, names in enumerate(NAMES):
        turn = Rotation.from_euler("z", (half if normal == 1 else -half)[:, None]).as_matrix()
        for name, way in zip(names, (-1.0, 1.0), strict=True):
            bar = _flat_bar(name, history, sides, normal, way)
            middle = rotate_to_bias(np.eye(3)[None, normal] * 0.5 * way * sides[normal])
            found.append(replace(bar, turn=turn, offset=middle * stretch - (turn @ middle[0])))
    return found + _arms(history, sides, stretch)


def _arms(history: History, sides: tuple[float, float], stretch: Array) -> list[Body]:
    """Flat sheets from the fabric to the bars, as one body that follows the ``stretch`` (n_frames, 3) along x, y, z."""
    flat = history.frames[0].position @ rotate_to_bias(np.eye(3)).T
    fabric, frame = np.abs(flat[:, :2]).max(axis=0), 0.5 * np.array(sides)
    corners = []
    for normal in np.flatnonzero(frame > (1.0 + WIDER) * fabric):
        for way in (-1.0, 1.0):
            sheet = np.zeros((4, 3))
            sheet[:, normal] = way * np.array([fabric[normal], fabric[normal], frame[normal], frame[normal]])
            sheet[:, 1 - normal] = fabric[1 - normal] * np.array([-1.0, 1.0, ARMS, -ARMS])
            corners.append(rotate_to_bias(sheet))
    if not corners:
        return []
    triangles = np.concatenate([4 * k + np.array([[0, 1, 2], [0, 2, 3]]) for k in range(len(corners))])
    turn = stretch[:, :, None] * np.eye(3)
    return [Body("arms", np.concatenate(corners), triangles, np.zeros_like(stretch), turn)]


def _flat_bar(name: str, history: History, sides: tuple[float, float], normal: int, way: float) -> Body:
    """A bar of the square frame, before any motion: at the end ``way`` (-1, 1) of weft or warp (``normal`` 0, 1)."""
    first, wide, radius = history.frames[0].position[:, 2], WIDE * max(sides), float(history.mesh.radius.max())
    centre = np.array([0.0, 0.0, 0.5 * (first.min() + first.max())])
    centre[normal] = 0.5 * way * (sides[normal] + wide)
    lengths = np.array([sides[0], sides[1], np.ptp(first) + 2.0 * (radius + OUT * wide)])
    lengths[normal] = wide
    body = plate_block(name, centre, lengths, np.zeros((len(history.frames), 3)))
    return replace(body, points=rotate_to_bias(body.points))
