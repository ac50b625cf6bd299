"""Interface of a rig: boundary motion, stop rule and channels; it owns no time loop."""

from typing import Protocol

from knittest.models.boundary import Boundary
from knittest.models.readings import Readings


class Rig(Protocol):
    """Boundary motion, stop rule and channels of a virtual test."""

    duration: float  # longest time [ms]
    coordinate: str  # column of the curve that says how far the test has come
    force: str  # column of the force whose peak is kept
    mounted_at: float  # time [ms] until which the specimen is mounted; it comes to rest then, and energies start
    locks: bool  # ends where yarns lock, see :data:`knittest.solve.simulate.LOCKED`
    averaged_from: float  # time [ms] from which the tools' forces on the nodes are averaged
    marks: tuple[float, ...]  # shares of the duration at which frames are wanted besides even ones

    def constrain(self, boundary: Boundary) -> None:
        """Say what holds, moves and loads ``boundary.model``."""

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave of ``wave_speed`` [mm/ms] needs along the specimen."""

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """Curve columns at ``time`` [ms] from the means of the last steps."""

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Tell whether the test is over, with the force and its peak [N] and whether anything has failed."""
