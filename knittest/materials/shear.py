"""Shear law of a fabric to the hinges, friction and twisting stiffness of the shells."""

from typing import NamedTuple, Protocol

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.config.fabric import Fabric
from knittest.kernels.laws import hinge_table
from knittest.materials.trellis import ANGLE, DEFINITIONS, Definition, to_conjugate


def thin_curve(x: Array, y: Array, tolerance: float) -> tuple[Array, Array]:
    """Points of y(x), (n,) each, whose chords stay within ``tolerance`` of all (Douglas & Peucker, 1973)."""
    keep = {0, len(x) - 1}
    spans = [(0, len(x) - 1)]
    while spans:
        a, b = spans.pop()
        inside = slice(a + 1, b)
        if b - a < 2:
            continue
        gap = np.abs(y[inside] - np.interp(x[inside], x[[a, b]], y[[a, b]]))
        if gap.max() > tolerance:
            worst = a + 1 + int(gap.argmax())
            keep.add(worst)
            spans += [(a, worst), (worst, b)]
    index = sorted(keep)
    return x[index], y[index]


#: points of a shear curve are dropped while it moves by less than this share of its peak
TOLERANCE = 5e-4
#: a measured curve may fall by this share of its peak from row to row; the law then stays level
NOISE = 5e-3


class ShearCurve(Protocol):
    """A curve ``mean`` over ``x``, (n,) each, in the columns ``y_name`` and ``x_name``."""

    @property
    def x(self) -> Array:
        """Shear angle [deg]."""

    @property
    def mean(self) -> Array:
        """Shear force [N/mm]."""

    @property
    def x_name(self) -> str:
        """Name of the column of ``x``."""

    @property
    def y_name(self) -> str:
        """Name of the column of ``mean``, which says how the force is defined."""


class ShearTable(NamedTuple):
    """Hinges of S(gamma): knee [rad] and slope [N/mm], (n,); share of friction [-] and its sticking stiffness [N/mm];
    stiffness against twisting [N/mm], the smallest secant of S: neither the steep start nor locking.
    """

    knee: Array
    slope: Array
    friction: float
    stick: float
    twisting: float


def shear_table(fabric: Fabric, curve: ShearCurve | None = None) -> ShearTable:
    """Shear law of ``fabric``; ``curve`` is that of its CSV, if it names one.

    Raises :class:`InputError` for a curve of other columns, one that falls, and friction that would slide late.
    """
    law = fabric.macro.shear
    friction = law.friction_share.value
    if law.kind == "linear":
        assert law.stiffness_n_per_mm is not None  # the config refuses a line without
        angle, force = np.array([0.0, 1.0]), np.array([0.0, law.stiffness_n_per_mm])
    else:
        angle, force = _envelope(fabric, curve)
    knee, slope = hinge_table(angle, force)
    steepest = float(np.cumsum(slope).max())
    stick = steepest if law.unloading_stiffness_n_per_mm is None else law.unloading_stiffness_n_per_mm
    if stick < friction * steepest * (1.0 - 1e-9):
        raise InputError(
            f"fabric {fabric.name}, macro.shear.unloading_stiffness = {stick:g} N/mm: the friction would lag behind "
            f"the curve; expected at least friction_share times its steepest tangent, {friction * steepest:.4g} N/mm"
        )
    return ShearTable(knee, slope, friction, stick, float((force[1:] / angle[1:]).min()))


def last_angle(fabric: Fabric, curve: ShearCurve | None = None) -> float:
    """Largest shear angle [deg] that the law of ``fabric`` knows."""
    law = fabric.macro.shear
    if law.kind == "linear":
        return 90.0
    return float(curve.x[-1]) if curve is not None else law.points[-1][0]


def _envelope(fabric: Fabric, curve: ShearCurve | None) -> tuple[Array, Array]:
    """Shear angle [rad] and S [N/mm] from (0, 0), thinned."""
    law = fabric.macro.shear
    definition: Definition
    if curve is None:
        where, definition = f"fabric {fabric.name}, macro.shear.points", law.definition
        degrees, force = (np.array(column) for column in zip(*law.points, strict=True))
    else:
        where = f"fabric {fabric.name}, macro.shear.curve ({law.curve})"
        if curve.x_name != ANGLE or curve.y_name not in DEFINITIONS:
            raise InputError(
                f"{where}: columns {curve.x_name}, {curve.y_name}; expected {ANGLE} and one of {', '.join(DEFINITIONS)}"
            )
        definition = DEFINITIONS[curve.y_name]
        if law.definition not in ("conjugate", definition):
            raise InputError(f"{where}: its column is {definition}, but macro.shear.definition is {law.definition}")
        degrees, force = curve.x, curve.mean
    if degrees[0] > 0.0:
        degrees, force = np.append(0.0, degrees), np.append(0.0, force)
    return _check_curve(where, degrees, to_conjugate(force, np.deg2rad(degrees), definition))


def _check_curve(where: str, degrees: Array, force: Array) -> tuple[Array, Array]:
    peak = float(force.max())
    if degrees[0] != 0.0 or abs(force[0]) > NOISE * peak:
        raise InputError(f"{where}: starts at {degrees[0]:g} deg, {force[0]:g} N/mm; expected 0 deg, 0 N/mm")
    if degrees[-1] >= 90.0:
        raise InputError(f"{where}: ends at {degrees[-1]:g} deg; expected shear angles below 90 deg")
    if not peak > 0.0:
        raise InputError(f"{where}: no force above 0; expected a rising curve")
    level = np.maximum.accumulate(np.append(0.0, force[1:]))
    if (fall := np.flatnonzero(level - np.append(0.0, force[1:]) > NOISE * peak)).size:
        raise InputError(
            f"{where}: the force conjugate to the shear angle falls at {degrees[fall[0]]:g} deg; expected one that "
            "does not fall: cut the curve before, or smooth it"
        )
    if not level[1] > 0.0:
        raise InputError(f"{where}: no force at {degrees[1]:g} deg; expected one that rises from 0")
    return thin_curve(np.deg2rad(degrees), level, TOLERANCE * peak)
