"""Curves of shear in exports of testing machines: a force over a shear angle, or over a travel that makes one."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.run import rig_model
from knittest.experiment import lab_names
from knittest.experiment.lab_given import Given, drawn, first_loading, pulled, tared
from knittest.experiment.lab_recording import Recording, unit_of

Array = NDArray[np.float64]

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
    of zero, and ``options`` state its size. A strain is the travel over its ``length`` [mm].
    """

    test: str
    kinematics: Kinematics
    words: str
    square: str
    options: str
    length: float | None = None


@dataclass(frozen=True)
class ShearCurve:
    """Shear angle [deg], rising, and force [N] of the first loading, (n,) each; whether it turns after it, and both of
    all rows as ``whole``.
    """

    angle: Array
    force: Array
    turned: bool
    whole: tuple[Array, Array]


def shear_curve(r: Recording, tested: Tested, given: Given) -> ShearCurve:
    """The curve of a recording; raises :class:`InputError` for a start that is not square or free of force, and for a
    force along the sides, F_s = F / (2 cos(45 deg - angle / 2)).
    """
    if lab_names.is_kind("along_sides", r.title("force")):
        raise InputError(
            f"{r.table.where}: column {r.title('force')!r}: a force along the sides, F_s? Expected the F of the "
            "crosshead, 2 F_s cos(45 deg - angle / 2): leave the column out or convert it; name it 'force' if it is "
            "that"
        )
    role = next(role for role in ("angle", "travel", "strain", "extensometer") if role in r.values)
    if role == "strain" and tested.length is None:
        raise InputError(f"{r.table.where}: column {r.title(role)!r}: a strain: expected a travel or an angle")
    if role != "angle" and lab_names.is_kind("sensor", r.title(role)):
        raise InputError(
            f"{r.table.where}: column {r.title(role)!r}: an extensometer sees a part of the specimen alone: expected "
            "the travel of the clamp"
        )
    moved, force = drawn(r.values[role], given.sign), r.values["force"]
    rows, turned = first_loading(moved)
    first = pulled(force[rows], given.sign, r.where)  # on its way back a specimen may be pushed
    force = -force if given.sign == "negative" else force
    _, factor = unit_of(r.table, r.columns[role])
    angle = _angles(moved - (given.zero or 0.0) * factor, role, tested, r.where)
    if given.zero is None and abs(angle[0]) > SQUARE:
        raise InputError(
            f"{r.where}: starts at {moved[0] / factor:g}, a shear angle of {angle[0]:.3g} deg: where is "
            f"{tested.square}? Give --zero, in the unit of the column: {moved[0] / factor:g} if at the start, 0 if the "
            "numbers are right"
        )
    if angle[0] <= SQUARE:
        free = tared(first, given.preload, r.where)
        first, force = free, force - (first[0] - free[0])
    _check_end(angle[rows], tested.test, r.where)
    sheared = angle[rows] >= 0.0
    return ShearCurve(angle[rows][sheared], first[sheared], turned, (angle, force))


def _angles(moved: Array, role: str, tested: Tested, where: str) -> Array:
    """Shear angle [deg], (n,), of an angle [deg], a travel [mm] or a strain [%]."""
    if role == "angle":
        return moved
    travel = moved * (tested.length or 0.0) / 100.0 if role == "strain" else moved
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
