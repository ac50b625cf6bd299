"""Runs one specimen of a test: geometry, model, simulation, results, quality, with progress, log and checkpoints."""

import time as clock
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from math import nan

import numba
import numpy as np

from knittest.base.errors import NumericalError
from knittest.base.history import Cost, History, Overlaps, Quality, Specimen, equilibrium_numbers
from knittest.base.progress import Progress
from knittest.config.quality_checks import check_relaxed_limits
from knittest.config.run import Run
from knittest.fabric.cell import CellSpec, Munden
from knittest.kernels.threading import limit_threads
from knittest.laboratory.base import PreparedSpecimen, cut_curve_warnings
from knittest.laboratory.report_base import TESTS
from knittest.laboratory.restart import DAMPING, KINETIC, LIMITS, SPEED, check_speed, with_speed
from knittest.runs.checkpoints import Checkpoints, SpecimenKeeper
from knittest.solve.compilation import load_kernels
from knittest.solve.relaxed_cell import mesh_fault, with_loop_shortening, with_rest_spacing
from knittest.solve.state import SILENT, TESTING, Observer, SimulationCost, Snapshot, TooFastError

#: fact of a specimen: loop shortening [%]
LOOP_SHORTENING = "loop_shortening_pct"
#: quality of a specimen whose simulation ended early
NO_QUALITY = Quality(np.nan, np.nan, np.nan, np.nan, np.nan, False, ())
#: lowest share of the configured speed
SLOWEST = 0.1
#: elements below which a second thread costs more time than it saves
SERIAL_BELOW = 2000


def prepare(run: Run, specimen: int = 0, observer: Observer = SILENT) -> PreparedSpecimen:
    """Build model and rig of specimen number ``specimen``; raises :class:`InputError` if its loops lock."""
    drawn = with_loop_shortening(with_rest_spacing(run), _axial_share(run))
    prepared: PreparedSpecimen = TESTS[run.rig.kind].prepare(drawn, specimen, observer)
    stated = drawn.fabric.knitting.loop_shortening if run.model.scale == "meso" else None
    return prepared if stated is None else replace(prepared, facts=prepared.facts | {LOOP_SHORTENING: stated.value})


def threads_for(elements: int) -> int:
    """Number of threads for a model of ``elements``: one for a small model, else the configured number."""
    return 1 if elements < SERIAL_BELOW else numba.get_num_threads()


def run_specimen(run: Run, specimen: int = 0, observer: Observer = SILENT) -> Specimen:
    """Build, compile, simulate and measure specimen number ``specimen``.

    Where the speed is too high, some tests restart at a lower one (:mod:`knittest.laboratory.restart`). Raises
    :class:`NumericalError`, whose ``partial`` is the specimen up to the error.
    """
    start = clock.perf_counter(), clock.process_time()
    run = with_rest_spacing(run)
    lowered = LoweredSpeed(observer.speed_share())
    while True:
        try:
            return _run_at_speed(run, lowered, specimen, observer, start)
        except TooFastError as error:
            lowered = LoweredSpeed(max(lowered.share * error.share, SLOWEST), error.reason)
            observer.restarts(lowered.share, f"{error.reason}; restart at {lowered.share * run.solver.speed:.3g} m/s")


@dataclass(frozen=True)
class LoweredSpeed:
    """Share of the configured speed at which a specimen is run, and the ``reason`` for a share below 1."""

    share: float
    reason: str = ""

    @property
    def restarts(self) -> tuple[str, ...]:
        """Energy ratios that may lower the speed further."""
        if self.share <= SLOWEST:
            return ()
        return tuple(LIMITS) if self.share == 1.0 else (KINETIC, DAMPING)


