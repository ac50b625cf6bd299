"""Bias extension test: a strip at 45 deg to its yarns between two clamps, one fixed, one pulled."""

from collections.abc import Callable
from dataclasses import replace
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array, History
from knittest.laboratory.base import PreparedSpecimen, sheet_model
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.strip import (
    BiasStrip,
    bias_mesh,
    cut_bias_yarns,
    jaw_length,
    piece_counts,
    strip_of,
)
from knittest.laboratory.bias_extension.zones import material_points, zone_table
from knittest.laboratory.fabric_test import FabricTest, TestRig
from knittest.laboratory.quality_checks import Span
from knittest.laboratory.restart import make_row_check
from knittest.laboratory.shear_law_end import check_law_range
from knittest.laboratory.strips import check_shows_shear, clamp_forces, random_offsets
from knittest.materials.trellis import ANGLE, NORMALISED
from knittest.models.boundary import Boundary, Readings
from knittest.models.meso import build_meso
from knittest.models.tool import Table, ramp
from knittest.solve.state import Observer, Simulation

Index = NDArray[np.int64]

# One clamp is fixed, one is pulled after a smooth start. A meso strip is pulled at constant speed up to the first angle
# of a result, and from there in proportion to the travel: the work grows faster than the square of the travel, so the
# kinetic energy remains as small a share of it.

#: shear angles at which results are read [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: largest speed of a meso strip over that of the start, and knots of its growth
FASTEST, KNOTS = 4.0, 200


