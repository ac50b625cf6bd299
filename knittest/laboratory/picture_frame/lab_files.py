"""Files of picture frames as ``knittest data`` takes them: forces at angles, a shear law, the rig of both, and cycles.

A cycle of a run begins and ends at a shear angle of zero, and all cycles turn at one angle: loops with other ends
enclose another area.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.experiment import lab_shear as shear
from knittest.experiment.lab_conditions import (
    CYCLE_ANGLE,
    CYCLES,
    FABRIC_SIDE,
    FRAME_SIDE,
    SAME,
    Condition,
    common_value,
)
from knittest.experiment.lab_recording import Recording, make_reader
from knittest.experiment.lab_results import SHEAR, Results, Tests, count_text, table_lines
from knittest.experiment.lab_tests import LabTest
from knittest.experiment.statistics import Array, Corridor
from knittest.laboratory.picture_frame.test import Cycle, cycles_of
from knittest.materials import trellis
from knittest.materials.trellis import ANGLE, CONJUGATE, NORMALISED

NAME = "picture-frame"
#: width of the steps over which the law is averaged [deg]
STEP = 1.0
LAW = (
    "# conjugate to the shear angle, per reference area; mean of the specimens over 1 deg, from the origin, not falling"
)
#: unloading, as a share of the largest angle, from which on a frame has turned
TURN_SHARE = 0.1
#: difference of two angles at which cycles turn, as a share, that does not matter: twice as much work
SAME_TURN = 0.01
#: step [deg] over which the force is averaged where it is gone
UNLOADING_STEP = 0.25
#: share of its work by which a loop may give back more than it took: rounding, noise
GIVEN_BACK_SHARE = 0.01
WORK, LOSS, SHARE = "cycle_work_mj", "cycle_loss_mj", "cycle_loss_share_pct"
RESIDUAL, LAST = "cycle_residual_angle_deg", "last_cycle_loss_share_pct"
UNITS = {WORK: "mJ", LOSS: "mJ", SHARE: "%", RESIDUAL: "deg", LAST: "%"}
CYCLE_QUANTITIES = tuple(UNITS)
HEADS = {WORK: "work [mJ]", LOSS: "loss [mJ]", SHARE: "loss [%]", RESIDUAL: "gone at [deg]", LAST: "last loss [%]"}


@dataclass(frozen=True)
class FrameSpecimen(shear.ShearLoading):
    """Specimen with sides [mm] of frame and fabric, and ``cycles`` that ``turn`` [deg], or why ``not_cycled``."""

    frame_side: float
    fabric_side: float
    cycles: Sequence[Cycle] = ()
    turn: float = float("nan")
    cycle_problem: str = ""

    @property
    def normalised_force(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        sides = self.fabric_side, self.frame_side
        return np.asarray(trellis.normalised_force(self.force, np.deg2rad(self.angle), *sides))


def _read_specimen(r: Recording) -> FrameSpecimen:
    """Read a shear angle, or convert the displacement to one by the frame's side."""
    origin, loading, (side, fabric) = r.read(), r.given.loading, r.require(FRAME_SIDE, FABRIC_SIDE)
    if fabric > side * (1.0 + SAME):
        raise InputError(f"{r.path}: fabric side {fabric:g} mm exceeds the frame side {side:g} mm: exchange the two")
    tested = shear.ShearSetup(
        NAME, lambda travel: trellis.frame_angle(travel, side), (2.0 - 2.0**0.5) * side, f"a frame of {side:g} mm",
        "the frame square", FRAME_SIDE.option,
    )  # fmt: skip
    sheared, (angle, force) = shear.shear_curve(r, tested)
    one = FrameSpecimen(**origin, **sheared, frame_side=side, fabric_side=fabric)
    if loading == "first" or (loading is None and not one.turned):
        return one
    try:
        cycles, turns = cycles_in(angle, force, side, r.place), angle[_turn_rows(angle)[1::2]]
        return replace(one, cycles=cycles, turn=float(turns.mean()))
    except InputError as error:
        if loading is None:
            return replace(one, cycle_problem=str(error))
        raise


