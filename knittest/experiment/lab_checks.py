"""Checks of forces and travels of specimens: one sign, free of preload, one loading, one series."""

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_recording import Origin
from knittest.experiment.lab_table import Array, Preload, Sign, noise
from knittest.experiment.lab_units import QUANTITIES

#: share of the largest force that a force of the other sign stays below, such as noise or the weight of a clamp
OTHER = 0.5
#: a force at the start beyond this share of the largest is asked about
TARE = 0.1
#: share of its range by which a travel may go back before it counts as turned
JITTER = 0.01
#: one specimen's result over the median of the series, or the other way round: beyond it units or fabrics differ
APART = 3.0


def drawn(travel: Array, sign: Sign) -> Array:
    """``travel`` (n,) as rising: with a pull counted negative, travels may be too."""
    falls = travel[0] - travel.min() > travel.max() - travel[0]
    return -travel if sign == "negative" and falls else travel


def pulled(force: Array, sign: Sign, where: str) -> Array:
    """``force`` [N], (n,), with pull counted positive, which ``sign`` has in the file; refused if of the other sign."""
    signed = -force if sign == "negative" else force
    top, bottom = float(signed.max()), float(signed.min())
    if -bottom > OTHER * max(top, 0.0) and bottom < 0.0:
        other = "negative" if sign == "positive" else "positive"
        raise InputError(
            f"{where}: forces from {force.max():.4g} to {force.min():.4g} N, with a pull counted as {sign}: "
            f"compression, or the other sign? If it is a pull, give --sign {other}; else tare the force"
        )
    return signed


def tared(force: Array, preload: Preload | None, where: str, beside: tuple[str, float, str] | None = None) -> Array:
    """``force`` [N], (n,), without preload if so asked; one large ``beside`` the largest, or another, is refused."""
    first, (name, other, what) = float(force[0]), beside or ("its largest is", float(np.abs(force).max()), "resistance")
    if preload is None and abs(first) > TARE * abs(other):
        raise InputError(
            f"{where}: starts with a force of {first:.4g} N, {name} {other:.4g} N: a preload or a "
            f"weight, which is no {what}? Give --preload subtract, or --preload keep"
        )
    return force - first if preload == "subtract" else force


def first_loading(travel: Array) -> tuple[NDArray[np.intp], bool]:
    """Rows of the first way up of ``travel`` (n,), each beyond all before, and whether it turns after them."""
    most = np.maximum.accumulate(travel)
    back = np.flatnonzero(travel < most - max(JITTER * np.ptp(travel), 6.0 * noise(travel)))
    end = int(back[0]) if len(back) else len(travel)
    up = slice(0, int(np.argmax(travel[:end])) + 1)
    rising = np.append(True, travel[up][1:] > most[up][:-1])
    return np.flatnonzero(rising), bool(len(back))


def refuse_apart(specimens: Sequence[Origin], values: Array, what: str, unit: str) -> None:
    """Raise :class:`InputError` naming the specimen whose value lies a factor :data:`APART` off the others' median."""
    if len(values) < 2:
        return
    others = np.array([np.median(np.delete(values, k)) for k in range(len(values))])
    factor = np.maximum(np.abs(values / others), np.abs(others / values))
    k = int(np.argmax(factor))
    if not factor[k] <= APART:
        raise InputError(
            f"{specimens[k].where}: {what} {values[k]:.4g} {unit}, the median of the "
            f"other {len(values) - 1} is {others[k]:.4g} {unit}: in another unit, or of another series? Leave it out "
            "or mend the file"
        )


def refuse_implausible(
    one: Origin, value: float, band: tuple[float, float], what: str, unit: str, force: float
) -> None:
    """Raise :class:`InputError` for a ``value`` [unit] of ``what`` out of ``band`` that a ``force`` [N] makes."""
    low, high = band
    if low <= value <= high:
        return
    factors, scale = QUANTITIES["force"], force / value if value > 0.0 else 1.0
    likely = {name: force / factors[one.unit] * factor for name, factor in factors.items() if name != one.unit}
    looks = [f"{name}: {newton:.6g} N" for name, newton in likely.items() if low * scale <= newton <= high * scale]
    hint = f" (it looks like {' or '.join(looks[:2])})" if looks else ""
    raise InputError(
        f"{one.where}: {what}: implausible, expected {low:g} to {high:g} {unit}{hint}: check the unit of the force"
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
