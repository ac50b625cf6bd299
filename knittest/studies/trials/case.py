"""A test of a fabric as the file of a study gives it, and points drawn independently or as a Latin hypercube (McKay,
Beckman and Conover, 1979).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel

from knittest.base.errors import InputError
from knittest.base.history import Array
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
from knittest.config.studies import Chosen, Distribution, Sample
from knittest.config.yaml_loader import Document, KeyPath

#: fields of a block of a study's file, and where in a run they belong
FIELDS: dict[str, KeyPath] = {
    "parameters": ("parameters",),
    "scale": ("model", "scale"),
    "preset": ("model", "preset"),
    "direction": ("rig", "direction"),
}


@dataclass(frozen=True)
class Case:
    """One test of the fabric file ``fabric``."""

    name: str
    kind: str
    fabric: Path
    config: Path | None
    settings: tuple[Setting, ...]
    accept_limits: bool = False

    def run(self, settings: Sequence[Setting] = ()) -> Run:
        """The run with ``settings``; raises :class:`InputError` where the schema refuses them."""
        return resolve(
            test=self.kind, fabric=self.fabric, config=self.config, sets=[*self.settings, *settings],
            accept_limits=self.accept_limits,
        )  # fmt: skip


def fabric_path(chosen: Chosen, document: Document, at: KeyPath) -> Path:
    """The fabric file that the block ``at`` of ``document`` names; raises :class:`InputError` unless it is there."""
    where, said = document.where(at), ".".join(map(str, at))
    if (chosen.variant is None) == (chosen.fabric is None):
        raise InputError(f"{where}: {said}: expected variant (a shipped fabric) or fabric (a file), one of them")
    if chosen.fabric is not None:
        return existing(Path(document.source).resolve().parent / chosen.fabric, document.where((*at, "fabric")))
    try:
        return variant_path(str(chosen.variant))
    except InputError as error:
        raise InputError(f"{document.where((*at, 'variant'))}: {error}") from None


def existing(path: Path, where: str) -> Path:
    """``path``, if it is a file; raises :class:`InputError`."""
    if not path.is_file():
        raise InputError(f"{where}: no such file: {path}")
    return path


def settings_of(given: BaseModel, document: Document, at: KeyPath) -> list[Setting]:
    """Settings that the block ``given``, ``at`` in ``document``, makes: of :data:`FIELDS` and of its ``set``."""
    found = [
        Setting(path, value, document.where((*at, name)))
        for name, path in FIELDS.items()
        if (value := getattr(given, name, None)) is not None
    ]
    values: dict[str, Any] = getattr(given, "set", {})
    for name, value in values.items():
        where, path = document.where((*at, "set", name)), tuple(name.split("."))
        if not all(path):
            raise InputError(f"{where}: {name!r}: expected the dotted path of a field, for example rig.width")
        found.append(Setting(path, value, where))
    return found


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
        raise ValueError(f"a {distribution.kind} distribution has both ends")  # config.studies has seen to it
    if distribution.kind == "log-uniform":
        return np.exp(np.log(low) + unit * np.log(high / low))
    return low + unit * (high - low)