class BiasExtensionTest(TestRig):
    """Pull the nodes ``moving`` along y from those ``fixed`` up to the largest angle in the middle of ``strip``."""

    coordinate, force = "shear_angle_deg", "force_n"

    def __init__(self, run: BiasExtensionRun, strip: BiasStrip, fixed: Index, moving: Index) -> None:
        self.strip, self.fixed, self.moving = strip, fixed, moving
        self.ring_length = float(np.sqrt(2.0)) * self.strip.length
        self.speed, self.start = run.solver.speed_mm_per_ms, run.solver.ramp_ms
        self.fastest = FASTEST if run.model.scale == "meso" else 1.0
        self.pull = self._clamp_speed()
        self.duration = self._time_at(self._travel(run.rig.max_angle))
        self.marks = tuple(
            self._time_at(self._travel(angle)) / self.duration for angle in ANGLES if angle <= run.rig.max_angle
        )

    def _travel(self, angle: float) -> float:
        """Travel [mm] that shears the middle of pin-jointed yarns by ``angle`` [deg]."""
        return self.strip.travel(float(np.deg2rad(angle)))

    def _clamp_speed(self) -> Table:
        """Speed [mm/ms] of the clamp: v up to the travel x1 of the first angle, then v x / x1 = v exp(v t / x1)."""
        begin = ramp(self.start, self.speed)
        if self.fastest == 1.0:
            return begin
        first, speed = self._travel(ANGLES[0]), self.speed
        since = max(0.5 * self.start + first / speed, self.start)
        later = np.linspace(0.0, first / speed * log(self.fastest), KNOTS)
        return Table((*begin.time, *(since + later)), (*begin.value, *(speed * np.exp(later * speed / first))))

    def _time_at(self, travel: float) -> float:
        """Time [ms] at which the clamp has gone ``travel`` [mm]."""
        time, speed = np.array(self.pull.time), np.array(self.pull.value)
        gone = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
        if travel >= gone[-1]:
            return float(time[-1] + (travel - gone[-1]) / speed[-1])
        return float(np.interp(travel, gone, time))

    def constrain(self, boundary: Boundary) -> None:
        """Grip both ends."""
        boundary.grip(self.fixed, "y")
        boundary.grip(self.moving, "y", self.pull)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Displacement, shear angle of pin-jointed yarns, and forces."""
        travel = self.pull.integral(time)
        return {
            "displacement_mm": travel,
            "shear_angle_deg": float(np.rad2deg(self.strip.angle(travel))),
            **clamp_forces(readings),
        }


#: half the range of angles [deg] over which a force is averaged
NEAR = 0.5
#: warp in a strip along y
WARP = (-sqrt(0.5), sqrt(0.5), 0.0)


class BiasExtension(FabricTest[BiasExtensionRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    lowers_speed = True

    def check_run(self, run: BiasExtensionRun) -> None:
        """Raise :class:`InputError` for a strip that shows no shear angle."""
        check_shows_shear(run, *piece_counts(run), "rig.width")

    def mount_shells(self, run: BiasExtensionRun, specimen: int) -> PreparedSpecimen:
        """Make the strip of shells along y."""
        check_law_range(run, run.rig.max_angle)
        strip, macro = strip_of(run), run.model.macro
        points, cells = bias_mesh(strip.length, strip.width, macro.element_size_mm)
        ends = ends_of(points, strip)
        free = np.setdiff1d(np.arange(len(points)), np.concatenate(ends))
        points[free, 2] = random_offsets(macro.imperfection_mm, run.variability.seed + specimen, len(free))
        model = sheet_model(run, points, cells, WARP)
        return PreparedSpecimen(model, BiasExtensionTest(run, strip, *ends), facts=_facts(strip, strip.length))

    def mount_yarns(self, run: BiasExtensionRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the strip of yarns along y."""
        strip = strip_of(run)
        found = cut_bias_yarns(run, strip, specimen, observer)
        model = build_meso(run, found.paths, found.piece.draws, run.rig.membrane_share)
        mount = BiasExtensionTest(run, strip, *ends_of(model.position(), strip))
        facts = _facts(strip, strip.length + 2.0 * jaw_length(run.fabric))
        return PreparedSpecimen(model, mount, yarns=found.piece.table, facts=facts)

    def make_row_check(self, run: BiasExtensionRun, prepared: PreparedSpecimen) -> Callable[[Simulation], None]:
        """Check the energy ratios from the first angle of a result on."""
        return make_row_check(run, prepared.restarts, ANGLE, ANGLES[0] - NEAR)

    def finish(self, run: BiasExtensionRun, prepared: PreparedSpecimen, history: History) -> History:
        """Add the normalised force, which depends on the forces at all smaller angles."""
        found = strip_of(run).normalised_force(history.curve["force_n"], np.deg2rad(history.curve[ANGLE]))
        return replace(history, curve=history.curve | {NORMALISED: found})

    def results(self, run: BiasExtensionRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Force, normalised force and shear angle of the middle at angles of pin-jointed yarns."""
        most, table = run.rig.max_angle, zone_table(history, strip_of(run), material_points(run, history))
        return forces_at(history, most) | middle_results(table, most)

    def span(self, history: History) -> Span:
        """Return the span from the first angle of a result on."""
        return Span.from_value(history, ANGLE, ANGLES[0] - NEAR)


def _facts(strip: BiasStrip, whole: float) -> dict[str, float]:
    half = 0.5 * strip.length
    return {
        "width_mm": strip.width, "gauge_mm": strip.length, "area_mm2": whole * strip.width, "fixed_jaw_mm": -half,
        "moving_jaw_mm": half,
    }  # fmt: skip


def ends_of(points: Array, strip: BiasStrip) -> tuple[Index, Index]:
    """Nodes among ``points`` (n, 3) [mm] that the fixed clamp holds, and the pulled one."""
    end = 0.5 * strip.length * (1.0 - 1e-9)
    return np.flatnonzero(points[:, 1] <= -end), np.flatnonzero(points[:, 1] >= end)


def forces_at(history: History, most: float) -> dict[str, float]:
    """Force [N] and normalised force [N/mm] at each of :data:`ANGLES` up to ``most`` [deg], means over a degree."""
    curve = history.curve
    around = {a: np.abs(curve[ANGLE] - a) < NEAR for a in ANGLES if a <= most}
    columns = {"bias_force_n": "force_n", "bias_normalised_force_n_per_mm": NORMALISED}
    return {
        f"{name}_at_deg.{a:g}": float(curve[column][near].mean())
        for name, column in columns.items()
        for a, near in around.items()
    }


def middle_results(table: dict[str, Array], most: float) -> dict[str, float]:
    """Mean angle [deg] of the middle's inner half, and slip [mm], at each of :data:`ANGLES` up to ``most`` [deg]."""
    columns = {"middle_shear_angle_deg": "middle_mean_deg", "crossing_slip_mm": "slip_percentile_95_mm"}
    return {
        f"{name}_at_deg.{a:g}": float(np.interp(a, table[ANGLE], table[column]))
        for name, column in columns.items()
        if column in table
        for a in ANGLES
        if a <= most
    }
