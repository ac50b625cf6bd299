"""Tensile test: a strip between two clamps."""

import time as clock

from knittest.base.history import History, Quality
from knittest.base.rounding import rounded_down
from knittest.config.gates import NEAR
from knittest.laboratory.advice import AIM
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.judging import assess
from knittest.laboratory.span import Span
from knittest.laboratory.strips import AXIS, carrying_width, cut, pitch, yarns_across
from knittest.laboratory.tensile.config import TensileRun
from knittest.laboratory.tensile.peak import SAMPLES, tensile_results, unresolved_peak
from knittest.laboratory.tensile.rig import TensileTest
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import build_meso
from knittest.solve.observer import SILENT, Observer
from knittest.solve.simulate import simulate
from knittest.solve.state import SimulationCost

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
