"""Weights of the nodes of a specimen that hangs or lies."""

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import CantileverRun, FormingRun
from knittest.models.explicit_model import ExplicitModel

Array = NDArray[np.float64]


def weights(run: CantileverRun | FormingRun, model: ExplicitModel, area: float) -> Array:
    """Weight of each node [N]: the measured area mass on ``area`` [mm^2], spread as the model's mass."""
    given = run.fabric.area_mass_g_per_mm2 * area
    return model.mass * (given / model.mass.sum()) * run.rig.gravity_mm_per_ms2
