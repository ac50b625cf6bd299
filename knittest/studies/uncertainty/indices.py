"""Sobol' indices, bands and rank regression of quantities over the design, with intervals by resampling its rows.

Estimators of first order and total: Saltelli et al. (2010), Table 2, (b) and (f), by ``scipy.stats.sobol_indices``.
Its own bootstrap takes no seed in all versions, so the rows are resampled here.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array

#: resamples, and the percentiles of them that bound a 95 % interval
RESAMPLES, ENDS = 999, (2.5, 97.5)
#: percentiles of a band
BAND = (5.0, 50.0, 95.0)
#: largest sd, as a share of the mean, of a quantity that does not change except by rounding
CONSTANT_TOLERANCE = 1e-9
#: fewest rows with indices, and fewest points with a band: of fewer, the outer twentieth has no point
LEAST_ROWS, LEAST_POINTS = 16, 20


@dataclass(frozen=True)
class Indices:
    """First-order and total indices (d,), and the lower and upper ends of their intervals (2, d)."""

    first: Array
    first_interval: Array
    total: Array
    total_interval: Array


def indices(values: Array, seed: int) -> Indices:
    """Indices of a quantity with finite ``values`` (d + 2, n) over the design; raises ``ValueError`` for others."""
    if not np.isfinite(values).all():
        raise ValueError("not every row of the design has a result")
    dice = np.random.default_rng(seed)
    n = values.shape[1]
    drawn = np.array([_indices(values[:, dice.integers(0, n, n)]) for _ in range(RESAMPLES)])  # (resamples, 2, d)
    low, high = np.percentile(drawn, ENDS, axis=0)
    first, total = _indices(values)
    return Indices(first, np.array([low[0], high[0]]), total, np.array([low[1], high[1]]))


def _indices(values: Array) -> Array:
    """First-order and total indices (2, d) of ``values`` (d + 2, n)."""
    from scipy.stats import sobol_indices

    given: Any = {"f_A": values[:1], "f_B": values[1:2], "f_AB": values[2:, None, :]}
    found = sobol_indices(func=given, n=values.shape[1])
    return np.array([found.first_order, found.total_order]).reshape(2, -1)


def varies(values: Array) -> bool:
    """Tell whether ``values``, NaN where there is none, differ by more than rounding."""
    found = values[np.isfinite(values)]
    return bool(len(found) and np.std(found) > CONSTANT_TOLERANCE * np.abs(found).max())


@dataclass(frozen=True)
class Spread:
    """Percentiles :data:`BAND` (3,) of ``count`` numbers, and the ends of their intervals (2, 3)."""

    count: int
    band: Array
    interval: Array


def spread(values: Array, seed: int) -> Spread | None:
    """Band of ``values`` (2, n) of A and B, NaN where a number is missing; None if too few have a number."""
    count = int(np.isfinite(values).sum())
    if count < LEAST_POINTS:
        return None
    drawn = np.nanpercentile(_resample(values, seed), BAND, axis=1)  # (3, resamples)
    return Spread(count, np.nanpercentile(values, BAND), np.percentile(drawn, ENDS, axis=1))


def _resample(values: Array, seed: int) -> Array:
    """Resamples (resamples, points) of the rows of ``values`` (2, n) that have any number."""
    rows = values[:, np.isfinite(values).any(axis=0)]
    n = rows.shape[1]
    picked = rows[:, np.random.default_rng(seed).integers(0, n, (RESAMPLES, n))]
    return picked.transpose(1, 0, 2).reshape(RESAMPLES, -1)


@dataclass(frozen=True)
class Share:
    """Share of the prior for which a statement holds: ``holds`` of ``count`` points of the ``total`` of A and B.

    The share is of the points with all numbers. ``failing`` points lack a number and fail at a place with one. They
    only bound the share: points that lack a number can be known to fail, but not to hold.
    """

    holds: int
    count: int
    total: int
    failing: int
    interval: tuple[float, float] | None

    @property
    def value(self) -> float | None:
        """Share of the points with a number; None without any."""
        return self.holds / self.count if self.count else None

    @property
    def possible(self) -> tuple[float, float]:
        """Least and largest possible share of all points for any missing numbers."""
        return self.holds / self.total, (self.holds + self.total - self.count - self.failing) / self.total


def share(holds: Array, fails: NDArray[np.bool_], seed: int) -> Share:
    """Share of the points (2, n) of A and B in ``holds``: 1 where the statement holds, 0 where not, NaN where a number
    is missing. ``fails`` flags points where it fails for any missing number.
    """
    count, interval = int(np.isfinite(holds).sum()), None
    if count >= LEAST_POINTS:
        low, high = np.percentile(np.nanmean(_resample(holds, seed), axis=1), ENDS)
        interval = (float(low), float(high))
    return Share(int(np.nansum(holds)), count, holds.size, int((fails & np.isnan(holds)).sum()), interval)


# Regression of the ranks of a quantity, from any sample, on the ranks of the parameters.
#
# Standardised rank regression coefficients (Iman & Conover 1979; Saltelli & Marivoet 1990) lie between -1 and 1. The
# square of one is the share of the ranks' variance by its parameter if the parameters are drawn independently. The
# coefficients are valid if the quantity rises or falls throughout; the explained share of the variance shows this.

#: fewest points of a regression for each parameter
POINTS_EACH = 3


@dataclass(frozen=True)
class RankRegression:
    """Coefficients (d,), the ends of their intervals (2, d), and the explained share of the variance."""

    coefficient: Array
    interval: Array
    explained: float


def no_regression_reason(drawn: Array, values: Array) -> str:
    """Reason why ``values`` (n,) at the parameters ``drawn`` (n, d) have no regression; empty if they have one."""
    count, least = int(np.isfinite(values).sum()), POINTS_EACH * drawn.shape[1]
    if count < least:
        return f"{count} points have a result, a regression needs at least {least}"
    return "" if varies(values) else "the quantity does not change over the prior"


def rank_regression(drawn: Array, values: Array, seed: int) -> RankRegression:
    """Regression of ``values`` (n,), NaN for a missing one, on the parameters ``drawn`` (n, d)."""
    known = np.isfinite(values)
    drawn, values = drawn[known], values[known]
    coefficient, explained = _regression(drawn, values)
    dice, n = np.random.default_rng(seed), len(values)
    again = np.array([_regression(drawn[k], values[k])[0] for k in dice.integers(0, n, (RESAMPLES, n))])
    return RankRegression(coefficient, np.asarray(np.percentile(again, ENDS, axis=0)), explained)


def _regression(drawn: Array, values: Array) -> tuple[Array, float]:
    """Standardised coefficients (d,) of ranks, and the explained share of the variance."""
    from scipy.stats import rankdata

    ranks = np.column_stack([rankdata(drawn, axis=0), rankdata(values)])
    ranks -= ranks.mean(axis=0)
    ranks /= np.maximum(ranks.std(axis=0), 1e-300)
    x, y = ranks[:, :-1], ranks[:, -1]
    found = np.linalg.lstsq(x, y, rcond=None)[0]
    return found, 1.0 - float(((y - x @ found) ** 2).mean() / max(float((y**2).mean()), 1e-300))
