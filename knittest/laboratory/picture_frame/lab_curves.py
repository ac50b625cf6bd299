"""Reads picture-frame exports of testing machines: crosshead force over shear angle or crosshead displacement."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment import lab_units
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE, SAME, agreed, stated, unstated
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_shear import Tested, pairs, shear_curve, specimens_in
from knittest.experiment.lab_table import read_table
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

    ``turned`` says that more loading follows, which is left out. Sides in mm; ``unit`` is that of the file's forces.
    """

    name: str
    angle: Array
    force: Array
    frame_side: float
    fabric_side: float
    path: Path
    turned: bool
    unit: str = "N"

    @property
    def normalised(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        found: Array = normalised_force(self.force, np.deg2rad(self.angle), self.fabric_side, self.frame_side)
        return found


def read_frames(path: Path, given: Given) -> list[Sheared]:
    """Specimens in one export, told apart by repeated pairs of columns.

    A shear angle [deg or rad] counts before a displacement of the crosshead, which becomes one by the frame's side.
    Raises :class:`InputError` where the sides are not known, for units, text and gaps as
    :func:`knittest.experiment.lab_csv.read_lab`, and for a start that is not square or not free of force.
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
        angle, force, turned = shear_curve(table, name, pair, tested, given)
        unit = lab_units.force_unit(table.names[pair[1]], table.units[pair[1]], table.where)
        found.append(Sheared(name, angle, force, frame, fabric, path, turned, unit))
    return found
