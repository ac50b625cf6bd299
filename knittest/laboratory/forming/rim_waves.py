"""Waves along the rim of a drawn blank, which a flange that lifts, tilts or dishes as a whole does not have."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: heights are means over this length of the rim [mm]: single yarn ends stand off by themselves
WINDOW = 8.0


@dataclass(frozen=True)
class RimWaves:
    """``height`` (n,) [mm] of the rim over the paraboloid that fits it best; ``count`` of crests whose prominence is
    above a limit; ``largest`` [mm] height of one of them over the higher of the troughs on either side of it, up to the
    next of them, or the whole range where none counts.
    """

    height: Array
    largest: float
    count: int


def rim_waves(start: Array, rise: Array, least: float) -> RimWaves:
    """Waves of the rim of a flat blank at ``start`` (n, 2) [mm], in order round it, risen by ``rise`` (n,) [mm].

    Crests count from a prominence of ``least`` [mm].
    """
    from scipy.signal import find_peaks

    size = np.abs(start).max()
    x, y = start.T / size
    surface = np.column_stack([np.ones_like(x), x, y, x * x, x * y, y * y])
    over = rise - surface @ np.linalg.lstsq(surface, rise, rcond=None)[0]
    height = _mean(start, over)
    # the rim is closed: begin and end in its deepest trough
    low = int(np.argmin(height))
    profile = np.append(np.roll(height, -low), height[low])
    crests = find_peaks(profile, prominence=least)[0]
    if not len(crests):
        return RimWaves(height, float(np.ptp(profile)), 0)
    troughs = np.minimum.reduceat(profile, np.append(0, crests))
    over = profile[crests] - np.maximum(troughs[:-1], troughs[1:])
    return RimWaves(height, float(over.max()), len(crests))


def _mean(start: Array, value: Array) -> Array:
    """Mean of ``value`` (n,) over :data:`WINDOW` along the closed rim."""
    steps = np.linalg.norm(np.diff(start, axis=0, append=start[:1]), axis=1)
    way, length = np.append(0.0, np.cumsum(steps[:-1])), float(steps.sum())
    apart = np.abs(way[:, None] - way)
    near = np.minimum(apart, length - apart) <= 0.5 * WINDOW
    mean: Array = near @ value / near.sum(axis=1)
    return mean
