"""A test of a fabric as the file of a study states it, and points drawn independently or as a Latin hypercube (McKay,
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
from knittest.config.messages import number_path
from knittest.config.run import Run
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
from knittest.config.studies import Distribution, FabricChoice, Sample
from knittest.config.yaml_loader import Document, KeyPath, dotted_path

#: fields of a block of a study's file, and their paths in a run
FIELDS: dict[str, KeyPath] = {
    "parameters": ("parameters",),
    "scale": ("model", "scale"),
    "preset": ("model", "preset"),
    "direction": ("rig", "direction"),
}


@dataclass(frozen=True)
class Case:
    """One test of ``kind`` with the files ``fabric`` and ``config``; ``config`` may name the fabric."""

    name: str
    kind: str
    fabric: Path | None
    config: Path | None
    settings: tuple[Setting, ...]
    accept_limits: bool = False

    def run(self, settings: Sequence[Setting] = ()) -> Run:
        """Resolve the run with ``settings``; raises :class:`InputError` where the schema rejects them."""
        return resolve(
            test=self.kind, fabric=self.fabric, config=self.config, sets=[*self.settings, *settings],
            accept_limits=self.accept_limits,
        )  # fmt: skip


def fabric_path(chosen: FabricChoice, document: Document, at: KeyPath) -> Path:
    """Find the fabric file that the block ``at`` of ``document`` names; raises :class:`InputError` if it is missing."""
    where = document.place_of(at)
    if (chosen.variant is None) == (chosen.fabric is None):
        raise InputError(
            f"{where}: {dotted_path(at)}: expected variant (a shipped fabric) or fabric (a file), one of them"
        )
    if chosen.fabric is not None:
        return sibling_file(document, chosen.fabric, document.place_of((*at, "fabric")))
    return shipped_fabric(str(chosen.variant), document.place_of((*at, "variant")))


def shipped_fabric(variant: str, where: str) -> Path:
    """Find the file of the shipped fabric ``variant``; raises :class:`InputError` that begins with ``where``."""
    try:
        return variant_path(variant)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def sibling_file(document: Document, name: str, where: str) -> Path:
    """Find the file ``name`` in the folder of ``document``; raises :class:`InputError` that begins with ``where``."""
    path = Path(document.source).resolve().parent / name
    if not path.is_file():
        raise InputError(f"{where}: no such file: {path}")
    return path


def settings_of(given: BaseModel, document: Document, at: KeyPath) -> list[Setting]:
    """Read the settings of the block ``given``, ``at`` in ``document``: of :data:`FIELDS` and of its ``set``."""
    found = [
        Setting(path, value, document.place_of((*at, name)))
        for name, path in FIELDS.items()
        if (value := getattr(given, name, None)) is not None
    ]
    values: dict[str, Any] = getattr(given, "set", {})
    places = {name: document.place_of((*at, "set", name)) for name in values}
    return found + [Setting(field_path(name, places[name]), value, places[name]) for name, value in values.items()]


def field_path(name: str, where: str) -> KeyPath:
    """Split the dotted ``name`` into its key path; raises :class:`InputError`."""
    path = tuple(name.split("."))
    if not all(path):
        raise InputError(f"{where}: {name!r}: expected the dotted path of a field, for example rig.width")
    return path


def claim_path(claimed: dict[KeyPath, str], path: KeyPath, where: str) -> None:
    """Add ``path`` to the ``claimed`` ones; raises :class:`InputError` if one of them is the same or contains it."""
    for other, at in claimed.items():
        if path[: len(other)] == other[: len(path)]:
            raise InputError(f"{where}: {dotted_path(path)}: given twice, first at {at}: give it once")
    claimed[path] = where


def number_paths(
    names: Sequence[str], where: str, kinds: Sequence[str], claimed: dict[KeyPath, str]
) -> tuple[KeyPath, ...]:
    """Claim the key paths of ``names``, numbers of tests of ``kinds``; raises :class:`InputError`."""
    paths = tuple(number_path(name, where, kinds) for name in names)
    for path in paths:
        claim_path(claimed, path, where)
    return paths


#: digits of a value that is tried: enough for any use, few enough that a trial is found again
DIGITS = 8


def round_to_trial(value: float, low: float, high: float) -> float:
    """``value`` between ``low`` and ``high``, with as many digits as a trial has."""
    return float(f"{min(max(value, low), high):.{DIGITS}g}")


def draw_points(sample: Sample) -> list[tuple[float | int, ...]]:
    """Draw ``sample.n`` points with a value for each of ``sample.fields``, in their order; the seed decides all.

    A Latin hypercube has one point in each n-th of every side.
    """
    dice, size = np.random.default_rng(sample.seed), (sample.n, len(sample.fields))
    if sample.method == "random":
        unit = dice.random(size)
    else:
        from scipy.stats import qmc

        unit = np.asarray(qmc.LatinHypercube(size[1], seed=dice).random(size[0]))
    columns: list[list[Any]] = []
    for k, one in enumerate(sample.fields.values()):
        values = quantiles(one, unit[:, k])
        columns.append([int(v) for v in np.rint(values)] if one.whole else values.tolist())
    return list(zip(*columns, strict=True))


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
