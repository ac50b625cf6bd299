"""Force of an inlay that slides through its crossings: F = mu sum N over those that still hold it.

With equal crossings a pitch apart the force falls with the embedded length: F = mu N (length / pitch). A wavy inlay
meets its own wave again a pitch on, so that means are over whole pitches.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from knittest.base.history import Array

#: travel of the free end [mm] from which the whole inlay slides; rows in a moving mean
SLIDES, SMOOTH = 0.05, 5
#: pitches that stay embedded
LEFT = 1.0


@dataclass(frozen=True)
class SlidingForces:
    """Forces [N] at the begin of sliding, largest, mean over whole pitches; friction of a crossing [N]; slide [mm]."""

    force_at_rest: float
    peak: float
    mean: float
    per_crossing: float
    way: float


def evaluate_sliding(curve: Mapping[str, Array], pitch: float) -> SlidingForces:
    """Evaluate ``curve`` (pull_force_n, tail_travel_mm, embedded_mm) with crossings ``pitch`` [mm] apart."""
    tail, force = curve["tail_travel_mm"], _smooth(curve["pull_force_n"])
    before = tail <= SLIDES + 0.5 * pitch
    peak = float(force[before].max()) if before.any() else float("nan")
    slides = tail >= SLIDES
    at_rest = float(force[np.argmax(slides)]) if slides.any() else float("nan")
    way = float(tail.max()) - SLIDES
    pitches = int(way / pitch + 1e-6)
    if pitches < 1:
        return SlidingForces(at_rest, peak, float("nan"), float("nan"), max(way, 0.0))
    places = np.linspace(tail.max() - pitches * pitch, tail.max(), 200 * pitches + 1)
    late = np.maximum.accumulate(tail)
    first = np.append(True, np.diff(late) > 0.0)
    along, left = (np.interp(places, late[first], values[first]) for values in (force, curve["embedded_mm"]))
    held = np.maximum(left / pitch, 1e-9)
    return SlidingForces(at_rest, peak, float(along.mean()), float(along.sum() / held.sum()), way)


def _smooth(values: Array) -> Array:
    """Moving mean with the ends as they are: single chunks hold the ringing of contacts."""
    if len(values) < SMOOTH:
        return values
    padded = np.pad(values, SMOOTH // 2, mode="edge")
    return np.convolve(padded, np.full(SMOOTH, 1.0 / SMOOTH), "valid")
