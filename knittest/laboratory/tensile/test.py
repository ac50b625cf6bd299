"""Strip tensile test after DIN EN ISO 13934-1: one clamp fixed, one pulled at constant speed after a smooth start."""

import time as clock
from collections.abc import Mapping

import numpy as np

from knittest.base.history import Array, History, Quality
from knittest.base.units import rounded_down
from knittest.config.gates import NEAR
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.judging import AIM, Span, assess
from knittest.laboratory.strips import AXIS, carrying_width, cut, pitch, yarns_across
from knittest.laboratory.tensile.config import TensileRun
from knittest.models.boundary import ALL, Boundary, Readings
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import build_meso
from knittest.models.tool import ramp
from knittest.solve.simulate import simulate
from knittest.solve.state import SILENT, Observer, SimulationCost

#: a node this close to a clamp edge is gripped [mm]
EDGE = 1e-6


class TensileTest:
    """Pulls the strip along ``axis`` (0: x, 1: y) over a ``gauge`` length [mm] about ``middle`` [mm].

    The middle is that of the yarns that are pulled: loops reach beyond their ends.
    """

    coordinate, force = "strain_pct", "force_n"
    marks: tuple[float, ...] = ()
    mounted_at, averaged_from, locks = 0.0, np.inf, False

    def __init__(self, run: TensileRun, axis: int, gauge: float, middle: float) -> None:
        self.axis, self.gauge, self.middle = axis, gauge, middle
        self.speed = run.solver.speed_mm_per_ms
        self.pull = ramp(run.solver.ramp_ms, self.speed)
        self.max_strain = run.rig.max_strain_fraction
        self.stop_ratio = run.rig.stop_force_ratio
        self.duration = 0.5 * run.solver.ramp_ms + self.max_strain * self.gauge / self.speed

    @property
    def faces(self) -> tuple[float, float]:
        """Place [mm] along the axis from which the fixed clamp holds the strip, and the moving one at the start."""
        return self.middle - 0.5 * self.gauge, self.middle + 0.5 * self.gauge

    def constrain(self, boundary: Boundary) -> None:
        """Grip all nodes outside the gauge length."""
        along = boundary.model.position()[:, self.axis] - self.middle
        fixed = np.flatnonzero(along <= -0.5 * self.gauge + EDGE)
        moving = np.flatnonzero(along >= 0.5 * self.gauge - EDGE)
        axis = ALL[self.axis]
        boundary.grip(fixed, axis)
        boundary.grip(moving, axis, self.pull)

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave needs along the gauge length."""
        return self.gauge / wave_speed

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Displacement, engineering strain of the gauge and force: the mean of both clamps, and each.

        Right after a yarn breaks the moving clamp still feels what the fixed one has lost, by the inertia between them.
        """
        travel = self.pull.integral(time)
        return {
            "displacement_mm": travel,
            "strain_pct": 100.0 * travel / self.gauge,
            "force_n": 0.5 * float(readings.reaction[1] - readings.reaction[0]),
            "force_moving_n": float(readings.reaction[1]),
            "force_fixed_n": -float(readings.reaction[0]),
        }

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over when something has failed and the force has fallen to a share of its peak."""
        return broken and force < self.stop_ratio * peak


#: yarns of mean strength plus this many standard deviations have broken when a strip of yarns has failed
LAST_YARNS = 2.0


def expected_share(run: TensileRun, prepared: Prepared) -> float:
    """Share of the rig's motion after which the strip fails."""
    duration, start = prepared.rig.duration, 0.5 * run.solver.ramp_ms
    end = start + (duration - start) * failure_strain(run) / run.rig.max_strain
    return min(end / duration, 1.0)


def failure_strain(run: TensileRun) -> float:
    """Strain [%] at which a tensile strip has failed: that of its shells, or of the last of its yarns."""
    direction = run.rig.direction
    if run.model.scale == "macro":
        return float(run.fabric.macro.fracture_strain.of(direction).value)
    yarn = run.fabric.reinforcing
    fracture, crimp, slack = (
        yarn.fracture_strain, getattr(yarn.crimp, direction).value, getattr(yarn.slack, direction).value,
    )  # fmt: skip
    return float(fracture.value + LAST_YARNS * (fracture.sd or 0.0) + crimp + slack)


#: samples, means of the force over time, by which the last one before a break may lie in front of it: the break lowers
#: the next one wherever it falls into it
SAMPLES = 1.5
#: samples from which the rate of the force is read
RATE = 4


def unresolved_peak(curve: Mapping[str, Array], passage: float) -> float:
    """Share of the peak force by which it is uncertain in time [-].

    Clamps feel a break half a ``passage`` L / c [ms] later, when its wave arrives; until then the force grows on. The
    force is a mean over samples, of which a break lowers the last. With the rate of the force at the peak dF/dt,
    which grows with the speed, the share is dF/dt max(1.5 dt, L / 2c) / F.
    """
    force, time = curve["force_n"], curve["time_ms"]
    peak = int(np.argmax(force))
    first = max(peak - RATE, 0)
    if peak == first or not force[peak] > 0.0:
        return float("nan")
    rate = float(force[peak] - force[first]) / float(time[peak] - time[first])
    sample = float(np.diff(time[first : peak + 1]).max())
    return rate * max(SAMPLES * sample, 0.5 * passage) / float(force[peak])


