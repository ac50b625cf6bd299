"""Slips that the files of one series let pass: copies, mixed series, specimens that cannot be of one."""

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import Condition, unstated
from knittest.experiment.lab_recording import Origin
from knittest.experiment.lab_units import likely_force

Array = NDArray[np.float64]

#: one specimen's result over the median of the series, or the other way round: beyond it units or fabrics differ
APART = 3.0
#: widths and lengths of one series agree within this share: they are measured one by one
SERIES = 0.05


def refuse_apart(specimens: Sequence[Origin], values: Array, what: str, unit: str) -> None:
    """Raise :class:`InputError` naming the specimen whose value lies a factor :data:`APART` off the others' median."""
    if len(values) < 2:
        return
    others = np.array([np.median(np.delete(values, k)) for k in range(len(values))])
    factor = np.maximum(np.abs(values / others), np.abs(others / values))
    k = int(np.argmax(factor))
    if not factor[k] <= APART:
        raise InputError(
            f"{specimens[k].path}: specimen {specimens[k].name}: {what} {values[k]:.4g} {unit}, the median of the "
            f"other {len(values) - 1} is {others[k]:.4g} {unit}: in another unit, or of another series? Leave it out "
            "or mend the file"
        )


def refuse_implausible(
    one: Origin, value: float, band: tuple[float, float], what: str, unit: str, force: float
) -> None:
    """Raise :class:`InputError` for a ``value`` [unit] out of ``band`` that a ``force`` [N] makes, with the likely unit
    of the force; ``what`` says what has that value.
    """
    low, high = band
    if low <= value <= high:
        return
    scale = force / value if value > 0.0 else 1.0
    raise InputError(
        f"{one.path}: specimen {one.name}: {what}: implausible, expected {low:g} to {high:g} {unit}"
        f"{likely_force(force, one.unit, (low * scale, high * scale))}: check the unit of the force"
    )


def digests(specimens: Sequence[Origin], curves: Sequence[Sequence[Array]]) -> list[str]:
    """Fingerprints of the curves; raises :class:`InputError` for two of the same numbers."""
    found = [digest(*columns) for columns in curves]
    for k, one in enumerate(found):
        if one in found[:k]:
            first = specimens[found.index(one)].name
            raise InputError(f"specimens {first} and {specimens[k].name}: the same curve twice: leave one out")
    return found


def digest(*columns: Array) -> str:
    """Fingerprint of a curve by its numbers, whatever the file's delimiter and decimal mark."""
    text = "".join(" ".join(f"{v:.6g}" for v in column) + ";" for column in columns)
    return hashlib.sha256(text.encode()).hexdigest()


def common(what: Condition, values: Sequence[float | None], specimens: Sequence[object]) -> float:
    """Mean of ``what`` over specimens, or files; raises :class:`InputError` where one lacks it or differs."""
    paths = [getattr(one, "path", one) for one in specimens]
    for value, path in zip(values, paths, strict=True):
        if value is None:
            raise unstated([what], path)
    found = [v for v in values if v is not None]
    for value, path in zip(found, paths, strict=True):
        if abs(value - found[0]) > SERIES * found[0]:
            raise InputError(
                f"{path}: {what.one} of {value:g} {what.unit}, {paths[0]} has {found[0]:g} {what.unit}: "
                "import series of different sizes into folders of their own"
            )
    return found[0] if np.ptp(found) == 0.0 else float(np.mean(found))
