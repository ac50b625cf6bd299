"""Functions of time that motions and loads follow."""

from dataclasses import dataclass

import numpy as np

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
        inside = [t for t in self.time if 0.0 < t < time]
        knots = np.array([0.0, *inside, time])
        return float(np.trapezoid(np.interp(knots, self.time, self.value), knots))


def constant(value: float) -> Table:
    """A function that does not change."""
    return Table((0.0,), (value,))


def ramp(duration: float, value: float, knots: int = 64) -> Table:
    """Ramp from 0 to ``value`` over ``duration`` [ms] by the quintic 10 u^3 - 15 u^4 + 6 u^5, then constant."""
    above(duration, "duration of a ramp [ms]", equal=True)
    u = np.linspace(0.0, 1.0, knots + 1)
    smooth = u**3 * (10.0 - u * (15.0 - 6.0 * u))
    return Table(tuple(max(duration, 1e-9) * u), tuple(value * smooth))
