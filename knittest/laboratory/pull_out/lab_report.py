"""Writes what an import of pull-outs yields: the forces of a run, friction of a crossing, corridor."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.experiment.lab_checks import common, digest, refuse_apart, refuse_copies
from knittest.experiment.lab_conditions import CLAMPED_EDGES, CROSSING_DENSITY, EMBEDDED, SLID_PITCHES
from knittest.experiment.lab_direction import refuse_other
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import curve_text
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_picture import plot
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.lab_units import likely_force
from knittest.experiment.statistics import band
from knittest.laboratory.pull_out.lab_pulls import NEAR, Pulled, at_rest
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


def slides(pulls: Sequence[Pulled]) -> list[Sliding]:
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
    where = f"{one.path}: specimen {one.name}"
    if not np.isfinite(found.mean):
        raise InputError(
            f"{where}: all inlays together slide by {found.way:.3g} mm with a pitch of it embedded: expected at least "
            f"the distance of the crossings, {one.pitch:.3g} mm: check the unit of the way and {EMBEDDED.option}"
        )
    each = (found.at_rest * one.pitch / one.length, found.per_crossing)
    low, high = CROSSING
    if not all(low <= force <= high for force in each):
        limits = (low * one.length / one.pitch, high * one.length / one.pitch)
        raise InputError(
            f"{where}: {found.at_rest:.4g} N where it lets go and {found.mean:.4g} N while it slides are {each[0]:.3g} "
            f"and {each[1]:.3g} N a crossing: implausible, expected {low:g} to {high:g} N"
            f"{likely_force(found.mean, one.unit, limits)}: check the unit of the force"
        )


def pull_results(pulls: Sequence[Pulled], direction: str, files: Sequence[str]) -> Results:
    """Forces of one series and friction of its crossings; raises :class:`InputError` where they are not of one."""
    paths = [one.path for one in pulls]
    length = common(EMBEDDED, [one.length for one in pulls], paths)
    density = common(CROSSING_DENSITY, [one.density for one in pulls], paths)
    found = slides(pulls)
    crossings = np.array([one.length / one.pitch for one in pulls])
    lets_go = np.array([one.at_rest for one in found])
    rows = {
        AT_REST: lets_go, PEAK: np.array([one.peak for one in found]), MEAN: np.array([one.mean for one in found]),
        EACH_AT_REST: lets_go / crossings, EACH: np.array([one.per_crossing for one in found]),
    }  # fmt: skip
    if max(one.doubt for one in pulls) > UNSURE:
        del rows[AT_REST], rows[EACH_AT_REST]
    refuse_apart([(one.name, one.path) for one in pulls], rows[MEAN], "force while it slides", "N")
    digests = [digest(one.tail, one.force) for one in pulls]
    refuse_copies([(one.name, d) for one, d in zip(pulls, digests, strict=True)])
    clamped, pitches = pulls[0].clamped, min(int(one.way * density / 100.0 + 1e-6) for one in found)
    conditions = [
        (EMBEDDED, length), (CROSSING_DENSITY, density), (CLAMPED_EDGES, EDGES[clamped]),
        (SLID_PITCHES, float(pitches)),
    ]  # fmt: skip
    more = f"with {length:g} mm embedded, {WORDS[clamped]}"
    return Results(NAME, direction, rows, UNITS, conditions, ("pull-out", more), files, digests)


def pull_lines(pulls: Sequence[Pulled]) -> list[str]:
    """Table of the forces with mean and sd, how they are defined, and what they hang on."""
    results = pull_results(pulls, "", [])
    rows = np.array(list(results.found.values())).T
    lines = table_lines(
        [(HEADS[name], ".4g") for name in results.found],
        [(one.name, values) for one, values in zip(pulls, rows, strict=True)],
    )
    lines.append(
        f"at rest: where the free end has gone {SLIDES:g} mm; largest: up to half a pitch; slides: mean over whole "
        "pitches; as of a run"
    )
    if not all(one.measured for one in pulls):
        lines.append("the free end was not followed: it goes with the clamp from --zero on, the inlay does not stretch")
    if AT_REST not in results.found:
        doubt = 100.0 * max(one.doubt for one in pulls)
        lines.append(
            f"no force at rest: {NEAR:g} mm more or less of --zero change it by {doubt:.0f} %, {100.0 * UNSURE:g} are "
            "allowed: follow the free end"
        )
    lines.append("forces are taken as friction alone: weight and what the empty clamp takes must have been subtracted")
    return lines + [f"{what.name}: {value:.4g} {what.unit}".removesuffix(" 1") for what, value in results.conditions]


def write_pulls(pulls: Sequence[Pulled], out: Path, direction: str, files: Sequence[str], trusted: bool = False) -> str:
    """Write table and folder ``pull-out-<direction>`` into the experiment ``out``; returns the variant."""
    if not trusted:
        refuse_other([one.said for one in pulls], direction)
    results = pull_results(pulls, direction, files)
    curves = [_rising(one) for one in pulls]
    corridor = band(curves, min(float(tail[-1]) for tail, _ in curves), "sliding")
    inner, notes = write_results(out, results), results.notes(out)
    for number, (one, (tail, force)) in enumerate(zip(pulls, curves, strict=True), 1):
        text = curve_text([f"# specimen: {one.name}", *notes[1:]], {TAIL: tail, FORCE: force})
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    mean = {TAIL: corridor.strain, FORCE: corridor.mean, FORCE_SD: corridor.sd}
    write_atomic(inner / "corridor.csv", curve_text(notes, mean))
    plot(curves, corridor, ("way of the free end [mm]", "pull force [N]"), inner / "curves.png")
    finish(out)
    return out.resolve().name


def _rising(one: Pulled) -> tuple[Array, Array]:
    """Way of the free end, rising from where it goes, and force, both averaged."""
    tail, force = _averaged(one.tail, one.force)
    return tail[1:], force[1:]
