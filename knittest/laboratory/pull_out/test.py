"""Pull-out test: one inlay out of a piece of fabric of yarns."""

import time as clock
from dataclasses import replace

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import History, Quality
from knittest.laboratory.after_rest import after_rest
from knittest.laboratory.base import Prepared, Test
from knittest.laboratory.judging import assess
from knittest.laboratory.pull_out.config import PullOutRun
from knittest.laboratory.pull_out.piece import nodes_of
from knittest.laboratory.pull_out.rig import REST, PullOutTest
from knittest.laboratory.pull_out.sliding import LEFT, sliding
from knittest.laboratory.span import Span
from knittest.laboratory.strips import AXIS, cut, pitch, yarns_across
from knittest.models.meso import build_meso
from knittest.solve.observer import SILENT, Observer
from knittest.solve.simulate import simulate
from knittest.solve.state import SimulationCost

#: yarns across the piece, of which clamps hold two and one is pulled
LEAST_YARNS = 5
#: difference of the forces of both clamps over the pull force, on the mean while sliding [%]
UNBALANCED = 5.0


class PullOut(Test[PullOutRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False

    def refuse(self, run: PullOutRun) -> None:
        """Raise :class:`InputError` for a piece that is too small, and for yarns that do not touch."""
        rig = run.rig
        if not run.model.meso.contact:
            raise InputError("model.meso.contact = false: nothing would hold the inlay: expected true")
        yarns, wanted = yarns_across(run, rig.direction), LEAST_YARNS / run.fabric.density_per_mm.of(rig.direction)
        if yarns < LEAST_YARNS:
            raise InputError(
                f"rig.width = {rig.width:g} mm: {yarns} {rig.direction} yarns; expected at least {LEAST_YARNS}, of "
                f"which one is pulled and clamps hold others: --set rig.width={np.ceil(wanted):g} is enough"
            )
        most = rig.length_mm - LEFT * pitch(run, rig.direction)
        if rig.travel_mm > most:
            raise InputError(
                f"rig.travel = {rig.travel:g} mm: expected at most {most:.3g} mm, so that a pitch of it stays in "
                f"the piece of rig.length = {rig.length:g} mm"
            )

    def prepare(self, run: PullOutRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The piece in its clamps, of whole pitches."""
        self.refuse(run)
        start, direction = clock.perf_counter(), run.rig.direction
        period, fabric = pitch(run, direction), run.fabric
        across, along = yarns_across(run, direction, specimen), round(run.rig.length_mm / period)
        n_wales, n_courses = (across, along) if direction == "warp" else (along, across)
        piece = cut(run, n_wales, n_courses, specimen, observer)
        size = n_wales * fabric.wale_spacing, n_courses * fabric.course_spacing
        nodes = nodes_of(run, piece.paths, size)
        model = build_meso(run, piece.paths, piece.draws, run.rig.membrane_share)
        mount = PullOutTest(run, AXIS[direction], nodes.pulled, nodes.held, along * period)
        facts = {
            "area_mm2": size[0] * size[1], "embedded_mm": along * period, "pitch_mm": period,
            "crossings": float(along), "tail_node": float(nodes.tail), "pulled_node": float(nodes.pulled[0]),
            "piece_width_mm": size[1 - AXIS[direction]], "clamped_edge_mm": nodes.edge,
        }  # fmt: skip
        return Prepared(model, mount, clock.perf_counter() - start, piece.table, facts)

    def solve(self, prepared: Prepared, run: PullOutRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Let the piece come to rest, then pull."""
        history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, observer)
        return self.finish(run, prepared, history), cost

    def finish(self, run: PullOutRun, prepared: Prepared, history: History) -> History:
        """The pull, with the way of the inlay's free end."""
        return with_tail(after_rest(history, REST), prepared.facts, AXIS[run.rig.direction])

    def results(self, run: PullOutRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Force at which the inlay lets go, largest, mean while it slides; friction and normal force of a crossing."""
        facts, friction = prepared.facts, run.fabric.contact.friction_coefficient.value
        found = sliding(history.curve, facts["pitch_mm"])
        return {
            "pull_out_at_rest_n": found.at_rest,
            "pull_out_peak_n": found.peak,
            "pull_out_sliding_n": found.mean,
            "crossing_friction_at_rest_n": found.at_rest / facts["crossings"],
            "crossing_friction_n": found.per_crossing,
            "crossing_normal_force_n": found.per_crossing / friction if friction > 0.0 else float("nan"),
            "crossings": facts["crossings"],
            "slid_mm": found.way,
            "clamp_difference_pct": clamp_difference(history),
        }

    def assess(self, run: PullOutRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run, an inlay that slides by a pitch, and clamps that balance."""
        quality = assess(run, prepared, history, cost, self.span(history))
        found = self.results(run, prepared, history)
        period = prepared.facts["pitch_mm"]
        if not np.isfinite(found["pull_out_sliding_n"]):
            quality = quality.refusing(
                f"the inlay slides by {found['slid_mm']:.2f} mm, less than a pitch of {period:.2f} mm: "
                f"rig.travel={run.rig.travel + 1.2 * (period - found['slid_mm']):.3g} would be enough"
            )
        if found["clamp_difference_pct"] > UNBALANCED:
            quality = quality.refusing(
                f"the clamps differ by {found['clamp_difference_pct']:.1f} % of the mean pull force: expected at most "
                f"{UNBALANCED:g} %; a lower solver.speed brings them together"
            )
        return quality

    def span(self, history: History) -> Span:
        """The whole pull."""
        return Span()


def with_tail(history: History, facts: dict[str, float], axis: int) -> History:
    """``history`` with way of the inlay's free end and embedded length [mm] in its curve, on lines between frames."""
    tail, begin = int(facts["tail_node"]), history.curve["time_ms"][0]
    time = np.array([frame.time for frame in history.frames])
    place = np.array([frame.position[tail, axis] for frame in history.frames])
    moved = np.interp(history.curve["time_ms"], time, place) - np.interp(begin, time, place)
    embedded = np.clip(facts["embedded_mm"] - moved, 0.0, facts["embedded_mm"])
    return replace(history, curve=history.curve | {"tail_travel_mm": moved, "embedded_mm": embedded})


def clamp_difference(history: History) -> float:
    """Difference of the mean forces of both clamps over the mean pull force [%], over the second half of the pull."""
    curve = history.curve
    late = curve["displacement_mm"] >= 0.5 * curve["displacement_mm"].max()
    pull, held = (float(curve[name][late].mean()) for name in ("pull_force_n", "clamp_force_n"))
    return 100.0 * abs(held - pull) / max(abs(pull), 1e-12)
