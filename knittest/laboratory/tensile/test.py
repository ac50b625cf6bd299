"""Strip tensile test after DIN EN ISO 13934-1: one clamp fixed, one pulled at constant speed after a smooth start."""

from collections.abc import Mapping

import numpy as np

from knittest.base.history import Array, Frame, History, Quality
from knittest.base.units import round_down
from knittest.config.quality_checks import NEAR
from knittest.experiment.time_history import NodeHistory
from knittest.laboratory.base import PreparedSpecimen, biaxial_table, fabric_laminate
from knittest.laboratory.fabric_test import FabricTest, TestRig
from knittest.laboratory.quality_checks import TARGET_SHARE, Span
from knittest.laboratory.reactions import reactions_of
from knittest.laboratory.strips import (
    AXIS,
    clamp_forces,
    cut_piece,
    inlays_across,
    modelled_width,
    pitch,
    wale_course_counts,
    yarns_across,
)
from knittest.laboratory.tensile.config import TensileRun
from knittest.laboratory.tensile.kind import KNIT_FORCES
from knittest.models.boundary import ALL, Boundary, Readings
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import build_meso
from knittest.models.tool import ramp
from knittest.solve.state import Observer, SimulationCost

#: a node this close to a clamp edge is gripped [mm]
EDGE = 1e-6


class TensileTest(TestRig):
    """Pull the strip along ``axis`` (0: x, 1: y) over a ``gauge`` length [mm] about the yarns' ``middle`` [mm]."""

    coordinate, force = "strain_pct", "force_n"

    def __init__(self, run: TensileRun, axis: int, gauge: float, middle: float, width: float) -> None:
        self.axis, self.gauge, self.middle = axis, gauge, middle
        self.ring_length = self.gauge
        self.speed = run.solver.speed_mm_per_ms
        self.pull = ramp(run.solver.ramp_ms, self.speed)
        self.max_strain = run.rig.max_strain_fraction
        self.stop_ratio = run.rig.stop_force_ratio
        self.duration = 0.5 * run.solver.ramp_ms + self.max_strain * self.gauge / self.speed
        self.most = np.inf
        if run.rig.max_force is not None:
            self.most = run.rig.max_force * width

    @property
    def faces(self) -> tuple[float, float]:
        """Place [mm] along the axis from which the fixed clamp holds the strip, and the moving one at the start."""
        return self.middle - 0.5 * self.gauge, self.middle + 0.5 * self.gauge

    def constrain(self, boundary: Boundary) -> None:
        """Grip all nodes outside the gauge length."""
        along = boundary.model.position()[:, self.axis] - self.middle
        fixed = np.flatnonzero(along <= -0.5 * self.gauge + EDGE)
        moving = np.flatnonzero(along >= 0.5 * self.gauge - EDGE)
        boundary.grip(fixed, ALL[self.axis])
        boundary.grip(moving, ALL[self.axis], self.pull)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Displacement, engineering strain of the gauge length, and forces."""
        travel = self.pull.integral(time)
        return {"displacement_mm": travel, "strain_pct": 100.0 * travel / self.gauge, **clamp_forces(readings)}

    def is_finished(self, force: float, peak: float, broken: bool) -> bool:
        """End at the largest force, or after a failure when the force has fallen to a share of its peak."""
        return force >= self.most or (broken and force < self.stop_ratio * peak)


#: standard deviations above the mean fracture strain at which the last yarn breaks
LAST_YARNS = 2.0


def expected_share(run: TensileRun, prepared: PreparedSpecimen) -> float:
    """Share of the rig's motion after which the strip fails."""
    duration, start = prepared.rig.duration, 0.5 * run.solver.ramp_ms
    end = start + (duration - start) * failure_strain(run) / run.rig.max_strain
    return min(end / duration, 1.0)


def failure_strain(run: TensileRun) -> float:
    """Strain [%] at which a tensile strip fails: that of its shells, or of its last yarn."""
    direction = run.rig.direction
    if run.model.scale == "macro":
        return min(run.fabric.macro.deletion_strain(direction), run.rig.max_strain)
    last = [run.rig.max_strain]
    for one in run.fabric.inlays_along(direction):
        fracture, length = one.yarn.fracture_strain, one.yarn.crimp.of(direction).value
        slack = one.yarn.slack.of(direction).value
        last.append(float(fracture.value + LAST_YARNS * (fracture.sd or 0.0) + length + slack))
    return max(last[1:] or last)


