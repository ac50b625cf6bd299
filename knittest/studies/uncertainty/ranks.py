"""Regression of the ranks of a quantity, from any sample, on those of the parameters: what it hangs on.

Standardised rank regression coefficients (Iman & Conover 1979; Saltelli & Marivoet 1990): each between -1 and 1, its
square the share of the ranks' variance that goes with the parameter where the parameters are drawn independently. They
hold as far as the quantity rises or falls throughout: the share explained says how far.
"""

from dataclasses import dataclass

import numpy as np

from knittest.base.history import Array
from knittest.studies.uncertainty.indices import LEVEL, RESAMPLES, varies

#: points a parameter that a regression takes at least
POINTS_EACH = 3


@dataclass(frozen=True)
class Ranked:
    """Coefficients (d,), the ends of their intervals (2, d), and the share of the variance that they explain."""

    coefficient: Array
    interval: Array
    explained: float


def no_regression(drawn: Array, values: Array) -> str:
    """Reason why ``values`` (n,) at the parameters ``drawn`` (n, d) have no regression; empty where they have."""
    count, least = int(np.isfinite(values).sum()), POINTS_EACH * drawn.shape[1]
    if count < least:
        return f"{count} points have a number, and a regression takes {least} at least"
    return "" if varies(values) else "it does not change over the prior"


def rank_regression(drawn: Array, values: Array, seed: int) -> Ranked:
    """Regression of ``values`` (n,), NaN where there is none, on the parameters ``drawn`` (n, d)."""
    known = np.isfinite(values)
    drawn, values = drawn[known], values[known]
    coefficient, explained = _regression(drawn, values)
    dice, n = np.random.default_rng(seed), len(values)
    again = np.array([_regression(drawn[k], values[k])[0] for k in dice.integers(0, n, (RESAMPLES, n))])
    ends = ((100.0 - LEVEL) / 2.0, (100.0 + LEVEL) / 2.0)
    return Ranked(coefficient, np.asarray(np.percentile(again, ends, axis=0)), explained)


def _regression(drawn: Array, values: Array) -> tuple[Array, float]:
    """Standardised coefficients (d,) of ranks, and the share of the variance that they explain."""
    from scipy.stats import rankdata

    ranks = np.column_stack([rankdata(drawn, axis=0), rankdata(values)])
    ranks -= ranks.mean(axis=0)
    ranks /= np.maximum(ranks.std(axis=0), 1e-300)
    x, y = ranks[:, :-1], ranks[:, -1]
    found = np.linalg.lstsq(x, y, rcond=None)[0]
    return found, 1.0 - float(((y - x @ found) ** 2).mean() / max(float((y**2).mean()), 1e-300))
