"""Piecewise linear tables of time."""

import numpy as np
from numba import njit

from knittest.kernels.options import KERNEL, PART


@njit(**PART)
def table_value(times, values, time):
    """Value at ``time`` of the piecewise linear function through (times, values); constant outside."""
    last = times.size - 1
    if time <= times[0]:
        return values[0]
    if time >= times[last]:
        return values[last]
    k = np.searchsorted(times, time, side="right") - 1
    share = (time - times[k]) / (times[k + 1] - times[k])
    return values[k] + (values[k + 1] - values[k]) * share


@njit(**KERNEL)
def read_tables(tables, before, now):
    """Fill ``tables.now`` with the values at two times [ms]."""
    for m in range(tables.time.shape[0]):
        knots = tables.knots[m]
        tables.now[0, m] = table_value(tables.time[m, :knots], tables.value[m, :knots], before)
        tables.now[1, m] = table_value(tables.time[m, :knots], tables.value[m, :knots], now)
