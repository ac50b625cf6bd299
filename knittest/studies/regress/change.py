"""A change of a number, of the crests of buckles, or of a curve, and the limit it has."""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Change:
    """One number, or the point of the curve that changed most: as stored (NaN: not), now, and the change [-] it may
    have; of crests ``change`` and ``limit`` are those beyond ``counted``, the least and greatest of the stored runs.
    """

    what: str
    stored: float
    now: float
    change: float
    limit: float
    counted: tuple[int, int] | None = None

    @property
    def passed(self) -> bool:
        """Tell whether the change is within its limit; one that is no number is not."""
        return abs(self.change) <= self.limit

    @property
    def used(self) -> float:
        """Share [-] of the limit that the change uses."""
        if not math.isfinite(self.change):
            return math.inf
        if self.limit > 0.0:
            return abs(self.change) / self.limit
        return 0.0 if self.change == 0.0 else math.inf

    def __str__(self) -> str:
        if math.isnan(self.stored):
            return f"{self.what}: {self.now:.6g} now, no value in the baseline"
        if self.counted is not None:
            low, high = self.counted
            stored = f"{low}" if low == high else f"{low} to {high}"
            return f"{self.what}: {stored} stored, {self.now:g} now ({self.change:+g}, limit {self.limit:g} crest)"
        return (
            f"{self.what}: {self.stored:.6g} stored, {self.now:.6g} now ({100.0 * self.change:+.3g} %, "
            f"limit {100.0 * self.limit:.3g} %)"
        )


def of_number(name: str, stored: float, now: float, limit: float) -> Change:
    """Change of a number over its stored value."""
    if stored == 0.0:
        return Change(name, stored, now, 0.0 if now == 0.0 else math.inf, limit)
    return Change(name, stored, now, (now - stored) / abs(stored), limit)


def of_crests(name: str, stored: float, now: float, counted: tuple[int, int], limit: float) -> Change:
    """Change of a number of crests beyond those ``counted`` in the stored runs."""
    return Change(name, stored, now, float(now - np.clip(now, *counted)), limit, counted)


def of_new(name: str, now: float) -> Change:
    """Change of a number that has a value now and none in the baseline."""
    return Change(name, math.nan, now, math.nan, 0.0)