#: samples by which the last one before a break may be early (a break lowers the next one), and for the rate of force
SAMPLES, RATE = 1.5, 4


def unresolved_peak(curve: Mapping[str, Array], passage: float) -> float:
    """Uncertainty of the peak force in time [-]: dF/dt max(1.5 dt, L / 2c) / F with the rate dF/dt at the peak.

    The clamps feel a break half a ``passage`` L / c [ms] later, and a break lowers the last sample, which is a mean.
    """
    force, time = curve["force_n"], curve["time_ms"]
    peak = int(np.argmax(force))
    first = max(peak - RATE, 0)
    if peak == first or not force[peak] > 0.0:
        return float("nan")
    rate = float(force[peak] - force[first]) / float(time[peak] - time[first])
    sample = float(np.diff(time[first : peak + 1]).max())
    return rate * max(SAMPLES * sample, 0.5 * passage) / float(force[peak])


#: part of the gauge length, about its middle, in which the width is measured, and width of its edges over the width
MIDDLE, EDGES = 0.2, 0.15


def knit_results(history: History, facts: Mapping[str, float], axis: int) -> dict[str, float]:
    """Strain [%] at the forces per width that are reached, largest force per width and strain, contraction [%] there.

    Strips of loops stretch by tens of per cent; they may end without a failure.
    """
    strain, force = history.curve["strain_pct"], history.curve["force_n"] / facts["width_mm"]
    rising = np.maximum.accumulate(force)
    found = {
        f"strain_pct_at_n_per_mm.{at:g}": float(strain[np.argmax(rising >= at)])
        for at in KNIT_FORCES
        if rising[-1] >= at
    }
    last = int(np.argmax(force))
    found |= {"largest_force_n_per_mm": float(force[last]), "strain_at_largest_force_pct": float(strain[last])}
    widths = [middle_width(history, frame, axis) for frame in history.frames]
    at = [float(np.interp(frame.time, history.curve["time_ms"], strain)) for frame in history.frames]
    contraction = 100.0 * (1.0 - np.array(widths) / widths[0])
    return found | {"contraction_pct": float(np.interp(strain[last], at, contraction))}


def middle_width(history: History, frame: Frame, axis: int) -> float:
    """Distance [mm] of both edges of the strip in the middle of its length, of nodes that lie there at the start."""
    start = history.frames[0].position
    along, across = start[:, axis], start[:, 1 - axis]
    low, high = along.min(), along.max()
    middle = np.abs(along - 0.5 * (low + high)) <= 0.5 * MIDDLE * (high - low)
    left, right = across.min() + EDGES * np.ptp(across), across.max() - EDGES * np.ptp(across)
    edges = [frame.position[middle & side, 1 - axis].mean() for side in (across <= left, across >= right)]
    return float(edges[1] - edges[0])


#: share of the largest strain of a law of two strains to which a strip is pulled: it is strained more at its clamps
NEAR_END = 0.95
#: largest uncertainty in time [%] of the peak force of a macro model; a warning above half of it
PEAK_TIME_LIMIT = 4.0
#: pitches inside each clamp of a meso model: enough to grip every yarn
JAW_PITCHES = 1


