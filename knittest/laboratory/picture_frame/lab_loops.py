"""Rows that cycles of picture frames yield: those of a run, of one series."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import CYCLE_ANGLE, CYCLES, Condition
from knittest.experiment.lab_results import table_lines
from knittest.laboratory.picture_frame.lab_curves import Sheared
from knittest.laboratory.picture_frame.lab_cycles import SAME_TURN

Array = NDArray[np.float64]

WORK, LOSS, SHARE = "cycle_work_mj", "cycle_loss_mj", "cycle_loss_share_pct"
RESIDUAL, LAST = "cycle_residual_angle_deg", "last_cycle_loss_share_pct"
UNITS = {WORK: "mJ", LOSS: "mJ", SHARE: "%", RESIDUAL: "deg", LAST: "%"}
ROWS_OF_A_RUN = tuple(UNITS)
HEADS = {WORK: "work [mJ]", LOSS: "loss [mJ]", SHARE: "loss [%]", RESIDUAL: "gone at [deg]", LAST: "last loss [%]"}


@dataclass(frozen=True)
class Loops:
    """Values (n,) of each row of cycles, and the conditions that they hang on; none of frames without cycles."""

    rows: dict[str, Array] = field(default_factory=dict)
    conditions: Sequence[tuple[Condition, float]] = ()


def loops(specimens: Sequence[Sheared], fabric: float) -> Loops:
    """Rows of ``specimens``, their work for a square of side ``fabric`` [mm], with whose area it grows.

    The residual angle is no row where one of them has none. Raises :class:`InputError` for specimens without cycles,
    with more of them, or with others than the first, unless none has any.
    """
    if not any(s.cycles for s in specimens):
        return Loops()
    first = next(s for s in specimens if s.cycles)
    for s in specimens:
        _refuse_other(s, first)
    area = np.array([(fabric / s.fabric_side) ** 2 for s in specimens])
    rows = {
        WORK: area * np.array([s.cycles[0].work for s in specimens]),
        LOSS: area * np.array([s.cycles[0].loss for s in specimens]),
        SHARE: np.array([s.cycles[0].share for s in specimens]),
        RESIDUAL: np.array([s.cycles[0].residual for s in specimens]),
    }
    if not np.isfinite(rows[RESIDUAL]).all():
        del rows[RESIDUAL]
    if len(first.cycles) > 1:
        rows[LAST] = np.array([s.cycles[-1].share for s in specimens])
    turn = float(np.mean([s.turn for s in specimens]))
    return Loops(rows, ((CYCLES, float(len(first.cycles))), (CYCLE_ANGLE, turn)))


def _refuse_other(one: Sheared, first: Sheared) -> None:
    """Raise :class:`InputError` where ``one`` has not the cycles of the ``first``."""
    alone = "give --loading first for the first loading alone, or import them apart"
    counts = len(one.cycles), len(first.cycles)
    if counts[0] != counts[1]:
        reason = f" ({one.not_cycled})" if one.not_cycled else ""
        raise InputError(
            f"{one.path}: specimen {one.name}: {counts[0]} cycles{reason}, specimen {first.name} has {counts[1]}: "
            f"{alone}"
        )
    if abs(one.turn - first.turn) > SAME_TURN * first.turn:
        raise InputError(
            f"{one.path}: specimen {one.name}: cycles turn at {one.turn:.4g} deg, those of specimen {first.name} at "
            f"{first.turn:.4g} deg: {alone}"
        )


def loop_lines(specimens: Sequence[Sheared], found: Loops) -> list[str]:
    """Table of the cycles with mean and sd, and what of each specimen is left out."""
    lines = [_told(s) for s in specimens]
    if not found.rows:
        return lines
    lines += table_lines([s.name for s in specimens], [(HEADS[name], ".4g", v) for name, v in found.rows.items()])
    if RESIDUAL not in found.rows:
        lines.append("no angle at which the force is gone: it stays on the way back of a specimen")
    return lines


def _told(one: Sheared) -> str:
    """Words for the angle that ``one`` is sheared to, and for what counts of what follows."""
    reached = f"{one.name}: up to {one.angle[-1]:.3g} deg"
    if one.cycles or not one.turned:
        return reached
    reason = f"; no cycle: {one.not_cycled.rpartition(f'specimen {one.name}: ')[2]}" if one.not_cycled else ""
    return f"{reached}, turns there: first loading alone{reason}"
