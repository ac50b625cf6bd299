"""Curves of a run, and the tension curve of the shells from that of a strip of yarns."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import NumericalError

Array = NDArray[np.float64]

#: points of a tension curve between the origin and the largest force
POINTS = 40
#: smallest tangent of a tension curve, as a share of its secant: shells need one, and yarns that break leave none
LEAST_TANGENT = 0.01
#: fewest rows of a run's curve up to the largest force
FEWEST_ROWS = 2 * POINTS


def read_columns(folder: Path, x: str, y: str) -> tuple[Array, Array]:
    """Columns ``x`` and ``y`` of curve.csv in the run ``folder``, first loading alone: up to the largest x."""
    import pandas as pd

    table = pd.read_csv(folder / "curve.csv", comment="#")
    along, force = table[x].to_numpy(float), table[y].to_numpy(float)
    first = np.append(True, along[1:] > np.maximum.accumulate(along)[:-1])
    return along[first], force[first]


def to_peak(strain: Array, force: Array) -> tuple[Array, Array]:
    """The curve up to its largest force."""
    end = int(np.argmax(force)) + 1
    return strain[:end], force[:end]


def tension_curve(strain: Array, force: Array) -> tuple[Array, Array]:
    """Strain [%] and force [N] from the origin to the largest force, from those of a strip, (n,).

    Means over equal steps of strain, and the least change of them that lets the tangent nowhere fall below
    :data:`LEAST_TANGENT` (isotonic regression); the end point is that of the run. Raises :class:`NumericalError` for
    too few rows.
    """
    from scipy.optimize import isotonic_regression

    strain, force = to_peak(strain, force)
    if len(strain) < FEWEST_ROWS:
        raise NumericalError(f"{len(strain)} rows up to the largest force; expected at least {FEWEST_ROWS}")
    last, peak = float(strain[-1]), float(force[-1])
    step = np.minimum((POINTS * strain / last).astype(int), POINTS - 1)
    inner = [k for k in range(1, POINTS) if np.any(step == k)]
    along = np.array([strain[step == k].mean() for k in inner])
    mean = np.array([force[step == k].mean() for k in inner])
    least = LEAST_TANGENT * peak / last
    rising = isotonic_regression(mean - least * along).x + least * along
    rising = np.clip(rising, least * along, peak - least * (last - along))
    return np.concatenate([[0.0], along, [last]]), np.concatenate([[0.0], rising, [peak]])
