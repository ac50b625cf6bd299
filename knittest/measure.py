"""What a test reports: results from the curve, and the quality gates that decide whether they may be compared."""

from collections.abc import Mapping

import numpy as np

from knittest.config.run import Solver
from knittest.history import Array, History, Quality

#: quality is judged from this share of the work at the first failure on: below it everything is still start-up
START_UP = 0.05
#: share of the work in damping, or of the internal energy in hourglass control, that a report names
NOTED = 0.10


def tensile_results(curve: Mapping[str, Array], n_yarns: int) -> dict[str, float]:
    """Peak force [N], strain at maximum force [%] (ISO 13934-1, fracture strain in Table 3) and force per yarn [N].

    ``n_yarns`` yarns lie along the strip.
    """
    peak = int(np.argmax(curve["force_n"]))
    force = float(curve["force_n"][peak])
    return {
        "peak_force_n": force,
        "fracture_strain_pct": float(curve["strain_pct"][peak]),
        "force_per_yarn_n": force / n_yarns,
    }


def judged_rows(history: History) -> slice:
    """Rows of the energies between start-up and the first failure."""
    end = history.first_failure if history.first_failure is not None else len(history.energies["time_ms"])
    end = max(end, 1)
    work = np.abs(history.energies["external_mj"][:end])
    start = int(np.argmax(work >= START_UP * work[-1]))
    return slice(start, max(end, start + 1))


def _losses(history: History) -> list[str]:
    """Warnings about what the model takes for itself up to the first failure: damping, hourglass control."""
    end = max(history.first_failure, 1) if history.first_failure is not None else len(history.energies["time_ms"])
    last = {name: float(values[end - 1]) for name, values in history.energies.items()}
    internal = sum(value for name, value in last.items() if name.startswith("internal_"))
    shares = (
        ("damping took", last["damping_mj"], "of the work", abs(last["external_mj"])),
        ("hourglass control holds", last["hourglass_mj"], "of the internal energy", internal),
    )
    return [
        f"{what} {100.0 * part / whole:.0f} % {of}, more than {100.0 * NOTED:g} %"
        for what, part, of, whole in shares
        if part > NOTED * whole > 0.0
    ]


def assess(
    history: History,
    solver: Solver,
    penetration_max: float,
    penetration_mean: float,
    added_mass: float,
    to_failure: bool = False,
) -> Quality:
    """Judge a run: kinetic over internal energy and work, energy balance, penetration, overlap at the start, added
    mass (ratios [-]).

    A test ``to_failure`` in which nothing fails inside its strain range is refused too.
    """
    rows = judged_rows(history)
    kinetic = float(history.energies["kinetic_ratio"][rows].max())
    error = float(history.energies["energy_error"][rows].max())
    failures, warnings = [], []
    for name, value, limit in (
        ("kinetic energy over work", kinetic, solver.max_kinetic_ratio),
        ("energy error", error, solver.max_energy_error),
        ("penetration over radius", penetration_max, solver.max_penetration),
        ("overlap of yarns at the start", history.overlaps.largest, solver.max_overlap),
        ("added mass", added_mass, solver.max_added_mass),
    ):
        if 100.0 * value > limit:
            failures.append(f"{name} {100.0 * value:.2f} % is above {limit:g} %")
        elif 100.0 * value > 0.5 * limit:
            warnings.append(f"{name} {100.0 * value:.2f} % is more than half of its limit {limit:g} %")
    warnings += _losses(history)
    if to_failure and history.first_failure is None:
        failures.append("nothing failed up to rig.max_strain: the peak is not a strength")
    return Quality(
        kinetic, error, penetration_max, penetration_mean, 100.0 * added_mass,
        100.0 * kinetic <= solver.max_kinetic_ratio, tuple(failures), tuple(warnings),
        history.overlaps.largest,
    )  # fmt: skip
