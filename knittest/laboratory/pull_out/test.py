"""Pull-out test: the end of one inlay is pulled out of a piece of fabric of yarns that clamps hold."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.history import Body, History, Quality
from knittest.config.structure import Inlays
from knittest.fabric.strip import YarnPath
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.fabric_test import FabricTest, TestRig
from knittest.laboratory.pull_out.config import PullOutRun
from knittest.laboratory.pull_out.sliding import LEFT, evaluate_sliding
from knittest.laboratory.quality_checks import check_limit
from knittest.laboratory.restart import history_from_time
from knittest.laboratory.strips import (
    AXIS,
    check_has_inlays,
    cut_piece,
    make_jaw,
    offsets,
    pitch,
    plate_block,
    wale_course_counts,
    yarns_across,
)
from knittest.models.boundary import Boundary, Readings
from knittest.models.meso import build_meso, in_chain_order
from knittest.models.tool import Table, ramp
from knittest.solve.state import Observer, SimulationCost

Index = NDArray[np.int64]


@dataclass(frozen=True)
class PullOutNodes:
    """Clamped end of the inlay, free ``tail``, and nodes ``held`` at the clamped ``edge`` [mm]."""

    pulled: Index
    tail: int
    held: Index
    edge: float


def middle_number(inlays: Inlays, wales_or_courses: int) -> int:
    """Wale or course, from 0, of the inlay nearest to the middle of a piece, the later of two; raises without one."""
    numbers = [k for k in range(wales_or_courses) if inlays.has_inlay(k)]
    return min(reversed(numbers), key=lambda k: abs(2 * k + 1 - wales_or_courses))


def is_free_of_clamps(inlays: Inlays, wales_or_courses: int) -> bool:
    """Tell whether a wale or course at least lies between each clamped side and the inlay nearest to the middle."""
    return 2 <= middle_number(inlays, wales_or_courses) < wales_or_courses - 2


def nodes_of(run: PullOutRun, paths: list[YarnPath], size: tuple[float, float]) -> PullOutNodes:
    """Nodes of ``paths``, numbered as in the model, in a piece of ``size`` (along x, y) [mm]."""
    direction = run.rig.direction
    axis = AXIS[direction]
    ordered = in_chain_order(run.fabric, paths)
    start = np.concatenate([[0], np.cumsum([len(p.points) for p in ordered])])
    inlays = run.fabric.inlays_along(direction)[0]
    wales_or_courses = round(size[1 - axis] * run.fabric.density_per_mm.of(direction))
    index = inlays.count(middle_number(inlays, wales_or_courses))
    chain = next(k for k, p in enumerate(ordered) if (p.system, p.index) == (inlays.name, index))
    points = np.concatenate([p.points for p in ordered])
    along, across = points[:, axis], points[:, 1 - axis]
    if run.rig.clamped_edges == "sides":
        edge = pitch(run, "weft" if direction == "warp" else "warp")
        gripped = (across <= edge) | (across >= size[1 - axis] - edge)
    else:
        edge = pitch(run, direction)
        gripped = along <= edge
    gripped[start[chain] : start[chain + 1]] = False
    ends = int(start[chain]), int(start[chain + 1]) - 1
    tail, top = sorted(ends, key=lambda node: float(along[node]))
    return PullOutNodes(np.array([top], np.int64), tail, np.flatnonzero(gripped), edge)


# The end of one inlay is pulled out of the fabric along it, clamps hold all other yarns. The inlay comes to rest with
# the fabric first. It moves slowly: its inertia is small against a friction of some hundredths of a newton a crossing.

#: time in which the piece comes to rest before the pull [ms]
REST = 5.0
#: travel of the clamp [mm] in which the inlay begins to slide, and frames in it, which give the place of its free end
LETS_GO, FRAMES = 1.0, 16


class PullOutTest(TestRig):
    """Pull the nodes ``pulled`` along ``axis`` and hold the nodes ``held``; ``length`` [mm] is embedded."""

    coordinate, force = "displacement_mm", "pull_force_n"

    def __init__(self, run: PullOutRun, axis: int, pulled: Index, held: Index, length: float) -> None:
        self.axis, self.pulled, self.held, self.length = axis, pulled, held, length
        self.ring_length = self.length
        speed = ramp(run.solver.ramp_ms, run.solver.speed_mm_per_ms)
        self.speed = Table((0.0, *(REST + t for t in speed.time)), (0.0, *speed.value))
        end = self.speed.time[-1]
        rest = run.rig.travel_mm - self.speed.integral(end)
        self.duration = end + max(rest, 0.0) / run.solver.speed_mm_per_ms
        ways = np.linspace(0.0, min(LETS_GO, run.rig.travel_mm), FRAMES + 1)
        times = np.linspace(0.0, self.duration, 2000)
        moved = np.array([self.speed.integral(t) for t in times])
        self.marks = tuple(float(t) / self.duration for t in np.interp(ways, moved[moved > 0.0], times[moved > 0.0]))

    def constrain(self, boundary: Boundary) -> None:
        """Grip the inlay's end and the piece."""
        along = "xyz"[self.axis]
        boundary.grip(self.pulled, along, self.speed)
        boundary.grip(self.held, along)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Travel of the clamp, its force, and that of the piece's clamp."""
        pulled, held = (float(force) for force in readings.reaction[:2])
        return {"displacement_mm": self.speed.integral(time), "pull_force_n": pulled, "clamp_force_n": -held}


