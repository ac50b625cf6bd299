"""Fewer points for a curve that is read often."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def thin(x: Array, y: Array, tolerance: float) -> tuple[Array, Array]:
    """Points of y(x), (n,) each, whose chords stay within ``tolerance`` of all (Douglas & Peucker, 1973)."""
    keep = {0, len(x) - 1}
    spans = [(0, len(x) - 1)]
    while spans:
        a, b = spans.pop()
        inside = slice(a + 1, b)
        if b - a < 2:
            continue
        gap = np.abs(y[inside] - np.interp(x[inside], x[[a, b]], y[[a, b]]))
        if gap.max() > tolerance:
            worst = a + 1 + int(gap.argmax())
            keep.add(worst)
            spans += [(a, worst), (worst, b)]
    index = sorted(keep)
    return x[index], y[index]
