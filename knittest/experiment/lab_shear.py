"""Curves of shear in exports of testing machines: a force over a shear angle, or over a travel that makes one."""

import re
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.run import rig_model
from knittest.experiment import lab_units
from knittest.experiment.lab_csv import FORCE
from knittest.experiment.lab_given import Given, first_loading, tared
from knittest.experiment.lab_numbers import NUMBER
from knittest.experiment.lab_sign import drawn, pulled
from knittest.experiment.lab_table import LabTable, columns, refuse_shared, with_nearest

Array = NDArray[np.float64]

ANGLE = re.compile(r"angle|winkel|gamma", re.I)
TRAVEL = re.compile(r"displacement|travel|weg|crosshead|traverse|extension", re.I)
#: force along the sides of a frame, F_s = F / (2 cos(45 deg - angle / 2)), where that of the crosshead is expected
ALONG_SIDES = re.compile(r"shear|scher|schub|(?<![a-z])side|seiten", re.I)
#: shear angle [deg] within which a specimen starts square
SQUARE = 0.5
#: a test that ends below is in rad, in other units, or none
LEAST = 3.0


class Kinematics(Protocol):
    """Shear of a specimen by the travel of its clamp."""

    @property
    def longest(self) -> float:
        """Travel [mm] at which its yarns lie side by side."""

    def angle(self, travel: float) -> float:
        """Shear angle [rad] at a travel [mm]."""


@dataclass(frozen=True)
class Tested:
    """Specimen of ``test`` by its ``kinematics``; in messages ``words`` name it, ``square`` is what it is at an angle
    of zero, and ``options`` state its size.
    """

    test: str
    kinematics: Kinematics
    words: str
    square: str
    options: str


@dataclass(frozen=True)
class ShearCurve:
    """Shear angle [deg], rising, and force [N] of the first loading, (n,) each; whether it turns after it, and both of
    all rows as ``whole``.
    """

    angle: Array
    force: Array
    turned: bool
    whole: tuple[Array, Array]


def pairs(cells: list[str], angles: bool = True) -> list[tuple[int, int]]:
    """Columns of (angle or travel, force), each force with the nearest of the other before it, else after it.

    A column of ``angles`` counts before one of travels, or not at all.
    """
    words = [(k, cell) for k, cell in enumerate(cells) if not NUMBER.match(cell)]
    forces = [k for k, cell in words if FORCE.search(cell) and not ANGLE.search(cell)]
    moves = [k for k, cell in words if angles and ANGLE.search(cell)]
    moves = moves or [k for k, cell in words if TRAVEL.search(cell) and k not in forces]
    return with_nearest(moves, forces)


def specimens_in(table: LabTable, angles: bool = True) -> list[tuple[int, int]]:
    """:func:`pairs` of ``table``, one a specimen; raises :class:`InputError` for two over one travel, and for a force
    along the sides.
    """
    found = pairs(table.names, angles)
    for _, force in found:
        if ALONG_SIDES.search(table.names[force]):
            raise InputError(
                f"{table.where}: column {table.names[force]!r}: a force along the sides, F_s? Expected the F of the "
                "crosshead, 2 F_s cos(45 deg - angle / 2): leave the column out or convert it; name it 'force' if it "
                "is that"
            )
    refuse_shared(table, found)
    return found


def shear_curve(table: LabTable, name: str, pair: tuple[int, int], tested: Tested, given: Given) -> ShearCurve:
    """The curve in the columns ``pair``; raises :class:`InputError` for a start that is not square or free of force."""
    where = f"{table.path}: specimen {name}"
    _, values = columns(table, pair, name)
    move, pull = pair
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        force = values[:, 1] * lab_units.FORCE[lab_units.force_unit(table.names[pull], table.units[pull], table.where)]
    if not np.isfinite(force).all():
        raise InputError(f"{where}: no finite force")
    moved = drawn(values[:, 0], given.sign)
    rows, turned = first_loading(moved)
    first = pulled(force[rows], given.sign, where)  # on its way back a specimen may be pushed
    force = -force if given.sign == "negative" else force
    angle = _angles(moved - (given.zero or 0.0), table, move, tested, where)
    if given.zero is None and abs(angle[0]) > SQUARE:
        raise InputError(
            f"{where}: starts at {moved[0]:g}, a shear angle of {angle[0]:.3g} deg: where is {tested.square}? "
            f"Give --zero, in the unit of the column: {moved[0]:g} if at the start, 0 if the numbers are right"
        )
    if angle[0] <= SQUARE:
        free = tared(first, given.preload, where)
        first, force = free, force - (first[0] - free[0])
    _check_end(angle[rows], tested.test, where)
    sheared = angle[rows] >= 0.0
    return ShearCurve(angle[rows][sheared], first[sheared], turned, (angle, force))


def _angles(moved: Array, table: LabTable, column: int, tested: Tested, where: str) -> Array:
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
    if not most < tested.kinematics.longest:
        raise InputError(
            f"{where}: a displacement of {most:g} mm, where {tested.words} is drawn out by "
            f"{tested.kinematics.longest:.4g} mm at most: check the unit, {tested.options} and --zero"
        )
    return np.rad2deg([tested.kinematics.angle(float(d)) for d in travel])


def _check_end(angle: Array, test: str, where: str) -> None:
    """Raise :class:`InputError` for a first loading too short, or that no frame can go."""
    end = float(angle[-1])
    try:
        check_bounds(end, field_meta(rig_model(test), "max_angle"))
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