def _run_at_speed(
    configured: Run, lowered: LoweredSpeed, specimen: int, observer: Observer, begun: tuple[float, float]
) -> Specimen:
    """Run a specimen at the speed of ``lowered``; ``begun``: wall and processor time [s] at the start of all tries."""
    run, (start, cpu) = with_speed(configured, lowered.share * configured.solver.speed), begun
    test = TESTS[run.rig.kind]
    lowers = (test.lowers_speed or run.pulls_loops) and run.model.scale == "meso"
    speed = {SPEED: run.solver.speed} if lowers else {}
    prepared = replace(prepare(run, specimen, observer), restarts=lowered.restarts if lowers else ())
    elements = len(prepared.model.mesh.cells)
    threads = threads_for(elements)
    compile_s = load_kernels(run, observer, threads)

    def made(history: History, cost: SimulationCost, results: dict[str, float], quality: Quality) -> Specimen:
        costs = Cost(
            clock.perf_counter() - start, clock.process_time() - cpu, compile_s, prepared.geometry_s, cost.steps,
            elements, cost.steps * elements / max(cost.advance_s, 1e-9), cost.threads or threads, 1e3 * cost.time_step,
        )  # fmt: skip
        rest = {}
        if history.rest is not None:
            shortening = prepared.facts.get(LOOP_SHORTENING)
            share = None if shortening is None else 0.01 * shortening
            munden = Munden.of(CellSpec.of(run.fabric), share or 0.0)
            rest = equilibrium_numbers(history.rest, munden.courses, munden.stitches, share)
        return Specimen(history, results, quality, costs, prepared.yarns, prepared.facts, rest)

    try:
        with limit_threads(threads):
            history, cost = test.solve(prepared, run, observer)
    except NumericalError as error:
        if isinstance(error.partial, tuple):
            history, cost = error.partial
            history = test.finish(run, prepared, history)
            results: dict[str, float] = dict(speed)
            with suppress(Exception):  # some pictures need results; some results need the end of the test
                results = test.results(run, prepared, history) | speed
            error.partial = made(history, cost, results, replace(NO_QUALITY, failures=(str(error),)))
        raise
    quality = check_relaxed_limits(run, test.assess(run, prepared, history, cost))
    if coarse := mesh_fault(run, _axial_share(run)):
        quality = quality.with_failed_check(coarse)
    quality = quality.with_warnings(*cut_curve_warnings(run))
    check_speed(run, prepared.restarts, quality)
    if lowered.share < 1.0:
        why = lowered.reason or "an energy ratio exceeded its limit"
        quality = quality.with_warnings(
            f"run at {run.solver.speed:.3g} m/s instead of {configured.solver.speed:g} m/s (solver.speed): {why}"
        )
    results = test.results(run, prepared, history) | speed
    return made(history, cost, results, quality)


def _axial_share(run: Run) -> float:
    """Share of the axial stiffness that yarns keep in tests without tension."""
    return getattr(run.rig, "membrane_share", None) or 1.0


#: writes a line of a run's log: the name of an event, and its fields by keyword
Log = Callable[..., None]


class Watcher(SpecimenKeeper):
    """Keeper that shows phases and progress under ``label`` and logs; ``until_failure``: a failure ends the test."""

    def __init__(
        self, store: Checkpoints, specimen: int, label: str, until_failure: bool, progress: Progress, log: Log
    ) -> None:
        super().__init__(store, specimen)
        self._label, self._until_failure, self._progress, self._log = label, until_failure, progress, log
        self._attempt = 1

    def phase(self, text: str) -> None:
        """Show the phase."""
        until_failure = self._until_failure and text == TESTING
        label = f"{self._label}, attempt {self._attempt}" if self._attempt > 1 else self._label
        self._progress.phase(f"{label}: {text}", until_failure=until_failure)

    def overlaps(self, found: Overlaps) -> None:
        """Log overlapping yarns."""
        if found.largest > 0.0:
            self._log(
                "overlap", number=self.specimen, contacts=found.count,
                largest_pct=round(100.0 * found.largest, 3), worst=found.worst,
            )  # fmt: skip

    def progress(self, fraction: float, time_ms: float, step_us: float, kinetic_ratio: float) -> None:
        """Show the progress."""
        self._progress.update(fraction, time_ms, step_us, kinetic_ratio)

    def relaxation_progress(self, fraction: float) -> None:
        """Show the progress."""
        self._progress.update(fraction, nan, nan, nan)

    def resume_from(self) -> Snapshot | None:
        """Return the newest checkpoint, and log it."""
        found = super().resume_from()
        if found is not None:
            self._log("goes on", number=self.specimen, at_ms=found.time)
        return found

    def report_resume(self, fraction: float, time_ms: float) -> None:
        """Print where the run is resumed."""
        self._progress.say(f"{self._label}: resumed at {time_ms:.4g} ms, {100.0 * fraction:.0f} % of the test")

    def restarts(self, share: float, reason: str = "") -> None:
        """End the attempt without a result, print the reason, and discard the checkpoints."""
        self._log("restart", number=self.specimen, share=share, reason=reason)
        self._attempt += 1
        self._progress.abandon_phase()
        self._progress.say(f"{self._label}: {reason}")
        super().restarts(share)
