"""Curves of shear in exports of testing machines, and checks of the forces and travels of specimens."""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import check_within_bounds
from knittest.experiment.lab_recording import Origin, Recording
from knittest.experiment.lab_results import Curves
from knittest.experiment.lab_table import Array, Preload, Sign, noise
from knittest.experiment.lab_units import QUANTITIES
from knittest.experiment.statistics import band
from knittest.materials.trellis import ANGLE, NORMALISED

#: largest force of the other sign over the maximum force, such as noise or the weight of a clamp
OTHER = 0.5
#: largest force at the start over the maximum force without a statement by the user
TARE = 0.1
#: share of its range by which a travel may fall before it counts as reversed
JITTER = 0.01
#: largest factor between the result of a specimen and the median of the others
APART = 3.0


def to_rising_travel(travel: Array, sign: Sign) -> Array:
    """Return ``travel`` (n,) as rising; if tension counts as negative, it may be negative too."""
    falls = travel[0] - travel.min() > travel.max() - travel[0]
    return -travel if sign == "negative" and falls else travel


def to_tension_force(force: Array, sign: Sign, where: str) -> Array:
    """Return ``force`` [N], (n,), positive in tension; raises :class:`InputError` if it contradicts ``sign``."""
    signed = -force if sign == "negative" else force
    top, bottom = float(signed.max()), float(signed.min())
    if -bottom > OTHER * max(top, 0.0) and bottom < 0.0:
        other = "negative" if sign == "positive" else "positive"
        raise InputError(
            f"{where}: force from {force.max():.4g} to {force.min():.4g} N, but tension counts as {sign}; give --sign "
            f"{other} if the test is in tension, else correct the zero of the force"
        )
    return signed


def remove_preload(force: Array, preload: Preload | None, where: str, limit: tuple[str, float] | None = None) -> Array:
    """Remove the preload of ``force`` [N], (n,), if stated; raises InputError for a large one that is not stated."""
    first, (name, other) = float(force[0]), limit or ("its maximum is", float(np.abs(force).max()))
    if preload is None and abs(first) > TARE * abs(other):
        raise InputError(
            f"{where}: the force starts at {first:.4g} N ({name} {other:.4g} N, limit {100.0 * TARE:g} % of it); give "
            "--preload subtract if this is a preload or a weight, else --preload keep"
        )
    return force - first if preload == "subtract" else force


def first_loading(travel: Array) -> tuple[NDArray[np.intp], bool]:
    """Return the rows of the first loading by ``travel`` (n,), each beyond all before, and whether it turns back."""
    most = np.maximum.accumulate(travel)
    back = np.flatnonzero(travel < most - max(JITTER * np.ptp(travel), 6.0 * noise(travel)))
    end = int(back[0]) if len(back) else len(travel)
    up = slice(0, int(np.argmax(travel[:end])) + 1)
    rising = np.append(True, travel[up][1:] > most[up][:-1])
    return np.flatnonzero(rising), bool(len(back))


def refuse_outliers(specimens: Sequence[Origin], values: Array, what: str, unit: str) -> None:
    """Raise :class:`InputError` for a specimen whose value is a factor :data:`APART` off the median of the others."""
    if len(values) < 2:
        return
    others = np.array([np.median(np.delete(values, k)) for k in range(len(values))])
    factor = np.maximum(np.abs(values / others), np.abs(others / values))
    k = int(np.argmax(factor))
    if not factor[k] <= APART:
        raise InputError(
            f"{specimens[k].place}: {what} {values[k]:.4g} {unit} and the median of the other {len(values) - 1}, "
            f"{others[k]:.4g} {unit}, differ by more than a factor of {APART:g}; check the unit, or remove the specimen"
        )


def refuse_implausible(
    one: Origin, value: float, band: tuple[float, float], what: str, unit: str, force: float
) -> None:
    """Raise :class:`InputError` for a ``value`` [unit] of ``what`` outside ``band``, caused by a ``force`` [N]."""
    low, high = band
    if low <= value <= high:
        return
    factors, scale = QUANTITIES["force"], force / value if value > 0.0 else 1.0
    likely = {name: force / factors[one.unit] * factor for name, factor in factors.items() if name != one.unit}
    looks = [f"{name}: {newton:.6g} N" for name, newton in likely.items() if low * scale <= newton <= high * scale]
    hint = f" (it looks like {' or '.join(looks[:2])})" if looks else ""
    raise InputError(f"{one.place}: {what}: implausible, expected {low:g} to {high:g} {unit}{hint}; check the unit")


