"""Points of a design: two samples A and B of the prior, and by Saltelli et al. (2010) A with one column of B each.

Saltelli, A., et al.: Variance based sensitivity analysis of model output. Computer Physics Communications 181 (2010),
259-270.
"""

import numpy as np

from knittest.base.history import Array


def design(parameters: int, samples: int, seed: int) -> Array:
    """Points (parameters + 2, samples, parameters) in the unit cube: A, B, then A with column i of B, i = 0, 1, ...

    The first two parts are a design of their own, for bands and regression. A and B are the halves of one scrambled
    Sobol sequence of twice the dimensions. With more samples the first points stay the same.
    """
    from scipy.stats import qmc

    dice = np.random.default_rng(seed)
    both = np.asarray(qmc.Sobol(2 * parameters, scramble=True, seed=dice).random(samples))
    a, b = both[:, :parameters], both[:, parameters:]
    mixed = np.repeat(a[None], parameters, axis=0)
    for i in range(parameters):
        mixed[i, :, i] = b[:, i]
    return np.concatenate([a[None], b[None], mixed])


def matrix_name(number: int, names: list[str]) -> str:
    """Name of the part ``number`` of the design: A, B, or the parameter that A has from B."""
    return ("A", "B")[number] if number < 2 else f"A, {names[number - 2]} of B"
