"""One specimen of a test end to end: geometry, model, simulation, results, quality."""

import time as clock
from contextlib import suppress
from dataclasses import dataclass, replace

import numba
import numpy as np

from knittest.base.errors import NumericalError
from knittest.base.history import Cost, History, Quality, Specimen
from knittest.base.rest import rest_numbers
from knittest.config.gates import limits_judged
from knittest.config.run import Run
from knittest.fabric.cell import CellSpec
from knittest.fabric.munden import Munden
from knittest.kernels.threading import limited
from knittest.laboratory.base import Prepared, cut_curve_warnings
from knittest.laboratory.lowered_speed import KINETIC, LIMITS, SPEED, at_speed, check_speed
from knittest.laboratory.registry import TESTS
from knittest.solve.observer import SILENT, Observer
from knittest.solve.settled_cell import too_coarse, with_draw_in
from knittest.solve.state import SimulationCost, TooFastError
from knittest.solve.warmup import warm

#: fact of a specimen: draw-in of its loops [-]
DRAWN = "draw_in"
#: quality of a specimen whose simulation did not come to its end
UNJUDGED = Quality(np.nan, np.nan, np.nan, np.nan, np.nan, False, ())
#: lowest share of the configured speed
SLOWEST = 0.1
#: elements below which a second thread costs more than it brings
SERIAL_BELOW = 2000


def prepare(run: Run, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
    """Build model and rig of specimen number ``specimen``; raises :class:`InputError` where its loops lock."""
    drawn = with_draw_in(run, _axial_share(run))
    prepared: Prepared = TESTS[run.rig.kind].prepare(drawn, specimen, observer)
    draw_in = drawn.fabric.knitting.draw_in_fraction if run.model.scale == "meso" else None
    return prepared if draw_in is None else replace(prepared, facts=prepared.facts | {DRAWN: draw_in})


def threads_for(elements: int) -> int:
    """Number of threads for a model of ``elements``: one for a small one, else those that were set."""
    return 1 if elements < SERIAL_BELOW else numba.get_num_threads()


def run_specimen(run: Run, specimen: int = 0, observer: Observer = SILENT) -> Specimen:
    """Build, compile, simulate and measure specimen number ``specimen``.

    A test that lowers its speed restarts where it is too high (:mod:`knittest.laboratory.lowered_speed`). Raises
    :class:`NumericalError`, whose ``partial`` is the specimen up to then.
    """
    start = clock.perf_counter(), clock.process_time()
    lowered = Lowered(observer.speed_share())
    while True:
        try:
            return _run_at(run, lowered, specimen, observer, start)
        except TooFastError as error:
            lowered = Lowered(max(lowered.share * error.share, SLOWEST), error.reason)
            observer.restarts(lowered.share, f"{error.reason}; restart at {lowered.share * run.solver.speed:.3g} m/s")


@dataclass(frozen=True)
class Lowered:
    """Share of the configured speed at which a specimen is run, and the ``reason`` where it is below 1."""

    share: float
    reason: str = ""

    @property
    def restarts(self) -> tuple[str, ...]:
        """Shares of energies by which the speed may be lowered further."""
        if self.share <= SLOWEST:
            return ()
        return tuple(LIMITS) if self.share == 1.0 else (KINETIC,)


def _run_at(
    configured: Run, lowered: Lowered, specimen: int, observer: Observer, begun: tuple[float, float]
) -> Specimen:
    """:func:`run_specimen` at the speed of ``lowered``; ``begun`` are the times of the clock and of the processor [s]
    at the start. Raises :class:`TooFastError` if the speed may be lowered further.
    """
    run, (start, cpu) = at_speed(configured, lowered.share * configured.solver.speed), begun
    test = TESTS[run.rig.kind]
    lowers = test.lowers_speed and run.model.scale == "meso"
    speed = {SPEED: run.solver.speed} if lowers else {}
    prepared = replace(prepare(run, specimen, observer), restarts=lowered.restarts if lowers else ())
    elements = len(prepared.model.mesh.cells)
    threads = threads_for(elements)
    compile_s = warm(run, observer, threads)

    def made(history: History, cost: SimulationCost, results: dict[str, float], quality: Quality) -> Specimen:
        spent = clock.perf_counter() - start, clock.process_time() - cpu
        costs = _cost(cost, elements, spent, compile_s, prepared, threads)
        rest = _rest(run, prepared, history)
        return Specimen(history, results, quality, costs, prepared.yarns, prepared.facts, rest)

    try:
        with limited(threads):
            history, cost = test.solve(prepared, run, observer)
    except NumericalError as error:
        if isinstance(error.partial, tuple):
            history, cost = error.partial
            history = test.finish(run, prepared, history)
            results: dict[str, float] = dict(speed)
            with suppress(Exception):  # pictures read some; others need the end of the test
                results = test.results(run, prepared, history) | speed
            error.partial = made(history, cost, results, replace(UNJUDGED, failures=(str(error),)))
        raise
    quality = _assessed(run, prepared, history, cost)
    check_speed(run, prepared.restarts, quality)
    if lowered.share < 1.0:
        why = lowered.reason or "a share of the energies exceeded its limit"
        quality = quality.warning(
            f"run at {run.solver.speed:.3g} m/s instead of {configured.solver.speed:g} m/s (solver.speed): {why}"
        )
    results = test.results(run, prepared, history) | speed
    return made(history, cost, results, quality)


def _rest(run: Run, prepared: Prepared, history: History) -> dict[str, float]:
    """Numbers of the state of rest that yarns started from; none of shells."""
    if history.rest is None:
        return {}
    draw_in = prepared.facts.get(DRAWN)
    munden = Munden.of(CellSpec.of(run.fabric), draw_in or 0.0)
    return rest_numbers(history.rest, munden.courses, munden.stitches, draw_in)


def _assessed(run: Run, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
    """Gates of the test, its limits and the mesh its yarns settled on, and warnings of what its material leaves out."""
    quality = limits_judged(run, TESTS[run.rig.kind].assess(run, prepared, history, cost))
    if reason := too_coarse(run, _axial_share(run)):
        quality = quality.refusing(reason)
    return replace(quality, warnings=(*quality.warnings, *cut_curve_warnings(run)))


def _axial_share(run: Run) -> float:
    """Share of their axial stiffness that yarns keep in tests that pull none."""
    return getattr(run.rig, "membrane_share", None) or 1.0


def _cost(
    cost: SimulationCost,
    elements: int,
    spent: tuple[float, float],
    compile_s: float,
    prepared: Prepared,
    threads: int,
) -> Cost:
    speed = cost.steps * elements / max(cost.advance_s, 1e-9)
    used = cost.threads or threads
    return Cost(*spent, compile_s, prepared.geometry_s, cost.steps, elements, speed, used, 1e3 * cost.time_step)
