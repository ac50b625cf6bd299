"""Weights of the nodes of a specimen that hangs or lies."""

import numpy as np
from numpy.typing import NDArray

from knittest.config.fabric import Fabric
from knittest.models.explicit_model import ExplicitModel

Array = NDArray[np.float64]


def weights(fabric: Fabric, gravity: float, model: ExplicitModel, area: float) -> Array:
    """Weight of each node [N] under ``gravity`` [mm/ms^2]: the measured area mass on ``area`` [mm^2], spread as the
    model's mass.
    """
    given = fabric.area_mass_g_per_mm2 * area
    return model.mass * (given / model.mass.sum()) * gravity
