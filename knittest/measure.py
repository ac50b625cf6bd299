"""Results of a tensile test, and the rows of the energies of any test that are judged."""

from collections.abc import Mapping

import numpy as np

from knittest.history import Array, History

#: quality is judged from this share of the work at the first failure on: below it everything is still start-up
START_UP = 0.05


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


def judged_rows(history: History, *, to_failure: bool = True, reported_from: float = np.inf) -> slice:
    """Rows of the energies between start-up and the first failure, or of a test not ``to_failure`` the end.

    Start-up is over at a share of the work, and at the latest when the first number is ``reported_from`` [ms].
    """
    energies = history.energies
    end = history.first_failure if to_failure and history.first_failure is not None else len(energies["time_ms"])
    end = max(end, 1)
    work = np.abs(energies["external_mj"][:end])
    start = int(np.argmax(work >= START_UP * work[-1]))
    start = min(start, int(np.searchsorted(energies["time_ms"][:end], reported_from)))
    return slice(start, max(end, start + 1))
