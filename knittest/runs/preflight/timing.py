"""The time that a run will take, from timed steps of its own model."""

import time as clock
from dataclasses import dataclass

from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.kernels.threading import limited
from knittest.laboratory.base import Holder, Prepared
from knittest.models.boundary import Boundary
from knittest.models.readings import Readings
from knittest.runs.specimen import threads_for
from knittest.solve.observer import Observer
from knittest.solve.rig import Rig
from knittest.solve.simulate import simulate
from knittest.solve.warmup import warm

#: steps and seconds that are timed at least, and seconds after which no further sample is begun
STEPS, SECONDS, ENOUGH = 100, 0.5, 10.0


@dataclass(frozen=True)
class Estimate:
    """``steps`` expected of ``at_most``, seconds a step, ``timed`` steps that say so, on ``threads`` threads.

    ``specimens`` are run one after the other; ``prepared_s`` were spent before the first step, on what a cache did not
    hold of kernels and relaxed cells, and on the model; ``rest_s`` are spent before the first step of each
    specimen, mostly on its coming to rest.
    """

    steps: int
    at_most: int
    step_s: float
    timed: int
    threads: int
    specimens: int
    prepared_s: float
    rest_s: float = 0.0

    @property
    def seconds(self) -> float:
        """Seconds for all specimens: to come to rest, and the steps."""
        return (self.rest_s + self.steps * self.step_s) * self.specimens

    def text(self) -> str:
        """Estimate as a sentence."""
        all_of = f", {self.specimens} specimens" if self.specimens > 1 else ""
        return (
            f"about {rounded(self.seconds)} for {self.steps} steps expected{all_of}, {self.threads} "
            f"thread{'s' * (self.threads > 1)}, by {self.timed} timed steps of {1e3 * self.step_s:.3g} ms; before them "
            f"{rounded(self.prepared_s)} (what was compiled and relaxed is kept), after them pictures and page"
        )

    def as_json(self) -> dict[str, object]:
        """All of it, for a program."""
        return {
            "seconds": self.seconds, "steps_expected": self.steps, "steps_at_most": self.at_most,
            "seconds_per_step": self.step_s, "steps_timed": self.timed, "threads": self.threads,
            "specimens": self.specimens, "preparation_s": self.prepared_s, "rest_s": self.rest_s,
        }  # fmt: skip


class _Brief:
    """The ``rig``, ended as soon as enough steps are timed; ``times`` are those of its samples."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.duration, self.coordinate, self.force = rig.duration, rig.coordinate, rig.force
        self.averaged_from, self.marks = rig.averaged_from, rig.marks
        self.mounted_at, self.locks = 0.0, False  # a mounting takes as long a step as the test
        self.times: list[tuple[float, float]] = []  # simulated [ms], clock [s]

    def constrain(self, boundary: Boundary) -> None:
        self._rig.constrain(boundary)
        self.step = boundary.dt

    def ring_time(self, wave_speed: float) -> float:
        return self._rig.ring_time(wave_speed)

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        return self._rig.channels(time, readings)

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Over when the test is, or as soon as enough steps and seconds lie between two samples."""
        if len(self.times) < 2 or self._rig.finished(force, peak, broken):
            return len(self.times) >= 2
        spent = self.times[-1][1] - self.times[0][1]
        return spent >= ENOUGH or (self.timed >= STEPS and spent >= SECONDS)

    @property
    def timed(self) -> int:
        """Steps between the first sample and the last one."""
        return round((self.times[-1][0] - self.times[0][0]) / self.step)

    def before(self, start: float) -> float:
        """Seconds from ``start`` by the clock to the first step."""
        simulated, sampled = self.times[0]
        return max(sampled - start - simulated / self.step * self.step_s, 0.0)

    @property
    def step_s(self) -> float:
        """Seconds a step between them."""
        return (self.times[-1][1] - self.times[0][1]) / max(self.timed, 1)


class _Stopwatch(Observer):
    """Notes simulated time [ms] and clock [s] of each sample in ``times``."""

    def __init__(self, times: list[tuple[float, float]]) -> None:
        self._times = times

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Note a sample."""
        self._times.append((time_ms, clock.perf_counter()))


def estimate(run: Run, prepared: Prepared, prepared_s: float = 0.0) -> Estimate | None:
    """Time the first steps of ``prepared``, the model of ``run``; None for a strip that comes to rest, whose
    number of steps is not known beforehand.

    Compiles what the run needs, as the run itself would; ``prepared_s`` [s] is what its model took. The model has moved
    afterwards. Rows are at most :data:`STEPS` long, so that timing ends however many steps the run has.
    """
    if isinstance(prepared.mount, Holder):
        return None
    threads = threads_for(len(prepared.model.mesh.cells))
    compiled_s = warm(run, threads=threads)
    rig = _Brief(prepared.rig)
    rows = prepared.rig.duration / (run.solver.safety * prepared.model.critical_step * STEPS)
    output = run.output.model_copy(update={"samples": max(run.output.samples, round(rows))})
    with limited(threads):
        start = clock.perf_counter()
        simulate(prepared.model, rig, run.solver, output, _Stopwatch(rig.times))
    at_most = int(prepared.rig.duration / rig.step)
    steps = round(at_most * expected_share(run, prepared))
    return Estimate(
        steps, at_most, rig.step_s, rig.timed, threads, run.variability.specimens, prepared_s + compiled_s,
        rig.before(start),
    )  # fmt: skip


def expected_share(run: Run, prepared: Prepared) -> float:
    """Share of the rig's motion after which its specimen fails, 1 where none does, or nobody knows."""
    kind = kinds()[run.rig.kind]
    return float(kind.load("lasting")(run, prepared)) if kind.lasting else 1.0


def rounded(seconds: float) -> str:
    """Two digits are more than an estimate knows."""
    if seconds < 90.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 5400.0 else f"{seconds / 3600.0:.2g} h"
