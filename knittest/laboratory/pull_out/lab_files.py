"""Files of pull-outs as ``knittest data`` takes them: the forces of a run, friction of a crossing, corridor."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_checks import common, digests, refuse_apart, refuse_implausible
from knittest.experiment.lab_conditions import CLAMPED_EDGES, CROSSING_DENSITY, EMBEDDED, SLID_PITCHES
from knittest.experiment.lab_recording import reader
from knittest.experiment.lab_results import Curves, Results
from knittest.experiment.lab_tests import LabTest
from knittest.experiment.statistics import band
from knittest.laboratory.pull_out.lab_pulls import NEAR, Pulled, at_rest, read_pull
from knittest.laboratory.pull_out.sliding import SLIDES, Sliding, sliding

Array = NDArray[np.float64]

NAME = "pull-out"
TAIL, FORCE, FORCE_SD = "tail_travel_mm", "pull_force_n", "pull_force_sd_n"
AT_REST, PEAK, MEAN = "pull_out_at_rest_n", "pull_out_peak_n", "pull_out_sliding_n"
EACH_AT_REST, EACH = "crossing_friction_at_rest_n", "crossing_friction_n"
UNITS = dict.fromkeys((AT_REST, PEAK, MEAN, EACH_AT_REST, EACH), "N")
HEADS = {
    AT_REST: "at rest [N]", PEAK: "largest [N]", MEAN: "slides [N]", EACH_AT_REST: "a crossing at rest [N]",
    EACH: "a crossing, sliding [N]",
}  # fmt: skip
#: number of clamped edges, and what they are called, by ``rig.clamped``
EDGES = {"sides": 2.0, "far": 1.0}
WORDS = {"sides": "both sides clamped", "far": "the far end clamped"}
#: friction of a crossing [N], from a fine yarn in a loose knit to a tow that is sewn in
CROSSING = (1e-5, 20.0)
#: share by which a force at rest may hang on where a free end that nobody followed began to move
UNSURE = 0.1
#: way [mm] over which rows are averaged
STEP = 0.02


def _slides(pulls: Sequence[Pulled]) -> list[Sliding]:
    """Forces of each inlay up to the way that all of them slide, as of a run.

    Raises :class:`InputError` for an inlay that slides by less than a pitch, and for forces that no yarn has.
    """
    end = min(float(one.tail[-1]) for one in pulls)
    found = []
    for one in pulls:
        whole = one.tail <= end
        tail, force = _averaged(one.tail[whole], one.force[whole])
        read = sliding({TAIL: tail, FORCE: force, "embedded_mm": one.length - tail}, one.pitch)
        found.append(replace(read, at_rest=at_rest(one.tail, one.force)))
        _refuse_none(one, found[-1])
    return found


def _averaged(tail: Array, force: Array) -> tuple[Array, Array]:
    """Means of the rows over steps of :data:`STEP` of the free end's way: the noise of one is no largest force."""
    _, block = np.unique(np.floor(tail / STEP + 1e-9), return_inverse=True)
    count = np.bincount(block)
    return np.bincount(block, tail) / count, np.bincount(block, force) / count


def _refuse_none(one: Pulled, found: Sliding) -> None:
    if not np.isfinite(found.mean):
        raise InputError(
            f"{one.path}: specimen {one.name}: all inlays together slide by {found.way:.3g} mm with a pitch of it "
            f"embedded: expected at least the distance of the crossings, {one.pitch:.3g} mm: check the unit of the way "
            f"and {EMBEDDED.option}"
        )
    each, force = (found.at_rest * one.pitch / one.length, found.per_crossing), found.mean
    told = f"{found.at_rest:.4g} N where it lets go and {force:.4g} N while it slides are "
    for value in each:
        refuse_implausible(one, value, CROSSING, f"{told}{each[0]:.3g} and {each[1]:.3g} N a crossing", "N", force)


def _results(pulls: Sequence[Pulled]) -> Results:
    """Forces of one series and friction of its crossings."""
    length = common(EMBEDDED, [one.length for one in pulls], pulls)
    density = common(CROSSING_DENSITY, [one.density for one in pulls], pulls)
    found = _slides(pulls)
    crossings = np.array([one.length / one.pitch for one in pulls])
    lets_go, peak, mean = (np.array([getattr(one, name) for one in found]) for name in ("at_rest", "peak", "mean"))
    each = np.array([one.per_crossing for one in found])
    rows = {AT_REST: lets_go, PEAK: peak, MEAN: mean, EACH_AT_REST: lets_go / crossings, EACH: each}
    if (doubt := max(one.doubt for one in pulls)) > UNSURE:
        del rows[AT_REST], rows[EACH_AT_REST]
    refuse_apart(pulls, rows[MEAN], "force while it slides", "N")
    clamped, pitches = pulls[0].clamped, min(int(one.way * density / 100.0 + 1e-6) for one in found)
    conditions = [
        (EMBEDDED, length), (CROSSING_DENSITY, density), (CLAMPED_EDGES, EDGES[clamped]),
        (SLID_PITCHES, float(pitches)),
    ]  # fmt: skip
    remarks = [
        f"at rest: where the free end has gone {SLIDES:g} mm; largest: up to half a pitch; slides: mean over whole "
        "pitches; as of a run"
    ]
    if not all(one.measured for one in pulls):
        remarks.append("the free end was not followed: it goes with the clamp from --zero on, without stretch")
    if AT_REST not in rows:
        remarks.append(
            f"no force at rest: {NEAR:g} mm more or less of --zero change it by {100.0 * doubt:.0f} %, "
            f"{100.0 * UNSURE:g} are allowed: follow the free end"
        )
    remarks.append("forces are taken as friction alone: subtract weight and what the empty clamp takes before")
    averaged = [_averaged(one.tail, one.force) for one in pulls]
    curves = [(tail[1:], force[1:]) for tail, force in averaged]  # rising from where it goes
    return Results(
        rows, UNITS, conditions, ("pull-out", f"with {length:g} mm embedded, {WORDS[clamped]}"),
        digests(pulls, [(one.tail, one.force) for one in pulls]),
        [(HEADS[name], ".4g", values) for name, values in rows.items()], remarks,
        Curves(
            curves, band(curves, min(float(tail[-1]) for tail, _ in curves), "sliding"), (TAIL, FORCE, FORCE_SD),
            ("way of the free end [mm]", "pull force [N]"),
        ),
    )  # fmt: skip


# no rigs: a preset gives the piece its size
LAB = LabTest(
    NAME,
    reader(
        [("force",), ("travel",)], "a force and a displacement, one free end a force or none", read_pull,
        optional=("free_end",), shared=True, unit_needed=True,
    ),
    _results, (EMBEDDED, CROSSING_DENSITY), ("sign", "zero", "preload", "clamped"),
)  # fmt: skip