def tensile_results(curve: Mapping[str, Array], n_yarns: int) -> dict[str, float]:
    """Peak force [N], strain at maximum force [%] (ISO 13934-1, fracture strain in Table 3) and force per yarn [N].

    ``n_yarns`` yarns lie along the strip.
    """
    peak = int(np.argmax(curve["force_n"]))
    force = float(curve["force_n"][peak])
    return {
        "peak_force_n": force,
        "fracture_strain_pct": float(curve["strain_pct"][peak]),
        "force_per_yarn_n": force / n_yarns,
    }


#: share [%] of the peak force of shells by which it may be uncertain in time: a warning above half of it
UNRESOLVED = 4.0
#: pitches of the pattern inside each clamp of a meso model: enough to grip every yarn
JAW_PITCHES = 1


class Tensile(Test[TensileRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = True

    def prepare(self, run: TensileRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """Shells or yarns between the clamps."""
        meso = run.model.scale == "meso"
        return self._yarns(run, specimen, observer) if meso else self._shells(run, specimen)

    def _shells(self, run: TensileRun, specimen: int) -> Prepared:
        rig, macro = run.rig, run.model.macro
        gauge = rig.gauge_length_mm
        shape = StripShape(
            gauge, rig.width_mm, rig.jaw_length_mm, macro.element_size_mm, macro.imperfection_mm,
            run.variability.seed + specimen,
        )  # fmt: skip
        contact = self_contact(run.fabric, macro, run.solver.safety)
        model = build_strip(run.fabric, fabric_laminate(run), rig.direction, shape, contact)
        mount = TensileTest(run, pull_axis(run), gauge, middle=0.0)
        return Prepared(model, mount, facts=_facts(run, specimen, mount, gauge + 2.0 * rig.jaw_length_mm))

    def _yarns(self, run: TensileRun, specimen: int, observer: Observer) -> Prepared:
        start = clock.perf_counter()
        direction, period = run.rig.direction, pitch(run, run.rig.direction)
        along = max(round(run.rig.gauge_length_mm / period), 1)
        across, whole = yarns_across(run, direction, specimen), along + 2 * JAW_PITCHES
        n_wales, n_courses = (across, whole) if direction == "warp" else (whole, across)
        grip = (JAW_PITCHES + 0.5) / whole
        piece = cut(run, n_wales, n_courses, specimen, observer, (direction, grip))
        mount = TensileTest(run, pull_axis(run), along * period, 0.5 * whole * period)
        return Prepared(
            build_meso(run, piece.paths, piece.draws), mount, clock.perf_counter() - start, piece.table,
            _facts(run, specimen, mount, whole * period),
        )  # fmt: skip

    def solve(self, prepared: Prepared, run: TensileRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Pull to failure."""
        return simulate(prepared.model, prepared.rig, run.solver, run.output, observer)

    def results(self, run: TensileRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Peak force, also per width, fracture strain, force per yarn; of shells, which break at once, how far the
        peak is resolved in time.
        """
        found = tensile_results(history.curve, int(prepared.facts["yarns_across"]))
        found["peak_force_n_per_mm"] = found["peak_force_n"] / prepared.facts["width_mm"]
        if run.model.scale == "macro":
            passage = prepared.rig.ring_time(prepared.model.wave_speed)
            found["peak_time_error_pct"] = 100.0 * unresolved_peak(history.curve, passage)
        return found

    def assess(self, run: TensileRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run; a strip must fail, and the peak of shells be resolved in time."""
        quality = assess(run, prepared, history, cost, self.span(history))
        error = self.results(run, prepared, history).get("peak_time_error_pct", 0.0)
        if error <= NEAR * UNRESOLVED or history.first_failure is None:
            return quality
        speed = rounded_down(run.solver.speed * AIM * NEAR * UNRESOLVED / error)
        told = (
            f"the peak force is uncertain by {error:.1f} % (limit {UNRESOLVED:g} %), which the force gains within "
            f"{SAMPLES:g} samples or while a break travels to the clamps; it falls with the speed: try "
            f"--set solver.speed={speed:g}"
        )
        return quality.refusing(told) if error > UNRESOLVED else quality.warning(told)

    def span(self, history: History) -> Span:
        """Up to the first failure."""
        return Span(to_failure=True)


def pull_axis(run: TensileRun) -> int:
    """Axis (0: x, 1: y) along which the strip is pulled: of shells it always lies along y."""
    return AXIS[run.rig.direction] if run.model.scale == "meso" else 1


def _facts(run: TensileRun, specimen: int, mount: TensileTest, length: float) -> dict[str, float]:
    fixed, moving = mount.faces
    return {
        "yarns_across": float(yarns_across(run, run.rig.direction, specimen)),
        "width_mm": carrying_width(run, run.rig.direction, specimen),
        "gauge_mm": mount.gauge,
        "area_mm2": length * carrying_width(run, run.rig.direction, specimen),
        "fixed_jaw_mm": fixed,
        "moving_jaw_mm": moving,
    }