#: acceleration of gravity [mm/ms^2], and least mean pull force of an inlay that friction holds, in its weight
GRAVITY, LOOSE = 9.81e-3, 10.0
#: what lies side by side across the piece, and largest difference of the clamp forces over the pull force [%]
ACROSS, UNBALANCED = {"warp": "wales", "weft": "courses"}, 5.0


class PullOut(FabricTest[PullOutRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    lowers_speed = True

    def check_run(self, run: PullOutRun) -> None:
        """Raise :class:`InputError` for a piece that is too small, and for yarns that do not touch."""
        rig = run.rig
        if not run.model.meso.contact:
            raise InputError("model.meso.contact = false: without contact nothing holds the inlay; set it to true")
        check_has_inlays(run.fabric, rig.direction, "rig.direction", "pulls an inlay")
        inlays, number = run.fabric.inlays_along(rig.direction)[0], yarns_across(run, rig.direction, repeats=False)
        least = next(n for n in count(max(number, len(inlays.pattern))) if is_free_of_clamps(inlays, n))
        if number < least:
            raise InputError(
                f"rig.width = {rig.width:g} mm has {number} {ACROSS[rig.direction]}, expected at least {least}, so "
                "that one at least lies between the pulled inlay and each clamped side: use --set "
                f"rig.width={np.ceil(least / run.fabric.density_per_mm.of(rig.direction)):g}"
            )
        most = rig.length_mm - LEFT * pitch(run, rig.direction)
        if rig.travel_mm > most:
            raise InputError(
                f"rig.travel = {rig.travel:g} mm: expected at most {most:.3g} mm, so that a pitch of the inlay remains "
                f"in the piece of rig.length = {rig.length:g} mm"
            )

    def mount_yarns(self, run: PullOutRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the piece of whole pitches in its clamps."""
        direction, fabric = run.rig.direction, run.fabric
        period = pitch(run, direction)
        across, along = yarns_across(run, direction, specimen, repeats=False), round(run.rig.length_mm / period)
        n_wales, n_courses = wale_course_counts(direction, along, across)
        piece = cut_piece(run, n_wales, n_courses, specimen, observer)
        size = n_wales * fabric.wale_spacing, n_courses * fabric.course_spacing
        nodes = nodes_of(run, piece.paths, size)
        model = build_meso(run, piece.paths, piece.draws, run.rig.membrane_share)
        mount = PullOutTest(run, AXIS[direction], nodes.pulled, nodes.held, along * period)
        facts = {
            "area_mm2": size[0] * size[1], "embedded_mm": along * period, "pitch_mm": period,
            "crossings": float(along), "tail_node": float(nodes.tail), "pulled_node": float(nodes.pulled[0]),
            "piece_width_mm": size[1 - AXIS[direction]], "clamped_edge_mm": nodes.edge,
        }  # fmt: skip
        return PreparedSpecimen(model, mount, yarns=piece.table, facts=facts)

    def finish(self, run: PullOutRun, prepared: PreparedSpecimen, history: History) -> History:
        """Return the pull, with the travel of the inlay's free end."""
        return add_tail_travel(history_from_time(history, REST), prepared.facts, AXIS[run.rig.direction])

    def results(self, run: PullOutRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Force at which the inlay begins to slide, largest and mean force; friction and normal force of a crossing."""
        facts, friction = prepared.facts, run.fabric.contact.friction_coefficient.value
        found = evaluate_sliding(history.curve, facts["pitch_mm"])
        return {
            "pull_out_at_rest_n": found.force_at_rest,
            "pull_out_peak_n": found.peak,
            "pull_out_sliding_n": found.mean,
            "crossing_friction_at_rest_n": found.force_at_rest / facts["crossings"],
            "crossing_friction_n": found.per_crossing,
            "crossing_normal_force_n": found.per_crossing / friction if friction > 0.0 else float("nan"),
            "crossings": facts["crossings"],
            "slid_mm": found.way,
            "clamp_difference_pct": clamp_difference(history),
        }

    def assess(self, run: PullOutRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the standard checks, a slide of a pitch at least, and the balance of the clamps if quasi-static."""
        quality = super().assess(run, prepared, history, cost)
        found = self.results(run, prepared, history)
        if loose := loose_inlay_text(run, prepared.facts["embedded_mm"], history):
            return replace(quality, failures=(loose, *quality.failures))
        period = prepared.facts["pitch_mm"]
        if not np.isfinite(found["pull_out_sliding_n"]):
            quality = quality.with_failed_check(
                f"the inlay slides by {found['slid_mm']:.2f} mm, less than a pitch of {period:.2f} mm: use "
                f"--set rig.travel={run.rig.travel + 1.2 * (period - found['slid_mm']):.3g}"
            )
        apart = found["clamp_difference_pct"]
        text = f"the clamp forces differ by {apart:.1f} % of the mean pull force"
        if not quality.quasi_static:  # a lower speed mends both
            return quality
        return check_limit(quality, apart, UNBALANCED, text, ": lower solver.speed")


def loose_inlay_text(run: PullOutRun, embedded: float, history: History) -> str:
    """Message that the inlay slides under a force of the order of its weight; empty for one that friction holds.

    ``embedded`` [mm] is the length of the inlay in the piece.
    """
    inlays = run.fabric.inlays_along(run.rig.direction)[0]
    weight = inlays.yarn.linear_density_g_per_mm * embedded * GRAVITY
    pull = float(history.curve["pull_force_n"].mean())
    if pull >= LOOSE * weight:
        return ""
    return (
        f"the {inlays.name} inlay lies loose in the fabric: its mean pull force is {pull:.2g} N, less than "
        f"{LOOSE:g} times its weight of {weight:.2g} N. The loops do not press on it, so there is no friction to "
        f"measure. A shorter loop_length (now {run.fabric.loop_length_mm:g} mm) holds it"
    )


def add_tail_travel(history: History, facts: dict[str, float], axis: int) -> History:
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


#: facts of the piece: node that is pulled, width of it across the inlay, and of the edges that are clamped
CLAMPS = ("pulled_node", "piece_width_mm", "clamped_edge_mm")


def clamps(history: History, facts: Mapping[str, float], axis: int, sides: bool) -> list[Body]:
    """Clamps on both sides of the piece, or on its far end, and on the inlay, pulled along ``axis`` (0: x, 1: y)."""
    still = offsets(history, {})
    edge, far = facts["clamped_edge_mm"], facts["piece_width_mm"] - facts["clamped_edge_mm"]
    if sides:
        held = [
            make_jaw("first side clamp", history, 1 - axis, (edge, -1.0), still, aside=0.0),
            make_jaw("second side clamp", history, 1 - axis, (far, 1.0), still, aside=0.0),
        ]
    else:
        held = [make_jaw("far clamp", history, axis, (edge, -1.0), still)]
    # a cube as wide as a clamped edge, at the end of the inlay
    centre = history.frames[0].position[int(facts["pulled_node"])].copy()
    centre[axis] += 0.5 * edge
    moved = offsets(history, {axis: "displacement_mm"})
    return [*held, plate_block("inlay clamp", centre, np.full(3, edge), moved)]
