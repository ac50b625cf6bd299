"""A run and the same at half its speed, or, where nothing moves, with half of what decides on rest; what changes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from knittest.base.kinds import kinds, listed
from knittest.config.run import Run

#: change of a result on halving the speed that says that it moves [-]
LIMIT = 0.02


@dataclass(frozen=True)
class Halving:
    """``half`` is ``run`` with ``setting`` halved from ``value``, in ``unit``."""

    run: Run
    half: Run
    setting: str
    value: float
    unit: str


def halving(run: Run) -> Halving:
    """Setting to halve: the speed, or the one that the record of a test that comes to rest names."""
    field, unit = kinds()[run.rig.kind].halved.get(run.model.scale, ("solver.speed", "m/s"))
    part, _, name = field.partition(".")
    return _halved(run, part, name, unit)


def diagnostic() -> tuple[str, ...]:
    """Results of all tests that say how well a run went, not what it found: their own changes say nothing."""
    return listed("diagnostic")


def change(value: float | None, half: float | None) -> float:
    """Share by which ``half`` differs from ``value``; NaN where one of them is not a number."""
    if value is None or half is None or not math.isfinite(value) or not math.isfinite(half):
        return math.nan
    return 0.0 if value == half else half / value - 1.0 if value else math.inf


def changes(results: Mapping[str, float], half: Mapping[str, float]) -> dict[str, float]:
    """:func:`change` of every result."""
    return {name: change(value, half.get(name)) for name, value in results.items()}


def _halved(run: Run, part: str, name: str, unit: str) -> Halving:
    holder = getattr(run, part)
    value = getattr(holder, name)
    half = run.model_copy(update={part: holder.model_copy(update={name: 0.5 * value})})
    return Halving(run, half, f"{part}.{name}", value, unit)
