"""Bias extension test: a strip at 45 deg to its yarns between two clamps, one fixed, one pulled."""

import time as clock
from dataclasses import replace
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import History, Quality
from knittest.laboratory.after_rest import row_check
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.strip import BiasStrip, bias_mesh, jaw_length, strip_of, yarns_on_the_bias
from knittest.laboratory.bias_extension.zones import material_of, zone_table
from knittest.laboratory.judging import Span, assess
from knittest.laboratory.law_end import refuse_beyond_law
from knittest.materials.trellis import ANGLE, NORMALISED
from knittest.models.boundary import Boundary, Readings
from knittest.models.macro import build_sheet, self_contact
from knittest.models.meso import build_meso
from knittest.models.tool import Table, ramp
from knittest.solve.simulate import simulate
from knittest.solve.state import SILENT, Observer, SimulationCost

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Bias extension: one clamp fixed, one pulled after a smooth start.
#
# Yarns are pulled at constant speed up to the first angle at which a force is read, and from there in proportion to the
# travel. The work grows faster than the square of the travel, so that the kinetic energy stays as small a share of it.

#: shear angles at which results are read [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: largest speed of yarns over that of the start, and knots of its growth
FASTEST, KNOTS = 4.0, 200


class BiasExtensionTest:
    """Pulls the nodes ``moving`` along y from those ``fixed`` until the middle of ``strip`` is sheared enough."""

    coordinate, force = "shear_angle_deg", "force_n"
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(
        self, run: BiasExtensionRun, strip: BiasStrip, fixed: NDArray[np.int64], moving: NDArray[np.int64]
    ) -> None:
        self.strip, self.fixed, self.moving = strip, fixed, moving
        speed, start = run.solver.speed_mm_per_ms, run.solver.ramp_ms
        self.speed, self.start = speed, start
        self.fastest = FASTEST if run.model.scale == "meso" else 1.0
        self.pull = self._pull()
        self.duration = self._time(self._travel(run.rig.max_angle))
        self.marks = tuple(
            self._time(self._travel(angle)) / self.duration for angle in ANGLES if angle <= run.rig.max_angle
        )

    def _travel(self, angle: float) -> float:
        """Travel [mm] that shears the middle of pin-jointed yarns by ``angle`` [deg]."""
        return self.strip.travel(float(np.deg2rad(angle)))

    def _pull(self) -> Table:
        """Speed [mm/ms] of the clamp: v up to the travel x1 of the first angle, then v x / x1 = v exp(v t / x1) up to
        the fastest.
        """
        begin = ramp(self.start, self.speed)
        if self.fastest == 1.0:
            return begin
        first, speed = self._travel(ANGLES[0]), self.speed
        since = max(0.5 * self.start + first / speed, self.start)
        later = np.linspace(0.0, first / speed * log(self.fastest), KNOTS)
        return Table((*begin.time, *(since + later)), (*begin.value, *(speed * np.exp(later * speed / first))))

    def _time(self, travel: float) -> float:
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

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs from clamp to clamp along the yarns."""
        return float(np.sqrt(2.0)) * self.strip.length / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Displacement, shear angle of pin-jointed yarns and force: the mean of both clamps, and each."""
        travel = self.pull.integral(time)
        return {
            "displacement_mm": travel,
            "shear_angle_deg": float(np.rad2deg(self.strip.angle(travel))),
            "force_n": 0.5 * float(readings.reaction[1] - readings.reaction[0]),
            "force_moving_n": float(readings.reaction[1]),
            "force_fixed_n": -float(readings.reaction[0]),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Only the largest angle ends the test."""
        return False


#: half the range of angles [deg] over which a force is averaged
NEAR = 0.5
#: warp in a strip along y
WARP = (-sqrt(0.5), sqrt(0.5), 0.0)


class BiasExtension(Test[BiasExtensionRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False
    lowers_speed = True

    def prepare(self, run: BiasExtensionRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The strip between its clamps, along y."""
        meso = run.model.scale == "meso"
        return self._yarns(run, specimen, observer) if meso else self._shells(run, specimen)

    def _shells(self, run: BiasExtensionRun, specimen: int) -> Prepared:
        refuse_beyond_law(run, run.rig.max_angle)
        strip, macro, fabric = strip_of(run), run.model.macro, run.fabric
        points, cells = bias_mesh(strip.length, strip.width, macro.element_size_mm)
        ends, height = ends_of(points, strip), macro.imperfection_mm
        free = np.setdiff1d(np.arange(len(points)), np.concatenate(ends))
        points[free, 2] = np.random.default_rng(run.variability.seed + specimen).uniform(-height, height, len(free))
        model = build_sheet(
            points, cells, fabric_laminate(run), fabric.area_mass_g_per_mm2, fabric.thickness_mm, WARP,
            contact=self_contact(fabric, macro, run.solver.safety),
        )  # fmt: skip
        return Prepared(model, BiasExtensionTest(run, strip, *ends), facts=_facts(strip, strip.length))

    def _yarns(self, run: BiasExtensionRun, specimen: int, observer: Observer) -> Prepared:
        start, strip = clock.perf_counter(), strip_of(run)
        found = yarns_on_the_bias(run, strip, specimen, observer)
        model = build_meso(run, found.paths, found.piece.draws, run.rig.membrane_share)
        ends = ends_of(model.position(), strip)
        whole = strip.length + 2.0 * jaw_length(run.fabric)
        mount = BiasExtensionTest(run, strip, *ends)
        return Prepared(model, mount, clock.perf_counter() - start, found.piece.table, _facts(strip, whole))

    def solve(self, prepared: Prepared, run: BiasExtensionRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Pull to the largest angle; raises :class:`TooFastError` by ``prepared.restarts``."""
        check = row_check(run, prepared.restarts, ANGLE, ANGLES[0] - NEAR)
        history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, observer, check)
        return self.finish(run, prepared, history), cost

    def finish(self, run: BiasExtensionRun, prepared: Prepared, history: History) -> History:
        """Add the normalised force, which hangs on that at all smaller angles."""
        found = strip_of(run).normalised(history.curve["force_n"], np.deg2rad(history.curve[ANGLE]))
        return replace(history, curve=history.curve | {NORMALISED: found})

    def results(self, run: BiasExtensionRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Force, normalised force and the middle's own angle at angles of pin-jointed yarns."""
        most, table = run.rig.max_angle, zone_table(history, strip_of(run), material_of(run, history))
        return forces_at(history, most) | middle_at(table, most)

    def assess(self, run: BiasExtensionRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run."""
        return assess(run, prepared, history, cost, self.span(history))

    def span(self, history: History) -> Span:
        """The whole way, from the first angle at which a force is read."""
        first = history.curve[ANGLE] >= ANGLES[0] - NEAR
        times = history.curve["time_ms"]
        return Span(reported_from=float(times[np.argmax(first)]) if first.any() else np.inf)


def _facts(strip: BiasStrip, whole: float) -> dict[str, float]:
    """Sizes of ``strip``, which is ``whole`` [mm] long with what the jaws hold."""
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
    """Force [N] and normalised force [N/mm] at each of :data:`~.rig.ANGLES` up to ``most`` [deg], means over a degree
    about it.
    """
    curve = history.curve
    around = {a: np.abs(curve[ANGLE] - a) < NEAR for a in ANGLES if a <= most}
    columns = {"bias_force_n": "force_n", "bias_normalised_force_n_per_mm": NORMALISED}
    return {
        f"{name}_at_deg.{a:g}": float(curve[column][near].mean())
        for name, column in columns.items()
        for a, near in around.items()
    }


def middle_at(table: dict[str, Array], most: float) -> dict[str, float]:
    """Mean shear angle [deg] in the inner half of the middle where pin-jointed yarns would have one of
    :data:`~.rig.ANGLES` up to ``most`` [deg], and of yarns their slip [mm] in the strip, on lines between the rows of
    zones.csv.
    """
    columns = {"middle_shear_angle_deg": "middle_mean_deg", "crossing_slip_mm": "slip_percentile_95_mm"}
    return {
        f"{name}_at_deg.{a:g}": float(np.interp(a, table[ANGLE], table[column]))
        for name, column in columns.items()
        if column in table
        for a in ANGLES
        if a <= most
    }
