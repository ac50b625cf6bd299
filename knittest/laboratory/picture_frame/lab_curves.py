"""Reads picture-frame exports of testing machines: crosshead force over shear angle or crosshead displacement."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE, SAME
from knittest.experiment.lab_given import Given, Loading
from knittest.experiment.lab_recording import Origin, of, recordings
from knittest.experiment.lab_shear import ShearCurve, Tested, shear_curve
from knittest.laboratory.picture_frame.cycles import Cycle
from knittest.laboratory.picture_frame.lab_cycles import cycles_in, turn_of
from knittest.materials.trellis import frame_angle, normalised_force

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Frame:
    """Hinged frame of sides of ``side`` [mm]."""

    side: float

    @property
    def longest(self) -> float:
        """Travel [mm] of the crosshead at which its sides lie side by side."""
        return (2.0 - 2.0**0.5) * self.side

    def angle(self, travel: float) -> float:
        """Shear angle [rad] at a travel [mm] of the crosshead."""
        return frame_angle(travel, self.side)


@dataclass(frozen=True)
class Sheared(Origin):
    """Shear angle [deg], rising, and crosshead force [N] of one specimen on its first loading, (n,) each.

    ``turned`` says that more follows: whole ``cycles``, which turn at ``turn`` [deg], or for what reason there are none
    (``not_cycled``). Sides in mm.
    """

    angle: Array
    force: Array
    frame_side: float
    fabric_side: float
    turned: bool
    cycles: Sequence[Cycle] = ()
    turn: float = float("nan")
    not_cycled: str = ""

    @property
    def normalised(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        found: Array = normalised_force(self.force, np.deg2rad(self.angle), self.fabric_side, self.frame_side)
        return found


def read_frames(path: Path, given: Given) -> list[Sheared]:
    """Specimens in one export; a shear angle counts before a displacement, which becomes one by the frame's side.

    Raises :class:`InputError` where the sides are not known, for a start that is not square or not free of force, and
    for cycles that are asked for and not there.
    """
    found = []
    wanted = [("force",), ("angle", "travel", "extensometer")]
    for r in recordings(path, given, wanted, "a force and a shear angle or a displacement", own=("cyclic",)):
        frame, fabric = r.needed([FRAME_SIDE, FABRIC_SIDE], given)
        if fabric > frame * (1.0 + SAME):
            raise InputError(f"{path}: a fabric side of {fabric:g} mm in a frame of {frame:g} mm: which is which?")
        words = f"a frame of {frame:g} mm"
        tested = Tested("picture-frame", Frame(frame), words, "the frame square", FRAME_SIDE.option)
        curve = shear_curve(r, tested, given)
        one = Sheared(
            **of(r), angle=curve.angle, force=curve.force, frame_side=frame, fabric_side=fabric, turned=curve.turned
        )
        found.append(_with_cycles(one, curve, given.loading))
    return found


def _with_cycles(one: Sheared, curve: ShearCurve, loading: Loading | None) -> Sheared:
    """``one`` with the cycles of its ``curve``, unless the first ``loading`` alone is asked for.

    Raises :class:`InputError` where cycles are asked for, and there are none.
    """
    if loading == "first" or (loading is None and not curve.turned):
        return one
    try:
        cycles = cycles_in(*curve.whole, one.frame_side, f"{one.path}: specimen {one.name}")
    except InputError as error:
        if loading is None:
            return replace(one, not_cycled=str(error))
        raise
    return replace(one, cycles=cycles, turn=turn_of(curve.whole[0]))
