"""Speed of a run that moves too fast: the test begins again, at the speed at which it passes.

The share of the kinetic energy goes with the square of the speed, those of damping with the speed.
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
    _check(run, quality.ke_over_ie_max, quality.damping_over_work_max, quality.contact_damping_over_work_max)


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
        damping, of_contacts, _ = losses(energies)
        _check(run, float(energies["kinetic_ratio"][-1]), float(damping[-1]), float(of_contacts[-1]))

    return check


def _check(run: Run, kinetic: float, damping: float, of_contacts: float) -> None:
    """Raise :class:`TooFastError` where one of the shares [-] is above its limit."""
    limits = run.solver
    excess = 100.0 * kinetic / limits.max_kinetic_ratio
    linear = 100.0 * max(damping / limits.max_damping, of_contacts / limits.max_contact_damping)
    if max(excess, linear) > 1.0:
        raise TooFastError(min(1.0, sqrt(AIM / max(excess, AIM)), AIM / max(linear, AIM)))
