"""Reads picture-frame exports of testing machines: crosshead force over shear angle or crosshead displacement."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment import lab_units
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE, SAME, agreed, stated, unstated
from knittest.experiment.lab_given import Given, Loading
from knittest.experiment.lab_shear import ShearCurve, Tested, pairs, shear_curve, specimens_in
from knittest.experiment.lab_table import read_table
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
class Sheared:
    """Shear angle [deg], rising, and crosshead force [N] of one specimen on its first loading, (n,) each.

    ``turned`` says that more follows: whole ``cycles``, which turn at ``turn`` [deg], or for what reason there are none
    (``not_cycled``). Sides in mm; ``unit`` is that of the file's forces.
    """

    name: str
    angle: Array
    force: Array
    frame_side: float
    fabric_side: float
    path: Path
    turned: bool
    unit: str = "N"
    cycles: Sequence[Cycle] = ()
    turn: float = float("nan")
    not_cycled: str = ""

    @property
    def normalised(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        found: Array = normalised_force(self.force, np.deg2rad(self.angle), self.fabric_side, self.frame_side)
        return found


def read_frames(path: Path, given: Given) -> list[Sheared]:
    """Specimens in one export, told apart by repeated pairs of columns.

    A shear angle [deg or rad] counts before a displacement of the crosshead, which becomes one by the frame's side.
    Raises :class:`InputError` where the sides are not known, for units, text and gaps as
    :func:`knittest.experiment.lab_csv.read_lab`, for a start that is not square or not free of force, and for cycles
    that are asked for and not there.
    """
    table = read_table(
        path, lambda cells: bool(pairs(cells)), "a force and a shear angle or a displacement", given.decimal,
        given.delimiter,
    )  # fmt: skip
    sides = [
        agreed(side, given.sizes.get(side.key), stated(side, path, table.head, table.mark))
        for side in (FRAME_SIDE, FABRIC_SIDE)
    ]
    frame, fabric = sides
    if frame is None or fabric is None:
        raise unstated([w for w, value in zip((FRAME_SIDE, FABRIC_SIDE), sides, strict=True) if value is None], path)
    if fabric > frame * (1.0 + SAME):
        raise InputError(f"{path}: a fabric side of {fabric:g} mm in a frame of {frame:g} mm: which is which?")
    tested = Tested("picture-frame", Frame(frame), f"a frame of {frame:g} mm", "the frame square", FRAME_SIDE.option)
    found_pairs = specimens_in(table)
    found = []
    for number, pair in enumerate(found_pairs, 1):
        name = path.stem if len(found_pairs) == 1 else f"{path.stem}-{number}"
        curve = shear_curve(table, name, pair, tested, given)
        unit = lab_units.force_unit(table.names[pair[1]], table.units[pair[1]], table.where)
        one = Sheared(name, curve.angle, curve.force, frame, fabric, path, curve.turned, unit)
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
