"""Speed of a run that moves too fast: the test begins again, at the speed at which it passes.

The share of the kinetic energy goes with the square of the speed, that of the damping of contacts with the speed.
"""

from collections.abc import Callable, Mapping
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Quality
from knittest.config.run import Run
from knittest.laboratory.judging import losses
from knittest.solve.state import Simulation, TooFastError

Array = NDArray[np.float64]

#: result of a test that lowers its speed: the speed at which it was run
SPEED = "run_speed_m_per_s"
#: share of its limit to which a lower speed brings what was above it
AIM = 0.5


def at_speed(run: Run, speed: float) -> Run:
    """``run`` with ``solver.speed`` [m/s] replaced."""
    return run.model_copy(update={"solver": run.solver.model_copy(update={"speed": speed})})


def as_run(run: Run, results: Mapping[str, float | None]) -> Run:
    """``run`` at the speed of its ``results``, which is lower where the run lowered it itself."""
    return at_speed(run, results.get(SPEED) or run.solver.speed)


def check_speed(run: Run, quality: Quality) -> None:
    """Raise :class:`TooFastError` where ``quality`` passes at a lower speed."""
    _check(run, quality.ke_over_ie_max, quality.contact_damping_over_work_max)


def row_check(
    run: Run, column: str, least: float, counted: Callable[[Simulation, dict[str, Array]], dict[str, Array]]
) -> Callable[[Simulation], None]:
    """Check of the newest row, as :func:`check_speed`, once ``column`` of the curve has come to ``least``.

    ``counted`` gives the energies that count, of all that there are.
    """

    def check(state: Simulation) -> None:
        if state.rows[-1][column] < least:
            return
        rows = state.energy_rows
        energies = counted(state, {name: np.array([row[name] for row in rows]) for name in rows[-1]})
        _check(run, float(energies["kinetic_ratio"][-1]), float(losses(energies)[1][-1]))

    return check


def _check(run: Run, kinetic: float, damping: float) -> None:
    """Raise :class:`TooFastError` where one of both shares [-] is above its limit."""
    excess = 100.0 * kinetic / run.solver.max_kinetic_ratio, 100.0 * damping / run.solver.max_contact_damping
    if max(excess) > 1.0:
        raise TooFastError(min(1.0, sqrt(AIM / max(excess[0], AIM)), AIM / max(excess[1], AIM)))
