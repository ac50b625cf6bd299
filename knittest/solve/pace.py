"""Threads of a run's steps: as many as make them short on the cores that are free now, found by trying."""

import time as clock
from collections import Counter
from collections.abc import Callable
from statistics import median

import numba

#: chunks of steps that each number of threads is tried with
TRIES = 3
#: times the best median beyond which one chunk is enough
HOPELESS = 3.0
#: times the least time that fewer threads may take: they leave cores to others
WORTH = 1.1
#: share of a run's time that trying may take, and seconds between two trials at least
SHARE, PAUSE = 0.05, 5.0


class Pace:
    """Chooses threads, ``most`` at most, anew every few seconds: what else runs on the machine changes.

    A thread that waits for its core holds up the others twice a step: two runs of four threads side by side on four
    cores took 2.0 to 2.2 times the time of two runs of one (measured). Results do not depend on the threads.
    """

    def __init__(self, most: int, now: Callable[[], float] = clock.perf_counter) -> None:
        self.threads = most
        self._choices = sorted({most >> k for k in range(most.bit_length())})
        self._now = now
        self._steps: Counter[int] = Counter()
        self._taken: dict[int, list[float]] = {}
        self._spent, self._next = 0.0, now()

    @property
    def usual_threads(self) -> int:
        """Threads that most of the steps so far were made with."""
        return self._steps.most_common(1)[0][0] if self._steps else self.threads

    def advance(self, step: Callable[[int], None], steps: int) -> None:
        """Call ``step`` for ``steps`` steps with the threads chosen; a single step is no trial."""
        trying = len(self._choices) > 1 and steps > 1 and self._now() >= self._next
        threads = self._next_untried() if trying else self.threads
        begun = self._now()
        numba.set_num_threads(threads)  # also for what is looked at between steps
        step(steps)
        self._steps[threads] += steps
        if trying:
            taken = self._now() - begun
            self._spent += taken
            self._taken.setdefault(threads, []).append(taken / steps)
            if not self._next_untried():
                self._choose()

    def _next_untried(self) -> int:
        """Next threads to try; 0 once all were."""
        least = min(map(median, self._taken.values()), default=0.0)
        for choice in self._choices:
            taken = self._taken.get(choice, [])
            if len(taken) < TRIES and not (taken and min(taken) > HOPELESS * least):
                return choice
        return 0

    def _choose(self) -> None:
        times = {choice: median(taken) for choice, taken in self._taken.items()}
        self.threads = min(choice for choice, taken in times.items() if taken <= WORTH * min(times.values()))
        self._next = self._now() + max(PAUSE, self._spent / SHARE)
        self._taken, self._spent = {}, 0.0
