"""Cycles in exports of picture frames: how many there are, and what each takes, as of a run.

A run's cycle begins and ends square, at a shear angle of zero, and all of its cycles turn at one angle: loops that come
back less far, or turn elsewhere, enclose another area.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_shear import SQUARE
from knittest.laboratory.picture_frame.cycles import Cycle, cycles_of
from knittest.materials.trellis import crosshead

Array = NDArray[np.float64]

#: way back, as a share of the largest angle, from which on a frame has turned
TURNED = 0.1
#: difference of two angles at which cycles turn, as a share, that does not matter: twice as much work
SAME_TURN = 0.01
#: step [deg] over which the force is averaged where it is gone
STEP = 0.25
#: share of its work by which a loop may give back more than it took: rounding, noise
GIVEN_BACK = 0.01


def cycles_in(angle: Array, force: Array, side: float, where: str) -> list[Cycle]:
    """All cycles of a frame of ``side`` [mm], by its shear angle [deg] and crosshead force [N] at all rows, (n,) each.

    Raises :class:`InputError` for a frame that does not come back, or not to square, for cycles that turn at different
    angles, and for loops that give back more than they took.
    """
    turns = _turns(angle)
    _refuse_open(angle, force, turns, where)
    rows = np.concatenate([_onward(angle, start, end) for start, end in pairwise(turns)])
    way, pull = angle[rows], force[rows]
    curve = {
        "frame_shear_angle_deg": way, "shear_force_n": pull, "time_ms": rows.astype(float),
        "displacement_mm": np.array([crosshead(a, side) for a in np.deg2rad(way)]),
    }  # fmt: skip
    found = cycles_of(curve, (len(turns) - 1) // 2)
    worst = min(found, key=lambda one: one.loss)
    if not worst.work > 0.0 or worst.loss < -GIVEN_BACK * worst.work:
        raise InputError(
            f"{where}: cycle {found.index(worst) + 1} takes {worst.work:.4g} mJ and gives back "
            f"{worst.work - worst.loss:.4g} mJ: expected less: check the sign of the force and what of the empty frame "
            "was subtracted"
        )
    back = slice(turns[1], turns[2] + 1)
    return [replace(found[0], residual=gone_at(angle[back], force[back])), *found[1:]]


def turn_of(angle: Array) -> float:
    """Mean angle [deg] at which the cycles of ``angle`` (n,) turn."""
    return float(angle[_turns(angle)[1::2]].mean())


def gone_at(angle: Array, force: Array) -> float:
    """Angle [deg] on a way back at which the ``force`` is gone, on lines between means over :data:`STEP`; nan where it
    stays.
    """
    step = np.floor((angle.max() - angle) / STEP).astype(int)
    count = np.bincount(step)
    at, pull = (np.bincount(step, values)[count > 0] / count[count > 0] for values in (angle, force))
    gone = np.flatnonzero(pull <= 0.0)
    if not len(gone):
        return float("nan")
    k = int(gone[0])
    return float(np.interp(0.0, pull[[k, k - 1]], at[[k, k - 1]])) if k else float(at[0])


def _turns(angle: Array) -> list[int]:
    """Rows of the start, of all turns and of the last way's end."""
    least = TURNED * float(angle.max())
    found, last, sign = [0], 0, 1.0
    for row, value in enumerate(angle):
        ahead = sign * (value - angle[last])
        if ahead > 0.0:
            last = row
        elif -ahead > least:
            found.append(last)
            last, sign = row, -sign
    return [*found, last]


def _onward(angle: Array, start: int, end: int) -> NDArray[np.intp]:
    """Rows of the way from ``start`` to ``end`` that go beyond all before."""
    way = angle[start : end + 1] * np.sign(angle[end] - angle[start])
    return start + np.flatnonzero(np.append(True, way[1:] > np.maximum.accumulate(way)[:-1]))


def _refuse_open(angle: Array, force: Array, turns: list[int], where: str) -> None:
    """Raise :class:`InputError` unless every way up from square to one angle has its way back to square."""
    tops, bottoms = turns[1::2], turns[2::2]
    if abs(angle[0]) > SQUARE:
        raise InputError(f"{where}: cycles start at {angle[0]:.3g} deg: expected 0 deg, within {SQUARE:g}")
    for number, (top, bottom) in enumerate(zip(tops, bottoms, strict=False), 1):
        if abs(angle[bottom]) > SQUARE:
            raise InputError(
                f"{where}: cycle {number} comes back to {angle[bottom]:.3g} deg, with {force[bottom]:.3g} N: expected "
                f"a way back to 0 deg, within {SQUARE:g}, where cycles of a run end"
            )
        if abs(angle[top] - angle[tops[0]]) > SAME_TURN * angle[tops[0]]:
            raise InputError(
                f"{where}: cycle {number} turns at {angle[top]:.4g} deg, the first at {angle[tops[0]]:.4g} deg: "
                "expected the same angle, rig.max_angle of a run"
            )
    if len(bottoms) < len(tops):
        raise InputError(
            f"{where}: {'the frame does not' if not bottoms else f'loading {len(tops)} does not'} come back from "
            f"{angle[tops[-1]]:.4g} deg: expected a way back to 0 deg after each loading"
        )
