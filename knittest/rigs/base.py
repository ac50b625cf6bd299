"""What a rig is: boundary motion, stop rule and channels; it owns no time loop."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from knittest.models.boundary import Boundary, Readings

Array = NDArray[np.float64]


class Rig(Protocol):
    """Boundary motion, stop rule and channels of a virtual test."""

    duration: float  # longest time [ms]

    def constrain(self, boundary: Boundary) -> None:
        """Say what holds, moves and loads ``boundary.model``."""

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave of ``wave_speed`` [mm/ms] needs along the specimen."""

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Curve columns at ``time`` [ms] from the means of the last steps; needs strain_pct and force_n."""

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Whether the test is over, with the force and its peak [N] and whether anything has failed."""
