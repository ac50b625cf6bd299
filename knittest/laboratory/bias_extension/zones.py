"""Zones of a strip on the bias, by the yarns that a clamp holds, and the shear angles in them."""

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, History
from knittest.laboratory.bias_extension.material import Material
from knittest.laboratory.bias_extension.pin_jointed import BiasStrip
from knittest.laboratory.shear_angles import angle_scatter
from knittest.materials.trellis import ANGLE

Array = NDArray[np.float64]

#: zones by the number of yarns of a crossing that a clamp holds
MIDDLE, HALF, RIGID = 0, 1, 2
#: share of the middle, about the strip's centre, in which its angle is read: a camera looks there
READ = 0.5
#: share of the crossings that slip less than is stated [%]
SLIPPED = 95.0


def zones(points: Array, strip: BiasStrip) -> NDArray[np.int64]:
    """Number of yarns through each of ``points`` (n, 2) [mm] that a clamp holds, (n,): 0, 1 or 2.

    The strip lies about the origin, its length along y. A yarn is followed along y = +-x to the clamps.
    """
    x, y = points[:, 0], points[:, 1]
    held = np.zeros(len(points), np.int64)
    for lean in (1.0, -1.0):
        ends = [x + lean * (clamp - y) for clamp in (0.5 * strip.length, -0.5 * strip.length)]
        held += np.any([np.abs(end) <= 0.5 * strip.width for end in ends], axis=0)
    return held


def is_read(points: Array, strip: BiasStrip) -> NDArray[np.bool_]:
    """Tell which of ``points`` (n, 2) [mm] lie in the inner half of the middle."""
    outer = points[:, :2] / READ
    in_strip = (np.abs(outer) <= [0.5 * strip.width, 0.5 * strip.length]).all(axis=1)
    inside: NDArray[np.bool_] = in_strip & (zones(outer, strip) == MIDDLE)
    return inside


def zone_table(history: History, strip: BiasStrip, material: Material) -> dict[str, Array]:
    """Columns of zones.csv at each frame: angle of pin-jointed yarns; mean, sd and bounds of the middle's inner half;
    mean of the zones that are sheared by half of it and not at all [deg]; of yarns the slip that 95 % of the crossings
    stay below [mm].
    """
    zone, read = zones(material.places, strip), is_read(material.places, strip)
    rows: dict[str, list[float]] = {}
    for frame in _rising(history.frames):
        angle = material.angles(frame)
        middle = angle_scatter(angle[read])
        row = {
            ANGLE: frame.coordinate, "middle_mean_deg": middle.mean, "middle_sd_deg": middle.sd,
            "middle_percentile_5_deg": middle.low, "middle_percentile_95_deg": middle.high,
            "half_mean_deg": _mean(angle, material.weights, zone == HALF),
            "rigid_mean_deg": _mean(angle, material.weights, zone == RIGID),
        }  # fmt: skip
        if material.slip is not None:
            row["slip_percentile_95_mm"] = float(np.percentile(material.slip(frame), SLIPPED))
        for name, value in row.items():
            rows.setdefault(name, []).append(value)
    return {name: np.array(values) for name, values in rows.items()}


def _mean(angle: Array, weights: Array, of: NDArray[np.bool_]) -> float:
    """Mean [deg] of ``angle`` [rad] ``of`` some points; nan of none, as narrow strips have in their corners."""
    return float(np.rad2deg(np.average(angle[of], weights=weights[of]))) if of.any() else np.nan


def _rising(frames: list[Frame]) -> list[Frame]:
    """The frames of which each shows a larger angle than the one before."""
    found: list[Frame] = []
    for frame in frames:
        if not found or frame.coordinate > found[-1].coordinate:
            found.append(frame)
    return found