def cycles_in(angle: Array, force: Array, side: float, where: str) -> list[Cycle]:
    """Cycles of a frame of ``side`` [mm], by its shear angle [deg] and crosshead force [N] at all rows, (n,) each."""
    turns = _turn_rows(angle)
    _check_closed_cycles(angle, force, turns, where)
    rows = []
    for start, end in pairwise(turns):  # what goes beyond all before
        way = angle[start : end + 1] * np.sign(angle[end] - angle[start])
        rows.append(start + np.flatnonzero(np.append(True, way[1:] > np.maximum.accumulate(way)[:-1])))
    onward = np.concatenate(rows)
    curve = {
        "frame_shear_angle_deg": angle[onward], "shear_force_n": force[onward], "time_ms": onward.astype(float),
        "displacement_mm": np.array([trellis.crosshead(a, side) for a in np.deg2rad(angle[onward])]),
    }  # fmt: skip
    found = cycles_of(curve, (len(turns) - 1) // 2)
    worst = min(found, key=lambda one: one.loss)
    if not worst.work > 0.0 or worst.loss < -GIVEN_BACK_SHARE * worst.work:
        raise InputError(
            f"{where}: cycle {found.index(worst) + 1} takes {worst.work:.4g} mJ and returns "
            f"{worst.work - worst.loss:.4g} mJ, expected less: check the sign of the force and the subtracted force of "
            "the empty frame"
        )
    back = slice(turns[1], turns[2] + 1)
    return [replace(found[0], residual=force_free_angle(angle[back], force[back])), *found[1:]]


def force_free_angle(angle: Array, force: Array) -> float:
    """Angle [deg] of unloading where the ``force`` is gone, between means over :data:`UNLOADING_STEP`, or nan."""
    step = np.floor((angle.max() - angle) / UNLOADING_STEP).astype(int)
    count = np.bincount(step)
    at, pull = (np.bincount(step, values)[count > 0] / count[count > 0] for values in (angle, force))
    gone = np.flatnonzero(pull <= 0.0)
    if not len(gone):
        return float("nan")
    k = int(gone[0])
    return float(np.interp(0.0, pull[[k, k - 1]], at[[k, k - 1]])) if k else float(at[0])


def _turn_rows(angle: Array) -> list[int]:
    """Rows of the start, of all turns, and of the end."""
    least = TURN_SHARE * float(angle.max())
    found, last, sign = [0], 0, 1.0
    for row, value in enumerate(angle):
        ahead = sign * (value - angle[last])
        if ahead > 0.0:
            last = row
        elif -ahead > least:
            found.append(last)
            last, sign = row, -sign
    return [*found, last]


def _check_closed_cycles(angle: Array, force: Array, turns: list[int], where: str) -> None:
    """Raise :class:`InputError` unless every loading from 0 to one angle has its unloading to 0."""
    tops, bottoms = turns[1::2], turns[2::2]
    if abs(angle[0]) > shear.SQUARE:
        raise InputError(f"{where}: cycles start at {angle[0]:.3g} deg; expected 0 deg, within {shear.SQUARE:g}")
    for number, (top, bottom) in enumerate(zip(tops, bottoms, strict=False), 1):
        if abs(angle[bottom]) > shear.SQUARE:
            raise InputError(
                f"{where}: cycle {number} returns to {angle[bottom]:.3g} deg, with {force[bottom]:.3g} N; expected "
                f"0 deg, within {shear.SQUARE:g}, where cycles of a run end"
            )
        if abs(angle[top] - angle[tops[0]]) > SAME_TURN * angle[tops[0]]:
            raise InputError(
                f"{where}: cycle {number} turns at {angle[top]:.4g} deg, the first at {angle[tops[0]]:.4g} deg; "
                "expected the same angle, as rig.max_angle of a run"
            )
    if len(bottoms) < len(tops):
        raise InputError(
            f"{where}: {f'loading {len(tops)}' if bottoms else 'the frame'} does not return from "
            f"{angle[tops[-1]]:.4g} deg; expected unloading to 0 deg after each loading"
        )


def _cycle_rows(
    frames: Sequence[FrameSpecimen], fabric: float
) -> tuple[dict[str, Array], list[tuple[Condition, float]]]:
    """Rows of cycles, for a square of ``fabric`` [mm] with whose area work grows, and conditions; none without."""
    first = next((s for s in frames if s.cycles), None)
    if first is None:
        return {}, []
    alone = "use --loading first for the first loading alone, or import them separately"
    for s in frames:
        if len(s.cycles) != len(first.cycles):
            reason = f" ({s.cycle_problem})" if s.cycle_problem else ""
            others = f"specimen {first.name} has {len(first.cycles)}"
            raise InputError(f"{s.place}: {len(s.cycles)} cycles{reason}, {others}: {alone}")
        if abs(s.turn - first.turn) > SAME_TURN * first.turn:
            others = f"those of specimen {first.name} at {first.turn:.4g} deg"
            raise InputError(f"{s.place}: cycles turn at {s.turn:.4g} deg, {others}: {alone}")
    area, each = np.array([(fabric / s.fabric_side) ** 2 for s in frames]), [s.cycles[0] for s in frames]
    work, loss, share, residual = np.array([[one.work, one.loss, one.share, one.residual] for one in each]).T
    rows = {WORK: area * work, LOSS: area * loss, SHARE: share}
    rows |= {RESIDUAL: residual} if np.isfinite(residual).all() else {}
    if len(first.cycles) > 1:
        rows[LAST] = np.array([s.cycles[-1].share for s in frames])
    return rows, [(CYCLES, float(len(first.cycles))), (CYCLE_ANGLE, float(np.mean([s.turn for s in frames])))]


def _cycle_lines(frames: Sequence[FrameSpecimen], rows: Mapping[str, Array]) -> list[str]:
    """Largest angle of each specimen, what is left out, and a table of the ``rows`` of cycles."""
    lines = []
    for one in frames:
        reason = f"; no cycle: {one.cycle_problem.rpartition(f'specimen {one.name}: ')[2]}" if one.cycle_problem else ""
        left = f", then unloads: first loading only{reason}" if one.turned and not one.cycles else ""
        lines.append(f"{one.name}: up to {one.angle[-1]:.3g} deg{left}")
    if rows:
        lines += table_lines([s.name for s in frames], [(HEADS[name], ".4g", v) for name, v in rows.items()])
    if rows and RESIDUAL not in rows:
        lines.append("no residual angle: in a specimen the force does not vanish on unloading")
    return lines


def _results(frames: Sequence[FrameSpecimen]) -> Results:
    """Crosshead forces [N] and normalised forces [N/mm] at angles, rows of cycles, and a law for ``macro.shear``."""
    side = common_value(FRAME_SIDE, [s.frame_side for s in frames], frames)
    fabric = common_value(FABRIC_SIDE, [s.fabric_side for s in frames], frames)
    normalised, digests = shear.shear_forces(frames)
    forces = {a: trellis.crosshead_of_normalised(v, np.deg2rad(a), fabric, side) for a, v in normalised.items()}
    rows, conditions = _cycle_rows(frames, fabric)
    curves = shear.shear_curves(frames, "shear angle")
    law: dict[str, Array] = dict(zip((ANGLE, CONJUGATE), shear_law(curves.band), strict=True))
    remark = "forces must be those of the fabric alone: subtract the force of the empty frame before"
    found, units = shear.shear_rows(frames, {NORMALISED: normalised, "shear_force_n": forces}, rows)
    return Results(
        found, units | UNITS, [(FRAME_SIDE, side), (FABRIC_SIDE, fabric), *conditions],
        ("frame", f"of {side:g} mm, fabric of {fabric:g} mm"), digests,
        [(f"{a:g} deg [N]", ".4g", values) for a, values in forces.items()], [*_cycle_lines(frames, rows), remark],
        replace(curves, more={SHEAR: (law, [LAW])}),
    )  # fmt: skip


def shear_law(band: Corridor) -> tuple[Array, Array]:
    """Law of the mean: angles [deg] and conjugate force S [N/mm], (n,), from (0, 0), by isotonic regression."""
    from scipy.optimize import isotonic_regression

    angle = band.strain
    conjugate = trellis.to_conjugate(band.mean, np.deg2rad(angle), "normalised")
    edges = np.arange(np.ceil(angle[0] / STEP), np.floor(angle[-1] / STEP)) * STEP
    samples = np.linspace(0.0, STEP, 21)
    means = [float(np.interp(edge + samples, angle, conjugate).mean()) for edge in edges]
    middle = np.append(edges + 0.5 * STEP, angle[-1])
    level = isotonic_regression(np.maximum(np.append(means, conjugate[-1]), 0.0)).x
    return np.append(0.0, middle), np.append(0.0, level)


def _fabric(tests: Tests, place: Path) -> dict[str, Any]:
    if NAME not in tests:
        return {}
    test, curve = tests[NAME], (place / NAME / SHEAR).as_posix()
    side, fabric = (test["conditions"][what.key] for what in (FRAME_SIDE, FABRIC_SIDE))
    count = next(found["n"] for name, found in test.items() if name.startswith("shear_force_n_at_deg"))
    ref = f"{count_text(count, 'picture frame')} of {side:g} mm, fabric of {fabric:g} mm"
    return {"macro": {"shear": {"kind": "table", "curve": curve, "source": "measured", "ref": ref}}}


def _rig(test: dict[str, Any]) -> dict[str, float]:
    side, fabric = (test["conditions"][what.key] for what in (FRAME_SIDE, FABRIC_SIDE))
    return {"side": fabric, "frame_side": max(side, fabric), **shear.max_angle_field(test)}


LAB = LabTest(
    NAME,
    make_reader(
        [("force",), ("angle", "travel", "extensometer")], "a force and a shear angle or a displacement",
        _read_specimen,
        own=("cyclic",),
    ),
    _results, (FRAME_SIDE, FABRIC_SIDE), ("sign", "zero", "preload", "loading"), _rig, _fabric,
)  # fmt: skip
