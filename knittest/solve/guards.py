"""Checks that stop a run within one chunk, and name the fault and its time."""

from collections.abc import Callable
from math import isfinite

import numpy as np

from knittest.base.errors import NumericalError
from knittest.solve.state import Simulation

#: kinetic energy over the work done, plus the second times the energy of the specimen at clamp speed, above which the
#: solution diverges: a specimen that tears turns at most all of the work into motion
BLOW_UP, BLOW_UP_START = 2.0, 20.0
#: share of the longest stable step with which a run continues, and the least step over that of the start
MARGIN, LEAST_SHARE = 0.9, 0.1
#: energy error over work before any failure that stops a run, and the error that stops it when energy is made from
#: nothing; evaluated once the work is this many times the kinetic energy of the specimen at clamp speed
STOP_ENERGY_ERROR, STOP_ENERGY_GAIN, START_UP_WORK = 0.10, 0.05, 20.0


def check_motion(run: Simulation, work: float, released: Callable[[], float]) -> None:
    """Raise :class:`NumericalError` if the motion is not finite, or holds much more than the ``work`` done [mJ].

    ``released`` [mJ], asked for where the work does not explain the motion, is what the specimen had stored at the
    start and no longer has: a piece that creeps to rest moves by it before anything is done to it.
    """
    # a sum sees any number in it that is not finite; the search for contacts would read beyond its cells
    if not (isfinite(run.kinetic) and isfinite(run.model.nodes.position.sum())):
        raise NumericalError(
            f"the state is not finite at {run.time:.5f} ms, first at {_first_invalid_node(run)}; reduce "
            f"solver.safety or "
            "solver.speed"
        )
    limit = BLOW_UP * abs(work) + BLOW_UP_START * run.kinetic_scale
    if run.kinetic > limit and run.kinetic > limit + BLOW_UP * max(released(), 0.0):
        velocity = run.model.nodes.velocity[:, : run.model.n_nodes]
        fastest = int(np.argmax(np.sum(velocity**2, axis=0) * run.model.mass))
        raise NumericalError(
            f"the solution diverges at {run.time:.5f} ms: kinetic energy {run.kinetic:.3g} mJ, work {work:.3g} mJ, "
            f"fastest at node {fastest} of {run.model.name_of(fastest)}; reduce solver.safety or solver.speed"
        )


def check_entities(run: Simulation) -> None:
    """Raise :class:`NumericalError` if an element, a node or a contact of the model is invalid."""
    if fault := run.model.diagnose(run.dt):
        what, _, remedy = fault.partition("; ")  # the model's own, else what helps most
        raise NumericalError(f"{what} at {run.time:.5f} ms; {remedy or 'reduce solver.safety or solver.speed'}")


def fit_step(run: Simulation) -> None:
    """Shorten the time step where the present state bears less; raises :class:`NumericalError` below a least share."""
    longest, where = run.model.stable_step()
    if longest >= run.dt:
        return
    share = MARGIN * longest / run.dt
    if share * run.step_share < LEAST_SHARE:
        raise NumericalError(
            f"{where} limit the critical time step to {1e3 * longest:.3g} us at {run.time:.5f} ms, below "
            f"{100.0 * LEAST_SHARE:g} % of the first step of {1e3 * run.first_step:.3g} us"
        )
    run.shorten(share)
    run.cost.time_step = run.dt


def check_balance(run: Simulation) -> None:
    """Raise :class:`NumericalError` if, before anything failed, the newest row of the energies does not balance."""
    newest = run.energy_rows[-1]
    if abs(newest["external_mj"]) <= START_UP_WORK * run.kinetic_scale or run.model.count_failed().any():
        return
    made = newest["balance_error_mj"] < 0.0
    limit = STOP_ENERGY_GAIN if made else STOP_ENERGY_ERROR
    if newest["energy_error"] > limit:
        what = "energy is created" if made else "energy is lost"
        remedy = (run.rest.advice if run.rest else "") or "reduce solver.safety or solver.speed"
        raise NumericalError(
            f"the energy balance error of {100.0 * newest['energy_error']:.0f} % at {run.time:.4f} ms, before any "
            f"failure, exceeds {100.0 * limit:g} % ({what}); {remedy}"
        )


def _first_invalid_node(run: Simulation) -> str:
    n = run.model.n_nodes
    state = np.vstack([run.model.nodes.position[:, :n], run.model.nodes.velocity[:, :n], run.model.nodes.spin[:, :n]])
    bad = np.flatnonzero(~np.isfinite(state).all(axis=0))
    return f"node {bad[0]} of {run.model.name_of(int(bad[0]))}" if len(bad) else "a force"
