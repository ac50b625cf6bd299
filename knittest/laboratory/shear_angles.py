"""Shear angle of the material over that of the frame which shears it: mean and scatter."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.history import Frame

Array = NDArray[np.float64]

#: share of the material between the bounds of the scatter [%]
BOUNDS = (5.0, 95.0)


@dataclass(frozen=True)
class AngleScatter:
    """Mean, standard deviation and bounds of the middle 90 % of a field of shear angles [deg]."""

    mean: float
    sd: float
    low: float
    high: float


def angle_scatter(angle: Array) -> AngleScatter:
    """Scatter of shear angles ``angle`` [rad], (n,), one for each equal piece of the material (shell or crossing)."""
    degrees = np.rad2deg(angle)
    low, high = np.percentile(degrees, BOUNDS)
    return AngleScatter(float(degrees.mean()), float(degrees.std()), float(low), float(high))


def shell_angles(frame: Frame) -> Array:
    """Shear angle [rad] of each shell of a picture frame, positive where the frame's is; (n_el,).

    Warp and weft lie at +-45 deg to the pulled diagonal, which closes the angle between warp and minus weft.
    """
    return -frame.fields["shear_angle"]


def angle_table(rows: Iterable[tuple[float, AngleScatter]]) -> dict[str, Array]:
    """Columns of shear-angle.csv from the frame's angles [deg] and the scatter of the material's."""
    values = np.array([(frame, s.mean, s.sd, s.low, s.high) for frame, s in rows]).reshape(-1, 5)
    names = ("frame_shear_angle_deg", "mean_deg", "sd_deg", "percentile_5_deg", "percentile_95_deg")
    return dict(zip(names, values.T, strict=True))
