"""Statements of a user on laboratory files, besides what the files state themselves."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.experiment.lab_sign import Sign

Array = NDArray[np.float64]
Preload = Literal["subtract", "keep"]
Clamped = Literal["sides", "far"]
Loading = Literal["first", "cycles"]

#: a force at the start beyond this share of the largest is asked about
TARE = 0.1
#: share of its range by which a travel may go back before it counts as turned
JITTER = 0.01


@dataclass(frozen=True)
class Given:
    """Format, conditions by key, how sign, preload and zero of a curve are meant, and what of it counts; ``None``: not
    said.
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


def first_loading(travel: Array) -> tuple[NDArray[np.intp], bool]:
    """Rows of the first way up of ``travel`` (n,), each beyond all before, and whether it turns after them."""
    most = np.maximum.accumulate(travel)
    back = np.flatnonzero(travel < most - JITTER * np.ptp(travel))
    end = int(back[0]) if len(back) else len(travel)
    up = slice(0, int(np.argmax(travel[:end])) + 1)
    rising = np.append(True, travel[up][1:] > most[up][:-1])
    return np.flatnonzero(rising), bool(len(back))
