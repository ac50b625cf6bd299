"""Results of a tensile test."""

from collections.abc import Mapping

import numpy as np

from knittest.base.history import Array


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
