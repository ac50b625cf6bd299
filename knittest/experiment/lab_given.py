"""Statements of a user on laboratory files, and what they make of forces and travels: sign, preload, first loading."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError

Array = NDArray[np.float64]
Sign = Literal["positive", "negative"]
Preload = Literal["subtract", "keep"]
Clamped = Literal["sides", "far"]
Loading = Literal["first", "cycles"]

#: share of the largest force that a force of the other sign stays below, such as noise or the weight of a clamp
OTHER = 0.5
#: a force at the start beyond this share of the largest is asked about
TARE = 0.1
#: share of its range by which a travel may go back before it counts as turned
JITTER = 0.01
#: share of steps that fall from which on a rising travel has noise: rounded ones repeat, but do not fall
FALLING = 0.03


@dataclass(frozen=True)
class Given:
    """Format, conditions by key, and how sign, preload and zero are meant; ``None``: not stated.

    ``columns`` are the roles of all columns in their order, ``named`` those of columns by their names in lower case.
    """

    decimal: str | None = None
    delimiter: str | None = None
    sign: Sign = "positive"
    sizes: Mapping[str, float] = field(default_factory=dict)
    zero: float | None = None
    preload: Preload | None = None
    faces: int = 2
    clamped: Clamped | None = None
    loading: Loading | None = None
    columns: tuple[str, ...] = ()
    named: Mapping[str, str] = field(default_factory=dict)


def drawn(travel: Array, sign: Sign) -> Array:
    """``travel`` (n,) as rising: with a pull counted negative, travels may be too."""
    falls = travel[0] - travel.min() > travel.max() - travel[0]
    return -travel if sign == "negative" and falls else travel


def pulled(force: Array, sign: Sign, where: str) -> Array:
    """``force`` [N], (n,), with pull counted positive; raises :class:`InputError` where it is rather of the other sign.

    ``sign`` is that of a pull in the file.
    """
    if not np.isfinite(force).all():
        raise InputError(f"{where}: no finite force")
    signed = -force if sign == "negative" else force
    top, bottom = float(signed.max()), float(signed.min())
    if -bottom > OTHER * max(top, 0.0) and bottom < 0.0:
        other = "negative" if sign == "positive" else "positive"
        raise InputError(
            f"{where}: forces from {force.max():.4g} to {force.min():.4g} N, with a pull counted as {sign}: "
            f"compression, or the other sign? If it is a pull, give --sign {other}; else tare the force"
        )
    return signed


def tared(force: Array, preload: Preload | None, where: str) -> Array:
    """``force`` [N], (n,), without its preload if so asked; raises :class:`InputError` for a large one otherwise."""
    first, top = float(force[0]), float(np.abs(force).max())
    if preload == "subtract":
        return force - first
    if preload is None and abs(first) > TARE * top:
        raise InputError(
            f"{where}: starts with a force of {first:.4g} N, its largest is {top:.4g} N: a preload or a "
            "weight, which is no resistance? Give --preload subtract, or --preload keep"
        )
    return force


def noise(values: Array) -> float:
    """Standard deviation of the noise of ``values`` (n,) by their second differences; none where they hardly fall."""
    with np.errstate(over="ignore", invalid="ignore"):
        if len(values) < 8 or np.count_nonzero(np.diff(values) < 0.0) < FALLING * len(values):
            return 0.0
        return float(1.4826 * np.median(np.abs(np.diff(values, 2))) / np.sqrt(6.0))


def first_loading(travel: Array) -> tuple[NDArray[np.intp], bool]:
    """Rows of the first way up of ``travel`` (n,), each beyond all before, and whether it turns after them."""
    most = np.maximum.accumulate(travel)
    back = np.flatnonzero(travel < most - max(JITTER * np.ptp(travel), 6.0 * noise(travel)))
    end = int(back[0]) if len(back) else len(travel)
    up = slice(0, int(np.argmax(travel[:end])) + 1)
    rising = np.append(True, travel[up][1:] > most[up][:-1])
    return np.flatnonzero(rising), bool(len(back))
