"""Curves of shear in exports of testing machines: a force over a shear angle, or over a travel that makes one."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.experiment import lab_checks as checks
from knittest.experiment.lab_conditions import within
from knittest.experiment.lab_recording import Origin, Recording
from knittest.experiment.lab_results import Curves
from knittest.experiment.statistics import Array, band
from knittest.materials.trellis import ANGLE, NORMALISED

#: shear angle [deg] within which a specimen starts square
SQUARE = 0.5
#: a test that ends below is in rad, in other units, or none
LEAST = 3.0
#: shear angles at which the force is a row [deg]: those of a run
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: row of the largest angle of each specimen
END = "end_of_first_loading_deg"
#: normalised shear force of textiles [N/mm]: from a loose knit at 3 deg to carbon fabrics beyond locking
FORCES = (5e-4, 20.0)


@dataclass(frozen=True)
class Tested:
    """Specimen of ``test`` whose ``angle`` [rad] follows from a travel [mm] up to the ``longest``; in messages
    ``words`` name it, ``square`` is what it is at an angle of zero, and ``options`` state its size. A strain is the
    travel over its ``length`` [mm].
    """

    test: str
    angle: Callable[[float], float]
    longest: float
    words: str
    square: str
    options: str
    length: float | None = None


def shear_curve(r: Recording, tested: Tested) -> tuple[dict[str, Any], tuple[Array, Array]]:
    """The fields of :class:`Sheared` of a recording, from square on, and angle and force of all its rows."""
    role, given = _moved(r, tested), r.given
    moved, force = checks.drawn(r.values[role], given.sign), r.values["force"]
    rows, turned = checks.first_loading(moved)
    first = checks.pulled(force[rows], given.sign, r.where)  # on its way back a specimen may be pushed
    force = -force if given.sign == "negative" else force
    factor = r.factors[role]
    angle = _angles(moved - (given.zero or 0.0) * factor, role, tested, r.where)
    if given.zero is None and abs(angle[0]) > SQUARE:
        raise InputError(
            f"{r.where}: starts at {moved[0] / factor:g}, a shear angle of {angle[0]:.3g} deg: where is "
            f"{tested.square}? Give --zero, in the unit of the column: {moved[0] / factor:g} if at the start, 0 if the "
            "numbers are right"
        )
    if angle[0] <= SQUARE:
        free = checks.tared(first, given.preload, r.where)
        first, force = free, force - (first[0] - free[0])
    end = float(angle[rows[-1]])
    within(end, tested.test, "max_angle", f"{r.where}: a shear angle of {end:.4g} deg", ": check its unit and zero")
    if len(rows) < 3 or end < LEAST:
        looks = f" (it looks like rad: {np.rad2deg(end):.4g} deg)" if 0.1 < end < 1.4 else ""
        raise InputError(
            f"{r.where}: the first loading has {len(rows)} rows up to {end:.3g} deg{looks}: expected at least 3, up to "
            f"{LEAST:g} deg"
        )
    sheared = angle[rows] >= 0.0
    return {"angle": angle[rows][sheared], "force": first[sheared], "turned": turned}, (angle, force)


def _moved(r: Recording, tested: Tested) -> str:
    """Role of the column that gives the angle; raises :class:`InputError` for what is none, and for another force."""
    role = next(role for role in ("angle", "travel", "strain", "extensometer") if role in r.values)
    along_sides = (
        "a force along the sides, F_s? Expected the F of the crosshead, 2 F_s cos(45 deg - angle / 2): leave the "
        "column out or convert it; name it 'force' if it is that"
    )
    of_a_part = "an extensometer sees a part of the specimen alone: expected the travel of the clamp"
    for column, wrong, reason in (
        ("force", r.is_kind(r.columns["force"], "along_sides"), along_sides),
        (role, role == "strain" and tested.length is None, "a strain: expected a travel or an angle"),
        (role, role != "angle" and r.is_kind(r.columns[role], "sensor"), of_a_part),
    ):
        if wrong:
            raise InputError(f"{r.table.where}: column {r.title(column)!r}: {reason}")
    return role


def _angles(moved: Array, role: str, tested: Tested, where: str) -> Array:
    """Shear angle [deg], (n,), of an angle [deg], a travel [mm] or a strain [%]."""
    if role == "angle":
        return moved
    travel = moved * (tested.length or 0.0) / 100.0 if role == "strain" else moved
    most = float(np.abs(travel).max())
    if not most < tested.longest:
        raise InputError(
            f"{where}: a displacement of {most:g} mm, where {tested.words} is drawn out by {tested.longest:.4g} mm at "
            f"most: check the unit, {tested.options} and --zero"
        )
    return np.rad2deg([tested.angle(float(d)) for d in travel])


@dataclass(frozen=True)
class Sheared(Origin):
    """Shear angle [deg], rising, and force [N] on the first loading, (n,) each, and whether more of it follows."""

    angle: Array
    force: Array
    turned: bool

    @property
    def normalised(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        raise NotImplementedError


def shear_forces(specimens: Sequence[Sheared]) -> tuple[dict[float, Array], list[str]]:
    """Normalised forces [N/mm] at the :data:`ANGLES` that all specimens reach, and fingerprints of the curves."""
    end = min(float(s.angle[-1]) for s in specimens)
    for s in specimens:
        top, force = float(s.normalised.max()), float(s.force.max())
        checks.refuse_implausible(
            s, top, FORCES, f"maximum force {force:.6g} N, normalised {top:.4g} N/mm", "N/mm", force
        )
    at = {a: np.array([np.interp(a, s.angle, s.normalised) for s in specimens]) for a in (*ANGLES, end)}
    checks.refuse_apart(specimens, at[end], f"normalised force at {end:.3g} deg", "N/mm")
    found = {a: values for a, values in at.items() if a in ANGLES and a <= end}
    if not found:
        raise InputError(
            f"{specimens[0].path}: all specimens together go to {end:.3g} deg: expected at least {ANGLES[0]:g} deg"
        )
    return found, checks.digests(specimens, [(s.angle, s.force) for s in specimens])


def shear_curves(specimens: Sequence[Sheared], words: str, **more: Any) -> Curves:
    """Curves of the normalised force up to the angle that all ``specimens`` reach; ``words`` name the angle."""
    curves = [(s.angle, s.normalised) for s in specimens]
    corridor = band(curves, min(float(angle[-1]) for angle, _ in curves), "shear angles")
    names = (ANGLE, NORMALISED, "normalised_shear_force_sd_n_per_mm")
    return Curves(curves, corridor, names, (f"{words} [deg]", "normalised shear force [N/mm]"), **more)


def shear_rows(
    specimens: Sequence[Sheared], forces: Mapping[str, Mapping[float, Array]], more: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, str]]:
    """Rows of ``forces`` at angles by their quantity, ``more`` and the largest angle, and the units of the forces."""
    found = {f"{name}_at_deg.{a:g}": values for name, at in forces.items() for a, values in at.items()}
    units = {name: "N/mm" if "n_per_mm" in name else "N" for name in found}
    return {**found, **more, END: np.array([s.angle[-1] for s in specimens])}, units | {END: "deg"}


def reached(test: dict[str, Any]) -> dict[str, float]:
    """Largest angle [deg] of a rig: that which all specimens of a ``test`` reach by its statistics, in tenths."""
    return {"max_angle": math.floor(10.0 * min(test[END]["values"])) / 10.0} if END in test else {}
