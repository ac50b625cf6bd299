"""Force of a strip on the bias by the fabric's shear law and pin-jointed yarns."""

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import Run
from knittest.laboratory.base import shear_curve
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip
from knittest.materials.shear import shear_table

Array = NDArray[np.float64]


def pin_jointed_force(run: Run, strip: BiasStrip, angle: Array) -> Array:
    """Force [N] at shear angles of the middle [rad], (n,)."""
    table = shear_table(run.fabric, shear_curve(run))

    def shear(at: Array) -> Array:
        found: Array = np.maximum(at[:, None] - table.knee, 0.0) @ table.slope
        return found

    return strip.force(shear(angle), shear(0.5 * angle), angle)
