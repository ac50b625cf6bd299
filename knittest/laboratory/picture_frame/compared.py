"""Rows of a laboratory's cycles beside those of a run."""

import math
from dataclasses import replace

from knittest.experiment.conditions import EXACT
from knittest.experiment.tables import PublishedValue, with_note
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.lab_files import LAST, LOSS, ROWS_OF_A_RUN, SAME_TURN, WORK


def other_cycles(run: PictureFrameRun, row: PublishedValue) -> str:
    """Reason why ``row`` is of other cycles than those of ``run``; empty if it is not, or where either has none."""
    rig, count, turn = run.rig, row.conditions.cycles, row.conditions.cycle_angle_deg
    if row.quantity not in ROWS_OF_A_RUN or not rig.cycles:
        return ""
    if count is None or turn is None:
        return "cycles of an unknown number and angle: expected rows cycles and cycle_angle_deg of the same variant"
    if not math.isclose(turn, rig.max_angle, rel_tol=SAME_TURN):
        return (
            f"cycles up to {turn:.4g} deg, the run's go to {rig.max_angle:g}: --set rig.max_angle={turn:.4g} makes "
            "them comparable"
        )
    if row.quantity == LAST and 1 < rig.cycles != count:
        return f"the last of {count:g} cycles, the run has {rig.cycles}: --set rig.cycles={count:g} makes it comparable"
    return ""


def for_cycles(run: PictureFrameRun, row: PublishedValue) -> PublishedValue:
    """``row`` for the square of ``run``, with whose area its work grows; says so, and of how many cycles it is the
    first where the run has another number.
    """
    side = run.rig.side_mm
    count, own = row.conditions.cycles, row.conditions.fabric_side_mm
    notes = [f"the first of {count:g}"] if run.rig.cycles and count is not None and count != run.rig.cycles else []
    if row.quantity in (WORK, LOSS) and own is not None and not math.isclose(own, side, rel_tol=EXACT):
        factor = (side / own) ** 2
        row = replace(row, mean=row.mean * factor, sd=row.sd * factor)
        notes.append(f"for a square of {side:.4g} instead of {own:g} mm")
    return with_note(row, ", ".join(notes))
