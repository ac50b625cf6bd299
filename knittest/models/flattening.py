"""Shapes of elliptic sections that flatten under lateral force: their arrays at the start, and the energy in them."""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.flatten import DRAG, EXPONENT, FREE, HIGH, LENGTH, PRODUCT, ROWS, STIFF
from knittest.kernels.state import Beams

Array = NDArray[np.float64]

#: share of the way to balance that a half height goes in a step, at most, and stiffnesses of contacts that it feels
RATE, PRESSED = 0.5, 1.5
#: tangent of the law, over that of a section at rest whose exponent is 1, for which drag is made
STEEPEST = 4.0


def shapes_at_rest(high: Array, wide: Array, stiff: Array, exponent: Array, length: Array, contact: float) -> Array:
    """Rows of :mod:`knittest.kernels.flatten` of nodes of half height ``high`` and half width ``wide`` [mm], (ROWS, n).

    ``stiff`` lateral modulus [MPa], 0 where a section is rigid, ``exponent`` of its law, ``length`` [mm] of the yarn at
    each node, all (n,); ``contact`` [N/mm] the stiffest that presses a node. Empty where all are rigid.
    """
    if not (stiff > 0.0).any():
        return np.zeros((ROWS, 0))
    shape = np.zeros((ROWS, high.size))
    shape[HIGH] = shape[FREE] = high
    shape[PRODUCT], shape[STIFF] = high * wide, 4.0 * high * wide * stiff
    shape[LENGTH], shape[EXPONENT] = length, exponent
    within = shape[STIFF] * (STEEPEST * length / high**2 + 4.0 / np.maximum(length, 1e-12))
    widest = np.maximum(wide / high, 1.0)  # a contact at the side moves by more than the half height
    shape[DRAG] = (PRESSED * contact * widest**2 + within) / RATE
    return shape


def shape_energy(shape: Array, beams: Beams, alive: Array, owned: Array | None) -> float:
    """Energy [mJ] of the sections in ``shape`` (ROWS, n); only nodes ``owned`` (n,) count, all if None."""
    if not shape.size:
        return 0.0
    y = shape[HIGH] / shape[FREE]
    z = np.minimum(y, 1.0 / y)
    cubic = -np.log(z) - 3.0 * (1.0 - z) + 1.5 * (1.0 - z**2) - (1.0 - z**3) / 3.0
    stored = np.where(shape[EXPONENT] == 1.0, z - 1.0 - np.log(z), cubic)
    bent = np.zeros(y.size)
    n = y.size - 1
    between = alive[:n] * beams.inv_length[:n] * np.diff(shape[HIGH]) ** 2
    bent[:-1] = 0.5 * between
    counts = np.ones(y.size) if owned is None else owned
    return float(np.sum(counts * shape[STIFF] * (shape[LENGTH] * stored + bent)))
