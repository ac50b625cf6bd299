"""A run and the same run at half its speed, or, without time, with half of the setting that decides the equilibrium."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from knittest.base.kinds import kinds, list_part
from knittest.config.run import Run

#: change of a result on halving the speed above which it depends on the speed [-]
LIMIT = 0.02


@dataclass(frozen=True)
class HalvedRun:
    """``half`` is ``run`` with ``setting`` halved from ``value``, in ``unit``."""

    run: Run
    half: Run
    setting: str
    value: float
    unit: str


def halve_setting(run: Run) -> HalvedRun:
    """Halve the speed, or the setting that the record of a test without time names."""
    field, unit = kinds()[run.rig.kind].halved.get(run.model.scale, ("solver.speed", "m/s"))
    part, _, name = field.partition(".")
    holder = getattr(run, part)
    value = getattr(holder, name)
    half = run.model_copy(update={part: holder.model_copy(update={name: 0.5 * value})})
    return HalvedRun(run, half, field, value, unit)


def diagnostic_results() -> tuple[str, ...]:
    """Results of all tests that describe the quality of a run; their changes are not evaluated."""
    return list_part("diagnostic")


def change(value: float | None, half: float | None) -> float:
    """Relative change from ``value`` to ``half``; NaN where one of them is not finite."""
    if value is None or half is None or not math.isfinite(value) or not math.isfinite(half):
        return math.nan
    return 0.0 if value == half else half / value - 1.0 if value else math.inf


def changes(results: Mapping[str, float], half: Mapping[str, float]) -> dict[str, float]:
    """:func:`change` of every result."""
    return {name: change(value, half.get(name)) for name, value in results.items()}
