"""Files of pull-outs as ``knittest data`` takes them: the forces of a run, friction of a crossing, corridor.

They hold the force on an inlay over the travel of its clamp and, where it was measured, of its free end.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from knittest.base.errors import InputError
from knittest.experiment import lab_shear as checks
from knittest.experiment.lab_conditions import CLAMPED_EDGES, CROSSING_DENSITY, EMBEDDED, SLID_PITCHES, common_value
from knittest.experiment.lab_recording import Origin, Recording, make_reader
from knittest.experiment.lab_results import Curves, Results
from knittest.experiment.lab_tests import LabTest
from knittest.experiment.statistics import Array, band
from knittest.laboratory.pull_out.sliding import LEFT, SLIDES, SlidingForces, evaluate_sliding

NAME = "pull-out"
TAIL, FORCE, FORCE_SD = "tail_travel_mm", "pull_force_n", "pull_force_sd_n"
AT_REST, PEAK, MEAN = "pull_out_at_rest_n", "pull_out_peak_n", "pull_out_sliding_n"
EACH_AT_REST, EACH = "crossing_friction_at_rest_n", "crossing_friction_n"
HEADS = {
    AT_REST: "at rest [N]", PEAK: "largest [N]", MEAN: "slides [N]", EACH_AT_REST: "a crossing at rest [N]",
    EACH: "a crossing, sliding [N]",
}  # fmt: skip
UNITS = dict.fromkeys(HEADS, "N")
#: number of clamped edges, and what they are called, by ``rig.clamped_edges``
EDGES = {"sides": 2.0, "far": 1.0}
WORDS = {"sides": "both sides clamped", "far": "the far end clamped"}
#: friction of a crossing [N], from a fine yarn in a loose knit to a tow that is sewn in
CROSSING = (1e-5, 20.0)
#: largest dependence of a force at rest on the begin of sliding of a free end that was not measured
UNSURE = 0.1
#: travel [mm] over which rows are averaged
STEP = 0.02
#: travel [mm] on both sides of the begin of sliding by whose rows the force is read, and largest distance of rows there
NEAR, COARSE = 0.02, 0.04
#: travel of the free end over that of the clamp while sliding, and largest share of the force that remains at the end
TOGETHER, GONE = (0.7, 1.1), 0.25


@dataclass(frozen=True)
class PullOutSpecimen(Origin):
    """Travel of the free end [mm] (``measured``, or the clamp's), force [N] (n,), length [mm], crossings per 100 mm."""

    tail: Array
    force: Array
    length: float
    density: float
    clamped: str
    measured: bool

    @property
    def pitch(self) -> float:
        """Distance of the crossings [mm]."""
        return 100.0 / self.density

    @property
    def doubt(self) -> float:
        """Change of the force at rest with :data:`NEAR` of the travel of a free end that was not measured [-]."""
        less, read, more = (force_at_slide(self.tail, self.force, SLIDES + way) for way in (-NEAR, 0.0, NEAR))
        return 0.0 if self.measured else 0.5 * abs(more - less) / max(abs(read), 1e-12)


def _read_specimen(r: Recording) -> PullOutSpecimen:
    """Read an inlay until a pitch of it is embedded, as in a run."""
    origin, (length, density) = r.read(("free_end",), unit_needed=True), r.require(EMBEDDED, CROSSING_DENSITY)
    if r.given.clamped is None:
        raise InputError(
            f"{r.path}: the clamped edges are unknown: give --clamped sides (both along the inlay) or --clamped far "
            "(the one away from the pull)"
        )
    travel, tail = _travels(r)
    rows, _ = checks.first_loading(travel)
    travel, tail = travel[rows] - travel[0], tail[rows]
    force = checks.to_tension_force(r.values["force"][rows], r.given.sign, r.place)
    _check_free_end(travel, tail, r.place)
    tail = np.maximum.accumulate(np.maximum(tail, 0.0))
    lets_go = force_at_slide(tail, force)  # a small part of the largest
    force = checks.remove_preload(force, r.given.preload, r.place, ("the inlay begins to slide at", lets_go))
    measured, edges = "free_end" in r.values, r.given.clamped
    one = PullOutSpecimen(
        **origin, tail=tail, force=force, length=length, density=density, clamped=edges, measured=measured
    )
    held, out = tail <= length - LEFT * one.pitch, tail >= length + one.pitch
    before, after = (float(force[rows].mean()) if rows.any() else 0.0 for rows in (held, out))
    if after > GONE * before:
        raise InputError(
            f"{one.place}: {after:.3g} N where all {length:g} mm are out, {before:.3g} N before; expected about 0: "
            f"check {EMBEDDED.option} and the unit of the travel"
        )
    tail, force = tail[held], force[held]
    each = force / (length - tail) * one.pitch
    start, end = (each[rows].mean() for rows in (tail <= one.pitch, tail >= tail[-1] - one.pitch))
    if not one.measured and end < GONE * start:  # the free end need not have moved with the clamp
        raise InputError(
            f"{one.place}: the force falls from {start:.3g} to {end:.3g} N per crossing. If the yarn broke or slipped "
            "out of its clamp, remove the rows after that, or add the travel of the free end"
        )
    return replace(one, tail=tail, force=force)


def _travels(r: Recording) -> tuple[Array, Array]:
    """Travel of the clamp [mm], rising, and of the free end: measured, or that of the clamp beyond ``--zero``."""
    way, end, zero, factor = r.travel(), r.values.get("free_end"), r.given.zero, r.factors["travel"]
    if end is not None:
        if zero is not None:
            raise InputError(f"{r.place}: --zero: not used with a column of the free end, {r.title('free_end')!r}")
        return checks.to_rising_travel(way, r.given.sign), checks.to_rising_travel(end - end[0], "negative")
    if zero is None:
        raise InputError(
            f"{r.place}: no column of the free end, and the travel of the clamp includes slack and stretch of the "
            "yarn: give --zero, the displacement at which the free end begins to move, in the column's unit"
        )
    *moved, begins = checks.to_rising_travel(np.append(way, zero * factor), r.given.sign)
    travel = np.array(moved)
    if not travel[0] <= begins < travel.max():
        raise InputError(
            f"{r.place}: --zero {zero:g}: expected a displacement of the file, {way[0] / factor:g} to "
            f"{way[int(np.argmax(travel))] / factor:g}"
        )
    return travel, np.maximum(travel - begins, 0.0)


def _check_free_end(travel: Array, tail: Array, where: str) -> None:
    """Raise :class:`InputError` for a free end that does not move with the clamp while the inlay slides."""
    slides = tail >= SLIDES
    if len(travel) < 3 or not slides.any():
        raise InputError(
            f"{where}: {len(travel)} rows over {travel[-1]:.4g} mm, the free end moves by {tail.max():.3g} mm; "
            f"expected at least 3 rows and {SLIDES:g} mm: check the unit of the travel"
        )
    first = int(np.argmax(slides))
    clamp, end = travel[-1] - travel[first], tail[-1] - tail[first]
    if clamp > 10.0 * SLIDES and not TOGETHER[0] <= end / clamp <= TOGETHER[1]:
        raise InputError(
            f"{where}: while the inlay slides its clamp moves by {clamp:.4g} mm, its free end by {end:.4g} mm; "
            "expected about the same: check both units"
        )
    gap = tail[first] - tail[max(first - 1, 0)]
    if gap > COARSE:
        raise InputError(
            f"{where}: {gap:.3g} mm between the rows where the inlay begins to slide; expected at most {COARSE:g} mm: "
            "export more points, or check the unit of the travel"
        )


def force_at_slide(tail: Array, force: Array, way: float = SLIDES) -> float:
    """Force [N] where the free end has moved by ``way`` [mm], on a line through the few rows about it."""
    near = np.abs(tail - way) <= NEAR
    if np.count_nonzero(near) > 2 and np.ptp(tail[near]) > 0.0:
        return float(np.polyfit(tail[near] - way, force[near], 1)[1])
    rising = np.append(True, np.diff(tail) > 0.0)
    return float(np.interp(way, tail[rising], force[rising]))


def _average_steps(tail: Array, force: Array) -> tuple[Array, Array]:
    """Means of the rows over steps of :data:`STEP` of the free end's travel, against noise of the largest force."""
    _, block = np.unique(np.floor(tail / STEP + 1e-9), return_inverse=True)
    count = np.bincount(block)
    return np.bincount(block, tail) / count, np.bincount(block, force) / count


def _evaluate_pull(one: PullOutSpecimen, end: float) -> SlidingForces:
    """Forces of an inlay up to the travel ``end`` [mm] of all inlays, as of a run."""
    tail, force = _average_steps(one.tail[one.tail <= end], one.force[one.tail <= end])
    found = evaluate_sliding({TAIL: tail, FORCE: force, "embedded_mm": one.length - tail}, one.pitch)
    found = replace(found, force_at_rest=force_at_slide(one.tail, one.force))
    if not np.isfinite(found.mean):
        raise InputError(
            f"{one.place}: the common slide of all inlays is {found.way:.3g} mm; expected at least the distance of the "
            f"crossings, {one.pitch:.3g} mm: check the unit of the travel and {EMBEDDED.option}"
        )
    each = (found.force_at_rest * one.pitch / one.length, found.per_crossing)
    words = (
        f"{found.force_at_rest:.4g} N at the begin of sliding and {found.mean:.4g} N while sliding are "
        f"{each[0]:.3g} and "
        f"{each[1]:.3g} N per crossing"
    )
    for value in each:
        checks.refuse_implausible(one, value, CROSSING, words, "N", found.mean)
    return found


def _results(pulls: Sequence[PullOutSpecimen]) -> Results:
    length = common_value(EMBEDDED, [one.length for one in pulls], pulls)
    density = common_value(CROSSING_DENSITY, [one.density for one in pulls], pulls)
    end = min(float(one.tail[-1]) for one in pulls)
    found = [_evaluate_pull(one, end) for one in pulls]
    crossings = np.array([one.length / one.pitch for one in pulls])
    lets_go, peak, mean, each = np.array([[one.force_at_rest, one.peak, one.mean, one.per_crossing] for one in found]).T
    rows = {AT_REST: lets_go, PEAK: peak, MEAN: mean, EACH_AT_REST: lets_go / crossings, EACH: each}
    checks.refuse_outliers(pulls, mean, "force while it slides", "N")
    clamped, slid = pulls[0].clamped, float(min(int(one.way * density / 100.0 + 1e-6) for one in found))
    remarks = [
        f"at rest: at a travel of the free end of {SLIDES:g} mm; largest: up to half a pitch; slides: mean over whole "
        "pitches; as in a run"
    ]
    if not all(one.measured for one in pulls):
        remarks.append("the free end was not measured: it moves with the clamp from --zero on, without stretch")
    if (doubt := max(one.doubt for one in pulls)) > UNSURE:
        del rows[AT_REST], rows[EACH_AT_REST]
        remarks.append(
            f"no force at rest: it changes by {100.0 * doubt:.0f} % with {NEAR:g} mm of --zero (limit "
            f"{100.0 * UNSURE:g} %): measure the free end"
        )
    remarks.append("forces must be those of friction alone: subtract weight and the force of the empty clamp before")
    curves = [(tail[1:], force[1:]) for tail, force in (_average_steps(s.tail, s.force) for s in pulls)]  # rising
    corridor = band(curves, min(float(tail[-1]) for tail, _ in curves), "sliding")
    return Results(
        rows, UNITS,
        [(EMBEDDED, length), (CROSSING_DENSITY, density), (CLAMPED_EDGES, EDGES[clamped]), (SLID_PITCHES, slid)],
        ("pull-out", f"with {length:g} mm embedded, {WORDS[clamped]}"),
        checks.digests(pulls, [(one.tail, one.force) for one in pulls]),
        [(HEADS[name], ".4g", values) for name, values in rows.items()], remarks,
        Curves(curves, corridor, (TAIL, FORCE, FORCE_SD), ("travel of the free end [mm]", "pull force [N]")),
    )  # fmt: skip


# no rigs: a preset gives the piece its size
LAB = LabTest(
    NAME,
    make_reader(
        [("force",), ("travel",)], "a force and a displacement, one free end a force or none", _read_specimen,
        shared=True,
    ),
    _results, (EMBEDDED, CROSSING_DENSITY), ("sign", "zero", "preload", "clamped"),
)  # fmt: skip
