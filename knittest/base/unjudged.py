"""Largest forces that lie beyond the first failure, up to which the gates judge: which specimens, and where."""

from collections.abc import Mapping, Sequence

import numpy as np

from knittest.base.history import History
from knittest.base.summary import Unjudged


def peaks_beyond(histories: Sequence[History], coordinate: str, peaks: Sequence[float]) -> Unjudged | None:
    """Specimens of ``histories`` whose largest force, at ``peaks`` of the ``coordinate`` [%] of their curves, comes
    after the first failure; None if there is none.
    """
    failures = [_first_failure(history, coordinate) for history in histories]
    beyond = [(at, peak) for at, peak in zip(failures, peaks, strict=True) if peak > at]
    if not beyond:
        return None
    first, last = zip(*beyond, strict=True)
    return {"specimens": len(histories), "first_failure_pct": list(first), "peak_pct": list(last)}


def _first_failure(history: History, coordinate: str) -> float:
    """Coordinate [%] of the sample at which the first failure was seen; infinite where nothing failed."""
    if history.first_failure is None:
        return float("inf")
    when = history.energies["time_ms"][history.first_failure]
    return float(np.interp(when, history.curve["time_ms"], history.curve[coordinate]))


def unjudged_note(found: Mapping[str, object] | None) -> str:
    """Sentence on ``unjudged`` of summary.json; empty without, and where both strains are the same to two digits."""
    if not found:
        return ""
    first, peak = (_range(found.get(name)) for name in ("first_failure_pct", "peak_pct"))
    if not first or not peak or first == peak:
        return ""
    count, of = len(found["peak_pct"]), found["specimens"]  # type: ignore[arg-type]
    lies = "the peak lies" if of == 1 else f"the peaks of {count} of {of} specimens lie"
    return f"gates judged up to the first failure, at {first} % strain; {lies} beyond it, at {peak} %"


def _range(values: object) -> str:
    """``0.85`` of one number, ``0.80 to 0.92`` of several."""
    if not isinstance(values, Sequence) or not values:
        return ""
    low, high = f"{min(values):.2f}", f"{max(values):.2f}"
    return low if low == high else f"{low} to {high}"