class Tensile(FabricTest[TensileRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = True

    def mount_shells(self, run: TensileRun, specimen: int) -> PreparedSpecimen:
        """Make the strip of shells; loops are pulled as far as their law of two strains knows."""
        macro, table = run.model.macro, biaxial_table(run.fabric)
        if run.pulls_loops and table is not None:
            end = 100.0 * NEAR_END * float((table.warp if run.rig.direction == "warp" else table.weft)[-1])
            rig = run.rig.model_copy(update={"max_strain": min(run.rig.max_strain, end)})
            run = run.model_copy(update={"rig": rig})
        rig = run.rig
        gauge = rig.gauge_length_mm
        shape = StripShape(
            gauge, rig.width_mm, rig.jaw_length_mm, macro.element_size_mm, macro.imperfection_mm,
            run.variability.seed + specimen,
        )  # fmt: skip
        contact = self_contact(run.fabric, macro, run.solver.safety)
        model = build_strip(run.fabric, fabric_laminate(run), rig.direction, shape, contact)
        mount = TensileTest(run, pull_axis(run), gauge, 0.0, rig.width_mm)
        return PreparedSpecimen(model, mount, facts=_facts(run, specimen, mount, gauge + 2.0 * rig.jaw_length_mm))

    def mount_yarns(self, run: TensileRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the strip of whole yarns and pitches."""
        direction, period = run.rig.direction, pitch(run, run.rig.direction)
        along = gauge_pitches(run)
        whole = along + 2 * JAW_PITCHES
        counts = wale_course_counts(direction, whole, yarns_across(run, direction, specimen))
        piece = cut_piece(run, *counts, specimen, observer, (direction, (JAW_PITCHES + 0.5) / whole))
        width = modelled_width(run, direction, specimen)
        mount = TensileTest(run, pull_axis(run), along * period, 0.5 * whole * period, width)
        facts = _facts(run, specimen, mount, whole * period)
        return PreparedSpecimen(build_meso(run, piece.paths, piece.draws), mount, yarns=piece.table, facts=facts)

    def results(self, run: TensileRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Peak force, also per width, fracture strain, force per yarn; of shells the peak's uncertainty in time."""
        peak, facts = int(np.argmax(history.curve["force_n"])), prepared.facts
        force = float(history.curve["force_n"][peak])
        if run.pulls_loops:
            found = knit_results(history, facts, pull_axis(run))
            return found if history.first_failure is None else found | {
                "peak_force_n": force, "fracture_strain_pct": float(history.curve["strain_pct"][peak]),
            }  # fmt: skip
        found = {
            "peak_force_n": force,
            "fracture_strain_pct": float(history.curve["strain_pct"][peak]),
            "force_per_yarn_n": force / int(facts["yarns_across"]),
            "peak_force_n_per_mm": force / facts["width_mm"],
        }
        if run.model.scale == "macro":
            passage = prepared.rig.ring_time(prepared.model.wave_speed)
            found["peak_time_error_pct"] = 100.0 * unresolved_peak(history.curve, passage)
        return found

    def assess(self, run: TensileRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the checks of every run and the uncertainty of the peak in time; the strip must fail."""
        quality = super().assess(run, prepared, history, cost)
        error = self.results(run, prepared, history).get("peak_time_error_pct", 0.0)
        if error <= NEAR * PEAK_TIME_LIMIT or history.first_failure is None:
            return quality
        speed = round_down(run.solver.speed * TARGET_SHARE * NEAR * PEAK_TIME_LIMIT / error)
        text = (
            f"the peak force is uncertain by {error:.1f} % (limit {PEAK_TIME_LIMIT:g} %), as it still grows within "
            f"{SAMPLES:g} samples or while a break travels to the clamps: try --set solver.speed={speed:g}"
        )
        return quality.with_failed_check(text) if error > PEAK_TIME_LIMIT else quality.with_warnings(text)

    def span(self, history: History) -> Span:
        """Return the span up to the first failure."""
        return Span(to_failure=True)


def gauge_pitches(run: TensileRun) -> int:
    """Whole pitches between the clamps of a meso strip."""
    return max(round(run.rig.gauge_length_mm / pitch(run, run.rig.direction)), 1)


def strip_curve(run: TensileRun, history: NodeHistory) -> dict[str, Array]:
    """Curve of the strip of ``run`` from the moving clamp in ``history``, a run of its deck in another solver."""
    axis, found = pull_axis(run), reactions_of(history)
    meso = run.model.scale == "meso"
    gauge = gauge_pitches(run) * pitch(run, run.rig.direction) if meso else run.rig.gauge_length_mm
    travel = found.moved[:, :, axis].mean(axis=1)
    return {
        "time_ms": found.time,
        "displacement_mm": travel,
        "strain_pct": 100.0 * travel / gauge,
        "force_n": found.force[:, axis],
    }


def pull_axis(run: TensileRun) -> int:
    """Axis (0: x, 1: y) along which the strip is pulled: always y of shells."""
    return AXIS[run.rig.direction] if run.model.scale == "meso" else 1


def _facts(run: TensileRun, specimen: int, mount: TensileTest, length: float) -> dict[str, float]:
    width, (fixed, moving) = modelled_width(run, run.rig.direction, specimen), mount.faces
    yarns = yarns_across(run, run.rig.direction, specimen)
    if run.model.scale == "meso":
        yarns = inlays_across(run, run.rig.direction, specimen) or yarns
    return {
        "yarns_across": float(yarns), "width_mm": width,
        "gauge_mm": mount.gauge, "area_mm2": length * width, "fixed_jaw_mm": fixed, "moving_jaw_mm": moving,
    }  # fmt: skip