def digests(specimens: Sequence[Origin], curves: Sequence[Sequence[Array]]) -> list[str]:
    """Fingerprints of the curves; raises :class:`InputError` for two equal ones."""
    found = [digest(*columns) for columns in curves]
    for k, one in enumerate(found):
        if one in found[:k]:
            first = specimens[found.index(one)].name
            raise InputError(f"specimens {first} and {specimens[k].name} have the same curve; remove one of them")
    return found


def digest(*columns: Array) -> str:
    """Fingerprint of a curve by its numbers, for any delimiter and decimal mark."""
    text = "".join(" ".join(f"{v:.6g}" for v in column) + ";" for column in columns)
    return hashlib.sha256(text.encode()).hexdigest()


#: shear angle [deg] within which a specimen starts square
SQUARE = 0.5
#: smallest largest angle [deg] of a test; below it the unit is wrong
LEAST = 3.0
#: shear angles at which the force is a row [deg]: those of a run
ANGLES = (10.0, 20.0, 30.0, 40.0)
#: row of the largest angle of each specimen
END = "end_of_first_loading_deg"
#: normalised shear force of textiles [N/mm]: from a loose knit at 3 deg to carbon fabrics beyond locking
FORCES = (5e-4, 20.0)


@dataclass(frozen=True)
class ShearSetup:
    """Specimen of ``test`` whose ``angle`` [rad] follows from a travel [mm] up to the ``longest``. Messages use its
    ``words``, its state ``square`` at zero and the ``options`` of its size. A strain is travel over ``length`` [mm].
    """

    test: str
    angle: Callable[[float], float]
    longest: float
    words: str
    square: str
    options: str
    length: float | None = None


def shear_curve(r: Recording, tested: ShearSetup) -> tuple[dict[str, Any], tuple[Array, Array]]:
    """Return the fields of :class:`ShearLoading` from the square state on, and angle and force of all rows."""
    role, given = _travel_role(r, tested), r.given
    moved, force = to_rising_travel(r.values[role], given.sign), r.values["force"]
    rows, turned = first_loading(moved)
    first = to_tension_force(force[rows], given.sign, r.place)  # on its way back a specimen may be pushed
    force = -force if given.sign == "negative" else force
    factor = r.factors[role]
    angle = _shear_angles(moved - (given.zero or 0.0) * factor, role, tested, r.place)
    if given.zero is None and abs(angle[0]) > SQUARE:
        raise InputError(
            f"{r.place}: starts at {moved[0] / factor:g}, a shear angle of {angle[0]:.3g} deg (limit {SQUARE:g} deg); "
            f"give --zero, the value of the column for {tested.square}: {moved[0] / factor:g} if in the first row, 0 "
            "if the values are right"
        )
    if angle[0] <= SQUARE:
        free = remove_preload(first, given.preload, r.place)
        first, force = free, force - (first[0] - free[0])
    end = float(angle[rows[-1]])
    check_within_bounds(
        end, tested.test, "max_angle", f"{r.place}: a shear angle of {end:.4g} deg", ": check its unit and zero"
    )
    if len(rows) < 3 or end < LEAST:
        looks = f" (it looks like rad: {np.rad2deg(end):.4g} deg)" if 0.1 < end < 1.4 else ""
        raise InputError(
            f"{r.place}: the first loading has {len(rows)} rows up to {end:.3g} deg{looks}; expected at least 3 rows "
            f"and {LEAST:g} deg"
        )
    sheared = angle[rows] >= 0.0
    return {"angle": angle[rows][sheared], "force": first[sheared], "turned": turned}, (angle, force)


