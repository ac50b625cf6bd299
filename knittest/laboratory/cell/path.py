"""Paths of a cell: its lattice as a function of how far the path has come, and where a path of shear ends."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from knittest.base.history import Array
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.records import EndSetting
from knittest.models.periodic_model import NUMBERS
from knittest.models.tool import Table, ramp

#: knots of a motion, and length of fabric [mm] whose end moves at ``solver.speed``
KNOTS, FABRIC = 400, 100.0
#: time [ms] before a motion that is held to relax the cell on its way, longer than any step
PAUSE = 0.1
#: knots of the motion that it lasts at least, between which the motion is linear
PAUSED_KNOTS = 2.0
#: strain from which on loops slide far along each other and fabric contracts
LARGE = 0.05


@dataclass(frozen=True)
class CellPath:
    """Path from ``s`` = 0 to 1: numbers ``at`` (KNOTS + 1, 7) of the lattice, ``free`` ones of them, ``duration`` [ms].

    ``end`` of the coordinate ``name`` whose conjugate force is read; ``shown`` is its factor to a unit.
    """

    name: str
    end: float
    shown: float
    at: Array
    free: tuple[str, ...] = ()
    duration: float = 0.0

    @property
    def shrink(self) -> float:
        """Smallest length over its start [-] of lines in the plane on the path.

        Free lines keep their length, or the area where the stretch is large.
        """
        flat = self.at[:, [0, 1, 3, 4]].reshape(-1, 2, 2)
        gradient = np.linalg.solve(flat[0], flat)
        least = float(min(np.linalg.svd(gradient, compute_uv=False).min(), 1.0))
        return min(least, 1.0 / (1.0 + self.stretch)) if self.free and self.stretch > LARGE else least

    @property
    def stretch(self) -> float:
        """Largest strain [-] of lines in the plane on the path."""
        flat = self.at[:, [0, 1, 3, 4]].reshape(-1, 2, 2)
        return float(np.linalg.svd(np.linalg.solve(flat[0], flat), compute_uv=False).max() - 1.0)

    @cached_property
    def slope(self) -> Array:
        """Derivatives of the numbers by s, (KNOTS + 1, 7)."""
        return np.asarray(np.gradient(self.at, 1.0 / KNOTS, axis=0))

    def rates(self, progress: Table) -> dict[str, Table]:
        """Speeds of the numbers that move, where s moves by ``progress`` [1/ms]."""
        time = np.linspace(0.0, self.duration, KNOTS + 1)
        s = np.array([progress.integral(float(t)) for t in time]).clip(max=1.0)
        speed = np.interp(time, progress.time, progress.value)
        even, found = np.linspace(0.0, 1.0, KNOTS + 1), {}
        for q, name in enumerate(NUMBERS):
            if np.ptp(self.at[:, q]) > 0.0 and name not in self.free:
                found[name] = Table(tuple(time), tuple(np.interp(s, even, self.slope[:, q]) * speed))
        return found

    def conjugate(self, pull: Array, s: float) -> float:
        """Derivative of the energy by the coordinate at ``s``, of ``pull`` (7,)."""
        k = min(int(s * KNOTS), KNOTS - 1)
        share = s * KNOTS - k
        return float(pull @ ((1.0 - share) * self.slope[k] + share * self.slope[k + 1])) / self.end


def path_of(run: CellRun, reference: Array) -> CellPath:
    """Path of ``run`` for a cell of the lattice ``reference`` (2, 3) [mm]."""
    rig, s = run.rig, np.linspace(0.0, 1.0, KNOTS + 1)
    flat = np.tile(np.append(reference.ravel(), 0.0), (KNOTS + 1, 1))
    a, b = flat[0, 0], flat[0, 4]
    if rig.path == "compaction":
        return CellPath("approach_mm", 1.0, 1.0, flat)
    if rig.path == "bending":  # the cell goes to the radius at which it carries no mean force along it
        flat[:, 6] = rig.max_curvature * s
        return CellPath("curvature_per_mm", rig.max_curvature, 1.0, flat)
    if rig.path == "shear":  # pin-jointed yarns: both vectors keep their lengths and turn by half the angle
        angle = float(np.deg2rad(rig.max_angle))
        cosine, sine = np.cos(0.5 * angle * s), np.sin(0.5 * angle * s)
        flat[:, 0], flat[:, 1], flat[:, 3], flat[:, 4] = a * cosine, a * sine, b * sine, b * cosine
        return CellPath("shear_angle_deg", angle, 180.0 / np.pi, flat)
    if rig.path == "steps":  # straight between the rows
        rows = np.array(rig.steps)
        xx, xy, yx, yy = (np.interp(s, rows[:, 0], rows[:, k]) for k in range(1, 5))
        flat[:, 0], flat[:, 1], flat[:, 3], flat[:, 4] = a * xx, a * yx, b * xy, b * yy
        return CellPath("path_pct", 1.0, 100.0, flat)
    share = {"warp": (0.0, 1.0), "weft": (1.0, 0.0), "biaxial": (rig.ratio, 1.0)}[rig.path]
    for q, part in zip((0, 4), share, strict=True):
        flat[:, q] *= 1.0 + rig.max_strain_fraction * part / max(share) * s
    other = {"warp": ("ax",), "weft": ("by",)}.get(rig.path, ()) if rig.transverse == "free" else ()
    return CellPath("strain_pct", rig.max_strain_fraction, 100.0, flat, other)


def time_path(run: CellRun, path: CellPath) -> tuple[CellPath, Table]:
    """``path`` with its duration, and the speed [1/ms] of s: that of 100 mm of fabric at ``solver.speed``."""
    rate = run.solver.speed_mm_per_ms / FABRIC
    longest = max(float(np.abs(np.diff(path.at[:, q])).sum()) / float(np.abs(path.at[0, :6]).max()) for q in range(6))
    way = path.end if path.name != "path_pct" else longest
    progress = ramp(run.solver.ramp_ms, rate / way)
    duration = 0.5 * run.solver.ramp_ms + way / rate
    pause = max(PAUSE, PAUSED_KNOTS * duration / KNOTS) if run.is_relaxed else 0.0
    if pause:
        progress = Table((0.0, *(pause + t for t in progress.time)), (0.0, *progress.value))
    return replace(path, duration=pause + duration), progress


#: shear angles at which results are read [deg], and half the range over which they are averaged
ANGLES, NEAR = (1.0, 10.0, 20.0, 30.0, 40.0), 0.5


def path_end(run: CellRun) -> EndSetting | None:
    """End of the path of ``run``; None where results are read at its end only."""
    return EndSetting("rig.end_angle", run.rig.last_angle, NEAR) if run.rig.path == "shear" else None
