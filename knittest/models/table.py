"""Functions of time that motions and loads follow."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.models.inputs import above, finite


@dataclass(frozen=True)
class Table:
    """Piecewise linear function of time: ``time`` [ms] and ``value``, (n_knots,); constant outside."""

    time: tuple[float, ...]
    value: tuple[float, ...]

    def __post_init__(self) -> None:
        time, value = finite(self.time, "time of a table", (-1,)), finite(self.value, "value of a table", (-1,))
        if len(time) != len(value) or not len(time):
            raise InputError(f"a table has {len(time)} times and {len(value)} values; expected one value a time")
        if (np.diff(time) < 0.0).any():
            raise InputError(f"times of a table must not fall, got {self.time}")

    def integral(self, time: float) -> float:
        """Integral from 0 to ``time`` [ms]: the travel of a velocity table."""
        knots, value = self._arrays
        first, last = np.searchsorted(knots, 0.0, side="right"), np.searchsorted(knots, time, side="left")
        at = np.concatenate([[0.0], knots[first:last], [time]])
        y = np.interp(at, knots, value)
        return 0.5 * float((y[1:] + y[:-1]) @ np.diff(at))

    @cached_property
    def _arrays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return np.array(self.time), np.array(self.value)


def constant(value: float) -> Table:
    """A function that does not change."""
    return Table((0.0,), (value,))


def ramp(duration: float, value: float, knots: int = 64) -> Table:
    """Ramp from 0 to ``value`` over ``duration`` [ms] by the quintic 10 u^3 - 15 u^4 + 6 u^5, then constant."""
    above(duration, "duration of a ramp [ms]", equal=True)
    u = np.linspace(0.0, 1.0, knots + 1)
    smooth = u**3 * (10.0 - u * (15.0 - 6.0 * u))
    return Table(tuple(max(duration, 1e-9) * u), tuple(value * smooth))
