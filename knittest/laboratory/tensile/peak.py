"""Results of a tensile test, and how far its peak is resolved in time."""

from collections.abc import Mapping

import numpy as np

from knittest.base.history import Array

#: samples, means of the force over time, by which the last one before a break may lie in front of it: the break lowers
#: the next one wherever it falls into it
SAMPLES = 1.5
#: samples from which the rate of the force is read
RATE = 4


def unresolved_peak(curve: Mapping[str, Array], passage: float) -> float:
    """Share of the peak force by which it is uncertain in time [-].

    Clamps feel a break half a ``passage`` L / c [ms] later, when its wave arrives; until then the force grows on. The
    force is a mean over samples, of which a break lowers the last. With the rate of the force at the peak dF/dt,
    which grows with the speed, the share is dF/dt max(1.5 dt, L / 2c) / F.
    """
    force, time = curve["force_n"], curve["time_ms"]
    peak = int(np.argmax(force))
    first = max(peak - RATE, 0)
    if peak == first or not force[peak] > 0.0:
        return float("nan")
    rate = float(force[peak] - force[first]) / float(time[peak] - time[first])
    sample = float(np.diff(time[first : peak + 1]).max())
    return rate * max(SAMPLES * sample, 0.5 * passage) / float(force[peak])


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
