"""Reads picture-frame exports of testing machines: crosshead force over shear angle or crosshead displacement."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.experiment import lab_units
from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE, SAME, agreed, stated, unstated
from knittest.experiment.lab_csv import FORCE
from knittest.experiment.lab_given import Given, first_loading, tared
from knittest.experiment.lab_numbers import NUMBER
from knittest.experiment.lab_sign import drawn, pulled
from knittest.experiment.lab_table import LabTable, columns, read_table
from knittest.laboratory.picture_frame.config import PictureFrameRig
from knittest.materials.trellis import frame_angle, normalised_force

Array = NDArray[np.float64]

ANGLE = re.compile(r"angle|winkel|gamma", re.I)
TRAVEL = re.compile(r"displacement|travel|weg|crosshead|traverse|extension", re.I)
#: shear angle [deg] within which a frame starts square
SQUARE = 0.5
#: a test that ends below is in rad, in other units, or none
LEAST = 3.0


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
        path, lambda cells: bool(_pairs(cells)), "a force and a shear angle or a displacement", given.decimal,
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
    pairs = _pairs(table.names)
    found = []
    for number, pair in enumerate(pairs, 1):
        name = path.stem if len(pairs) == 1 else f"{path.stem}-{number}"
        angle, force, turned = _curve(table, name, pair, frame, given)
        unit = lab_units.force_unit(table.names[pair[1]], table.units[pair[1]], table.where)
        found.append(Sheared(name, angle, force, frame, fabric, path, turned, unit))
    return found


def _pairs(cells: list[str]) -> list[tuple[int, int]]:
    """Columns of (angle or travel, force), each force with the nearest of the other before it, else after it."""
    words = [(k, cell) for k, cell in enumerate(cells) if not NUMBER.match(cell)]
    forces = [k for k, cell in words if FORCE.search(cell) and not ANGLE.search(cell)]
    moves = [k for k, cell in words if ANGLE.search(cell)]
    moves = moves or [k for k, cell in words if TRAVEL.search(cell) and k not in forces]
    if not forces or not moves:
        return []
    return [(max([m for m in moves if m < f] or [min(moves)]), f) for f in forces]


def _curve(
    table: LabTable, name: str, pair: tuple[int, int], frame: float, given: Given
) -> tuple[Array, Array, bool]:  # fmt: skip
    """Shear angle [deg] and force [N] of the first loading in the columns ``pair``, and whether it turns."""
    where = f"{table.path}: specimen {name}"
    _, values = columns(table, pair, name)
    move, pull = pair
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        force = values[:, 1] * lab_units.FORCE[lab_units.force_unit(table.names[pull], table.units[pull], table.where)]
    if not np.isfinite(force).all():
        raise InputError(f"{where}: no finite force")
    moved = drawn(values[:, 0], given.sign)
    rows, turned = first_loading(moved)
    moved, force = moved[rows], pulled(force[rows], given.sign, where)
    angle = _angles(moved - (given.zero or 0.0), table, move, frame, where)
    if given.zero is None and abs(angle[0]) > SQUARE:
        raise InputError(
            f"{where}: starts at {moved[0]:g}, a shear angle of {angle[0]:.3g} deg: where is the frame square? "
            f"Give --zero, in the unit of the column: {moved[0]:g} if at the start, 0 if the numbers are right"
        )
    if angle[0] <= SQUARE:
        force = tared(force, given.preload, where)
    _check_end(angle, where)
    sheared = angle >= 0.0
    return angle[sheared], force[sheared], turned


def _angles(moved: Array, table: LabTable, column: int, frame: float, where: str) -> Array:
    """Shear angle [deg], (n,), of the numbers in ``column``."""
    name, below = table.names[column], table.units[column]
    if ANGLE.search(name):
        unit = lab_units.stated(name, below, lab_units.ANGLE, table.where)
        if not unit:
            raise InputError(
                f"{table.where}: column {name!r}: an angle without a unit: write '{name} [deg]' or '[rad]'"
            )
        return moved * lab_units.ANGLE[unit]
    factor = lab_units.LENGTH[lab_units.stated(name, below, lab_units.LENGTH, table.where) or "mm"]
    with np.errstate(over="ignore"):
        travel = moved * factor
    most = float(np.abs(travel).max())
    if not most < (2.0 - 2.0**0.5) * frame:
        raise InputError(
            f"{where}: a displacement of {most:g} mm, where a frame of {frame:g} mm is drawn out by "
            f"{(2.0 - 2.0**0.5) * frame:.4g} mm at most: check the unit, --frame-side and --zero"
        )
    return np.rad2deg([frame_angle(float(d), frame) for d in travel])


def _check_end(angle: Array, where: str) -> None:
    """Raise :class:`InputError` for a first loading too short, or that no frame can go."""
    end = float(angle[-1])
    try:
        check_bounds(end, field_meta(PictureFrameRig, "max_angle"))
    except BoundsError as error:
        raise InputError(
            f"{where}: a shear angle of {end:.4g} deg: {error.expected}: check its unit and zero"
        ) from None
    if len(angle) < 3 or end < LEAST:
        looks = f" (it looks like rad: {np.rad2deg(end):.4g} deg)" if 0.1 < end < 1.4 else ""
        raise InputError(
            f"{where}: the first loading has {len(angle)} rows up to {end:.3g} deg{looks}: expected at least 3, up to "
            f"{LEAST:g} deg"
        )
