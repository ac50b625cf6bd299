"""Observer of a simulation: told what begins and how far it is, asked where to go on and whether to keep its state."""

from collections.abc import Callable

from knittest.base.history import Overlaps
from knittest.solve.state import Snapshot

#: phase in which the rig moves
TESTING = "running the test"


class Observer:
    """Watches nothing and keeps nothing; one that does overrides what it wants to hear of.

    A simulation calls it and goes on as it is told; what is observed never changes the numbers.
    """

    def phase(self, text: str) -> None:
        """Hear what begins that takes time, ``compiling kernels``."""

    def overlaps(self, found: Overlaps) -> None:
        """Hear which yarns overlap before anything moves."""

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Hear the share done (0 to 1), simulated time [ms], time step [us] and kinetic energy over work [-]."""

    def settling(self, fraction: float) -> None:
        """Hear the share (0 to 1) done of what brings the specimen to rest, in which no time passes."""

    def resume_from(self) -> Snapshot | None:
        """Return the state to go on from; None to start."""
        return None

    def resumed(self, fraction: float, time_ms: float) -> None:
        """Hear where it goes on: share of the test (0 to 1), simulated time [ms]."""

    def speed_share(self) -> float:
        """Return the share of ``solver.speed`` of the state to resume from; 1 if there is none."""
        return 1.0

    def restarts(self, share: float, reason: str) -> None:
        """Hear that the test restarts at ``share`` of ``solver.speed`` and why, and discard its state."""

    def visit(self, take: Callable[[], Snapshot]) -> None:
        """See the state after a chunk of steps, taken if wanted; may raise to stop the simulation."""

    def failed(self, take: Callable[[], Snapshot]) -> None:
        """See the state in which the numbers have gone wrong."""


#: watches nothing
SILENT = Observer()
