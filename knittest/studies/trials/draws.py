"""Points drawn from distributions: independent, or spread as a Latin hypercube (McKay, Beckman and Conover, 1979)."""

from collections.abc import Sequence

import numpy as np

from knittest.base.history import Array
from knittest.config.sweep import Distribution, Sample

#: digits of a value that is tried: enough for any use, few enough that a trial is found again
DIGITS = 8


def tried(value: float, low: float, high: float) -> float:
    """``value`` between ``low`` and ``high``, with as many digits as a trial has."""
    return float(f"{min(max(value, low), high):.{DIGITS}g}")


def drawn(sample: Sample) -> list[tuple[float | int, ...]]:
    """``sample.n`` points with a value for each of ``sample.fields``, in their order; the seed decides all."""
    unit = _unit_points(sample.method, sample.n, len(sample.fields), sample.seed)
    columns = [_values(one, unit[:, k]) for k, one in enumerate(sample.fields.values())]
    return list(zip(*columns, strict=True))


def _unit_points(method: str, n: int, dimensions: int, seed: int) -> Array:
    """Points (n, dimensions) in the unit cube; a Latin hypercube has one in each n-th of every side."""
    dice = np.random.default_rng(seed)
    if method == "random":
        return dice.random((n, dimensions))
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(dimensions, seed=dice).random(n))


def _values(distribution: Distribution, unit: Array) -> Sequence[float | int]:
    """The values below which the shares ``unit`` (n,) of ``distribution`` lie."""
    values = quantiles(distribution, unit)
    return [int(v) for v in np.rint(values)] if distribution.whole else [float(v) for v in values]


def quantiles(distribution: Distribution, unit: Array) -> Array:
    """Quantiles of ``distribution`` at the shares ``unit``, an array of any shape, before any rounding."""
    low, high = distribution.low, distribution.high
    if distribution.kind == "normal":
        from scipy.stats import truncnorm

        mean, sd = float(distribution.mean or 0.0), float(distribution.sd or 0.0)
        ends = [-np.inf if low is None else (low - mean) / sd, np.inf if high is None else (high - mean) / sd]
        return np.asarray(truncnorm.ppf(unit, *ends, loc=mean, scale=sd))
    if low is None or high is None:
        raise ValueError(f"a {distribution.kind} distribution has both ends")  # config.sweep has seen to it
    if distribution.kind == "log-uniform":
        return np.exp(np.log(low) + unit * np.log(high / low))
    return low + unit * (high - low)
