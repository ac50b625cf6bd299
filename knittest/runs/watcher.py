"""Watches a specimen for the user, who sees how far it is, and for its folder, which logs and keeps it."""

from collections.abc import Callable
from math import nan

from knittest.base.history import Overlaps
from knittest.base.progress import Progress
from knittest.runs.checkpoints import SpecimenKeeper
from knittest.solve.observer import TESTING, Observer
from knittest.solve.state import Snapshot

#: takes a line of a run's log: the name of an event, and its fields by keyword
Log = Callable[..., None]


class Watcher(Observer):
    """See :class:`Observer`; ``label`` is what phases are shown under, ``until_failure`` whether a failure of the
    specimen ends its test, ``log`` takes lines of the run's log.
    """

    def __init__(self, label: str, until_failure: bool, progress: Progress, log: Log, keeper: SpecimenKeeper) -> None:
        self._label, self._until_failure = label, until_failure
        self._progress, self._log, self._keeper = progress, log, keeper

    def phase(self, text: str) -> None:
        """Show it."""
        until_failure = self._until_failure and text == TESTING
        self._progress.phase(f"{self._label}: {text}", until_failure=until_failure)

    def overlaps(self, found: Overlaps) -> None:
        """Log which yarns overlap, if any do."""
        if found.largest > 0.0:
            self._log(
                "overlap", number=self._keeper.specimen, contacts=found.count,
                largest_pct=round(100.0 * found.largest, 3), worst=found.worst,
            )  # fmt: skip

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Show it."""
        self._progress.update(fraction, time_ms, step_us, kinetic_ratio)

    def settling(self, fraction: float) -> None:
        """Show it."""
        self._progress.update(fraction, nan, nan, nan)

    def resume_from(self) -> Snapshot | None:
        """Return the checkpoint that was found, and log it."""
        found = self._keeper.resume_from()
        if found is not None:
            self._log("goes on", number=self._keeper.specimen, at_ms=found.time)
        return found

    def resumed(self, fraction: float, time_ms: float) -> None:
        """Tell the user."""
        self._progress.say(f"{self._label}: goes on at {time_ms:.4g} ms, {100.0 * fraction:.0f} % of the test")

    def speed_share(self) -> float:
        """Return that of the newest checkpoint."""
        return self._keeper.speed_share()

    def restarts(self, share: float, reason: str) -> None:
        """Tell the user, and discard the checkpoints."""
        self._log("restart", number=self._keeper.specimen, share=share, reason=reason)
        self._progress.say(f"{self._label}: {reason}")
        self._keeper.restarts(share)

    def visit(self, take: Callable[[], Snapshot]) -> None:
        """Write a checkpoint when it is due; raise for a signal."""
        self._keeper.visit(take)

    def failed(self, take: Callable[[], Snapshot]) -> None:
        """Write the state as it is."""
        self._keeper.failed(take)
