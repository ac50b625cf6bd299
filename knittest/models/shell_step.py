"""Critical time step and rotary inertia of the shells from bounds on each element's stiffness.

The energy of an element is a sum of squares k s^2 / 2 of strains s, each linear in the corners' motion near any state,
so its stiffness is at most the sum of k |grad s|^2. The gradient of a fibre strain keeps its size when the element
distorts, and adding warp and weft covers fibres that shear onto each other: the bound holds at any distortion.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.shell_state import (
    ALPHA_A,
    ALPHA_B,
    AREA,
    BETA_A,
    BETA_B,
    BLOCK,
    C31,
    C42,
    SHAPE,
    STATE_ROWS,
    Laminate,
    Shells,
)

Array = NDArray[np.float64]

#: rotations may add this share to the highest eigenvalue, so that they never govern the step
ROTARY_SHARE = 0.1


def rotary_inertia(translation: Array, rotation: Array, thickness: float) -> Array:
    """Rotary inertia per mass [mm^2]: that of the plate, t^2 / 12, or more where rotations would govern."""
    return np.maximum(thickness**2 / 12.0, rotation / (ROTARY_SHARE * translation))


def highest_stiffness(
    laminate: Laminate, position: Array, conn: NDArray[np.integer], shells: Shells
) -> tuple[Array, Array, Array]:
    """Bounds of each element's stiffness against translation [N/mm] and rotation [N mm], and its area, (n_el,) each."""
    row = _rows(shells, len(conn))
    area, shape = row(AREA), row(SHAPE)
    distortion = 4.0 + 2.0 * (row(C31) ** 2 + row(C42) ** 2)
    corners = position[conn]
    x31, x42 = (np.sum((corners[:, i] - corners[:, j]) ** 2, axis=1) for i, j in ((2, 0), (3, 1)))
    edges = np.sum((corners - np.roll(corners, 1, axis=1)) ** 2, axis=(1, 2))
    translation = shape * (2.0 * distortion * laminate.hourglass_membrane + 8.0 * laminate.hourglass_transverse)
    rotation = shape * (2.0 * distortion * laminate.hourglass_bending + 0.5 * edges * laminate.hourglass_transverse)
    tangent = float(np.cumsum(laminate.shear_slope).max())
    stick = laminate.shear_stick if laminate.shear_friction > 0.0 else 0.0
    shear = (1.0 - laminate.shear_friction) * tangent + stick
    for i, (alpha, beta) in enumerate(((row(ALPHA_A), row(BETA_A)), (row(ALPHA_B), row(BETA_B)))):
        gradient2 = 2.0 * (alpha**2 + beta**2)
        tension = _largest_tangent(laminate, i) + shear + laminate.transverse[i]
        bending = 2.0 * laminate.outer[i] * laminate.lever**2 + 2.0 * laminate.twist
        translation += area * gradient2 * tension
        rotation += area * (gradient2 * bending + 0.5 * laminate.transverse[i] * (alpha**2 * x31 + beta**2 * x42))
    return translation, rotation, area


def _rows(shells: Shells, n_el: int) -> Callable[[np.integer], Array]:
    """Looks up an element constant (n_el,) by its row."""
    blocks = shells.state.reshape(-1, STATE_ROWS, BLOCK)
    return lambda start: blocks[:, int(start) // BLOCK].ravel()[:n_el]


def _largest_tangent(laminate: Laminate, direction: int) -> float:
    """Largest tangent of the membrane force, pulled or pushed, plus the force at failure, which stiffens across
    [N/mm].
    """
    tangent = 2.0 * laminate.outer[direction] + np.cumsum(laminate.slope[direction])
    over = np.maximum(laminate.fail_strain[direction] - laminate.knee[direction], 0.0)
    peak = float(laminate.slope[direction] @ over) if np.isfinite(over).all() else 0.0
    pushed = 2.0 * float(laminate.outer[direction]) + float(laminate.compression[direction])
    return max(float(tangent.max()), pushed) + peak