def _travel_role(r: Recording, tested: ShearSetup) -> str:
    """Find the role of the column for the angle; raises :class:`InputError` for an unsuitable travel or force."""
    role = next(role for role in ("angle", "travel", "strain", "extensometer") if role in r.values)
    along_sides = (
        "looks like the force F_s along the sides; expected the crosshead force F = 2 F_s cos(45 deg - angle / 2). "
        "Convert the column, or name it 'force' if it is F"
    )
    of_a_part = "is an extensometer, which measures only a part of the specimen; expected the clamp travel"
    for column, wrong, reason in (
        ("force", r.is_kind(r.columns["force"], "along_sides"), along_sides),
        (role, role == "strain" and tested.length is None, "is a strain; expected a travel or an angle"),
        (role, role != "angle" and r.is_kind(r.columns[role], "sensor"), of_a_part),
    ):
        if wrong:
            raise InputError(f"{r.table.header_place}: column {r.title(column)!r} {reason}")
    return role


def _shear_angles(moved: Array, role: str, tested: ShearSetup, where: str) -> Array:
    """Shear angle [deg], (n,), of an angle [deg], a travel [mm] or a strain [%]."""
    if role == "angle":
        return moved
    travel = moved * (tested.length or 0.0) / 100.0 if role == "strain" else moved
    most = float(np.abs(travel).max())
    if not most < tested.longest:
        raise InputError(
            f"{where}: displacement {most:g} mm; {tested.words} allows {tested.longest:.4g} mm at most; check the "
            f"unit, {tested.options} and --zero"
        )
    return np.rad2deg([tested.angle(float(d)) for d in travel])


@dataclass(frozen=True)
class ShearLoading(Origin):
    """Shear angle [deg], rising, and force [N] of the first loading, (n,) each, and whether it turns back later."""

    angle: Array
    force: Array
    turned: bool

    @property
    def normalised_force(self) -> Array:
        """Normalised shear force [N/mm], (n,)."""
        raise NotImplementedError


def shear_forces(specimens: Sequence[ShearLoading]) -> tuple[dict[float, Array], list[str]]:
    """Normalised forces [N/mm] at those :data:`ANGLES` that all specimens reach, and fingerprints of the curves."""
    end = min(float(s.angle[-1]) for s in specimens)
    for s in specimens:
        top, force = float(s.normalised_force.max()), float(s.force.max())
        refuse_implausible(s, top, FORCES, f"maximum force {force:.6g} N, normalised {top:.4g} N/mm", "N/mm", force)
    at = {a: np.array([np.interp(a, s.angle, s.normalised_force) for s in specimens]) for a in (*ANGLES, end)}
    refuse_outliers(specimens, at[end], f"normalised force at {end:.3g} deg", "N/mm")
    found = {a: values for a, values in at.items() if a in ANGLES and a <= end}
    if not found:
        raise InputError(f"{specimens[0].path}: the common range ends at {end:.3g} deg; expected {ANGLES[0]:g} deg")
    return found, digests(specimens, [(s.angle, s.force) for s in specimens])


def shear_curves(specimens: Sequence[ShearLoading], words: str, **more: Any) -> Curves:
    """Curves of the normalised force up to the angle that all ``specimens`` reach, named by ``words``."""
    curves = [(s.angle, s.normalised_force) for s in specimens]
    corridor = band(curves, min(float(angle[-1]) for angle, _ in curves), "shear angles")
    names = (ANGLE, NORMALISED, "normalised_shear_force_sd_n_per_mm")
    return Curves(curves, corridor, names, (f"{words} [deg]", "normalised shear force [N/mm]"), **more)


def shear_rows(
    specimens: Sequence[ShearLoading], forces: Mapping[str, Mapping[float, Array]], more: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, str]]:
    """Rows of ``forces`` at angles, ``more`` and the largest angle by quantity, and units of the forces."""
    found = {f"{name}_at_deg.{a:g}": values for name, at in forces.items() for a, values in at.items()}
    units = {name: "N/mm" if "n_per_mm" in name else "N" for name in found}
    return {**found, **more, END: np.array([s.angle[-1] for s in specimens])}, units | {END: "deg"}


def max_angle_field(test: dict[str, Any]) -> dict[str, float]:
    """Largest angle [deg] of a rig: the one that all specimens of a ``test`` reach, rounded down to tenths."""
    return {"max_angle": math.floor(10.0 * min(test[END]["values"])) / 10.0} if END in test else {}
