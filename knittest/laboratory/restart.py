"""Part of a test after its specimen has come to rest in the rig, and the restart at a lower speed."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import sqrt

import numpy as np

from knittest.base.history import Array, History, Quality
from knittest.config.run import Run
from knittest.laboratory.quality_checks import LEAST_WORK, kinetic_ratios, loss_ratios
from knittest.solve.state import Simulation, TooFastError

#: columns of the energies that are not accumulated
INSTANTANEOUS_COLUMNS = ("time_ms", "kinetic_mj", "kinetic_ratio", "energy_error")


def history_from_time(history: History, begin: float) -> History:
    """``history`` from the time ``begin`` [ms] on: energies and losses count from the last row before it."""
    energies = history.energies
    start = max(int(np.searchsorted(energies["time_ms"], begin, side="right")) - 1, 0)
    later = slice(min(start + 1, len(energies["time_ms"]) - 1), None)
    counted = {
        name: values[later] - (0.0 if name in INSTANTANEOUS_COLUMNS else values[start])
        for name, values in energies.items()
    }
    curve_from = history.curve["time_ms"] >= begin
    if not curve_from.any():
        curve_from[-1] = True
    failure = history.first_failure
    elastic = sum(v for name, v in counted.items() if name.startswith("internal_"))
    spent = elastic + counted["contact_mj"] + counted["hourglass_mj"] + counted["friction_mj"]
    work = np.abs(counted["external_mj"])
    largest = np.maximum(work, np.concatenate([[0.0], work[:-1]]))
    counted["kinetic_ratio"] = counted["kinetic_mj"] / np.maximum(spent, LEAST_WORK)
    counted["energy_error"] = np.abs(counted["balance_error_mj"]) / np.maximum(largest, LEAST_WORK)
    return replace(
        history,
        curve={name: values[curve_from] for name, values in history.curve.items()},
        energies=counted,
        contacts={name: values[later] for name, values in history.contacts.items()},
        first_failure=None if failure is None else max(failure - later.start, 0),
    )


# Restart of a test at a lower speed, when an energy ratio exceeds its limit. Kinetic energy grows with the square of
# the speed, damping about with the speed. Damping of contacts of coarse beams falls little: it lowers the speed once.

#: result of a test that lowers its speed: the speed of the test
SPEED = "run_speed_m_per_s"
#: share of its limit that a ratio has at the lower speed
TARGET_SHARE = 0.5
#: energy ratios that depend on the speed, and their limits; the first one grows with its square
KINETIC, DAMPING, CONTACTS = "kinetic energy", "damping", "damping of contacts"
LIMITS = {KINETIC: "max_kinetic_ratio", DAMPING: "max_damping", CONTACTS: "max_contact_damping"}


def with_speed(run: Run, speed: float) -> Run:
    """``run`` with ``solver.speed`` [m/s] replaced."""
    return run.model_copy(update={"solver": run.solver.model_copy(update={"speed": speed})})


def with_result_speed(run: Run, results: Mapping[str, float | None]) -> Run:
    """``run`` at the speed of its ``results``, lower after a restart."""
    return with_speed(run, results.get(SPEED) or run.solver.speed)


def has_configured_speed(run: Run, results: Mapping[str, float | None]) -> bool:
    """Tell whether the test of ``run`` with the ``results`` did not restart at a lower speed."""
    return (results.get(SPEED) or run.solver.speed) == run.solver.speed


def check_speed(run: Run, restarts: tuple[str, ...], quality: Quality) -> None:
    """Raise :class:`TooFastError` where ``quality`` fails by the ratios ``restarts`` alone."""
    shares = {
        KINETIC: quality.ke_over_ie_max, DAMPING: quality.damping_over_work_max,
        CONTACTS: quality.contact_damping_over_work_max,
    }  # fmt: skip
    above = [name for name, share in shares.items() if 100.0 * share > getattr(run.solver, LIMITS[name])]
    if len(quality.failures) <= len(above):
        _check_shares(run, restarts, shares)


def make_row_check(
    run: Run,
    restarts: tuple[str, ...],
    column: str,
    least: float,
    evaluated: Callable[[Simulation, dict[str, Array]], dict[str, Array]] = lambda state, energies: energies,
) -> Callable[[Simulation], None]:
    """Make the check of rows from ``least`` of the curve's ``column`` on; ``evaluated`` leaves out energies."""

    def check(state: Simulation) -> None:
        if not restarts or state.rows[-1][column] < least:
            return
        row = {name: np.array([value]) for name, value in state.energy_rows[-1].items()}
        energies = evaluated(state, row)
        left_out = float(row["external_mj"][0] - energies["external_mj"][0])
        work = max(abs(one["external_mj"] - left_out) for one in state.energy_rows)
        energies |= {"external_mj": np.array([work])}
        damping, of_contacts, _ = loss_ratios(energies)
        shares = {KINETIC: kinetic_ratios(run, energies)[-1], DAMPING: damping[-1], CONTACTS: of_contacts[-1]}
        _check_shares(run, restarts, {name: float(share) for name, share in shares.items()})

    return check


def check_ringing(restarts: tuple[str, ...], error: float, limit: float, text: str) -> None:
    """Raise :class:`TooFastError` with ``text`` where the ``error`` of a force that rings exceeds its ``limit``.

    It grows with the speed: at half of it the normal force of a friction test on variant 1 deviates by 0.28 % and not
    0.65 %. ``restarts`` is empty where the speed may not be lowered further.
    """
    if restarts and error > limit:
        raise TooFastError(TARGET_SHARE * limit / error, text)


def _check_shares(run: Run, restarts: tuple[str, ...], shares: Mapping[str, float]) -> None:
    """Raise :class:`TooFastError` where one of ``shares`` [-] named in ``restarts`` exceeds its limit."""
    lower, texts = 1.0, []
    for name in restarts:
        share, limit = 100.0 * shares[name], float(getattr(run.solver, LIMITS[name]))
        if share > limit:
            lower = min(lower, sqrt(TARGET_SHARE * limit / share) if name == KINETIC else TARGET_SHARE * limit / share)
            texts.append(f"{name} {share:.1f} % of the work exceeds the limit of {limit:g} %")
    if texts:
        raise TooFastError(lower, " and ".join(texts))
