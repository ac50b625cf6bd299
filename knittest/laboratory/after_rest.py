"""Part of a test after its specimen has come to rest in the rig: what rest costs is none of the test's."""

from dataclasses import replace

import numpy as np

from knittest.base.history import Array, History

#: columns of the energies that are no sum over the time
MOMENTARY = ("time_ms", "kinetic_mj", "kinetic_ratio", "energy_error")
#: least work [mJ] in a ratio
LEAST = 1e-9


def after_rest(history: History, begin: float) -> History:
    """``history`` from the time ``begin`` [ms] on: curve without what was before, energies and losses counted from the
    last row before it; frames as they are, whose first is the specimen as laid out.
    """
    energies = history.energies
    start = max(int(np.searchsorted(energies["time_ms"], begin, side="right")) - 1, 0)
    later = slice(min(start + 1, len(energies["time_ms"]) - 1), None)
    counted = {name: values[later] - (0.0 if name in MOMENTARY else values[start]) for name, values in energies.items()}
    curve_from = history.curve["time_ms"] >= begin
    if not curve_from.any():
        curve_from[-1] = True
    failure = history.first_failure
    return replace(
        history,
        curve={name: values[curve_from] for name, values in history.curve.items()},
        energies=counted | _ratios(counted),
        contacts={name: values[later] for name, values in history.contacts.items()},
        first_failure=None if failure is None else max(failure - later.start, 0),
    )


def _ratios(energies: dict[str, Array]) -> dict[str, Array]:
    """Kinetic energy over elastic energy and friction, and error over work, as every test has them, (n_rows,)."""
    elastic = sum(v for name, v in energies.items() if name.startswith("internal_"))
    taken = elastic + energies["contact_mj"] + energies["hourglass_mj"] + energies["friction_mj"]
    work = np.abs(energies["external_mj"])
    largest = np.maximum(work, np.concatenate([[0.0], work[:-1]]))
    return {
        "kinetic_ratio": energies["kinetic_mj"] / np.maximum(taken, LEAST),
        "energy_error": np.abs(energies["balance_error_mj"]) / np.maximum(largest, LEAST),
    }
