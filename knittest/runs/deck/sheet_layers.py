"""Layers of shells of a deck for any solver: curves of force over strain that add up to the laminate.

Three layers lie at the offset of the laminate above, in and below the middle: tension and bending are independent.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.kernels.shell_state import BLOCK, FIBRE_X, STATE_ROWS, Laminate
from knittest.models.fabric_model import FabricModel

Array = NDArray[np.float64]

#: layers, each of a third of the distance of the outer ones: outer, middle, outer
LAYERS = 3
#: largest compression of fibres, strain beyond the law's last knee, and largest shear angle [rad] of the curves
COMPRESSED, BEYOND, SHEARED = -0.5, 0.5, 1.5
#: component of a direction that counts as zero, and largest difference of the direction between shell elements
LEVEL, UNEVEN = 1e-3, 0.1


class Sheet(NamedTuple):
    """Distance ``thick`` [mm] of the outer layers, mass per area [g/mm2] and the direction of the warp, (3,)."""

    thick: float
    area_mass: float
    warp: Array


def sheet_of(model: FabricModel) -> Sheet:
    """Measures of the shells of ``model``; raises :class:`InputError` where the warp direction differs between them."""
    a, b, c, d = np.moveaxis(model.position()[model.mesh.cells], 1, 0)
    area = float(0.5 * np.linalg.norm(np.cross(c - a, d - b), axis=1).sum())
    return Sheet(2.0 * model.laminate.layer_offset, float(model.mass.sum()) / area, warp_direction(model))


def warp_direction(model: FabricModel) -> Array:
    """Warp direction of all shell elements, (3,); raises :class:`InputError` where it differs between them."""
    element = np.arange(len(model.mesh.cells))
    at = (element // BLOCK) * STATE_ROWS * BLOCK + element % BLOCK
    warp = np.column_stack([model.shells.state[at + int(FIBRE_X) + k * BLOCK] for k in range(3)])
    mean: Array = warp.mean(axis=0)
    mean[np.abs(mean) < LEVEL] = 0.0
    if np.abs(warp - mean).max() > UNEVEN:
        raise InputError("deck: the warp direction differs between shell elements; expected one direction")
    return mean / np.linalg.norm(mean)


def fibre_curves(card: Laminate, direction: int) -> list[tuple[Array, Array]]:
    """Strain [-] and force per width [N/mm] of an outer layer and of the middle one along ``direction``."""
    knee, slope = card.knee[direction], card.slope[direction]
    strain = np.unique(np.concatenate([[COMPRESSED, 0.0], knee, [knee.max() + BEYOND]]))
    middle = card.compression[direction] * np.minimum(strain, 0.0)
    middle += (slope * np.maximum(strain[:, None] - knee, 0.0)).sum(axis=1)
    return [(strain, card.outer[direction] * strain), (strain, middle)]


def shear_curve(card: Laminate) -> tuple[Array, Array]:
    """Shear angle [rad] and force [N/mm] per width conjugate to it, for both senses."""
    half = np.unique(np.concatenate([[0.0], card.shear_knee, [SHEARED]]))
    half = half[half <= SHEARED]
    force = (card.shear_slope * np.maximum(half[:, None] - card.shear_knee, 0.0)).sum(axis=1)
    return np.concatenate([-half[:0:-1], half]), np.concatenate([-force[:0:-1], force])
