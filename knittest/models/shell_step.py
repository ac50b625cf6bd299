"""Critical time step and rotary inertia of the shells from bounds on each element's stiffness.

The energy of an element is a sum of squares k s^2 / 2 of strains s, each linear in the corners' motion near any state,
so its stiffness is the highest eigenvalue of the matrix sqrt(k k') grad s . grad s', which no row sum of absolute
values is below. The gradient of a fibre strain is a pattern of the corners, which does not change when the element
distorts, times the fibre's direction. The patterns of warp, weft and hourglass control of a rectangle are orthogonal,
so its stiffness is that of the stiffest and not the sum. Poisson coupling c e_a e_b is at most c (r e_a^2 + e_b^2 / r)
/ 2, with r^2 the ratio of both stiffnesses. Not in the bound: an hourglass pattern as large as a tenth of the side adds
some per cent to the squared frequency, a seventh where its control governs; shear that is as stiff as a fibre, whose
force turns with it and whose gradients grow where fibres shorten, adds up to 0.45 in a distorted element (a fabric's is
a thousandth). A safety factor of 0.9 leaves a quarter.

A law with a kink at rest is no sum of squares: a fibre that rattles about it gains energy at random, as a ball does
that bounces on a spring, because each bounce falls between steps as it may. The map of a bounce keeps areas, so its
gain is 1 at the least on average: 1.03 at 0.55, 1.07 at 0.75, 1.3 at 0.8, 2.1 at 0.9 of the spring's critical step.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.shell_state import (
    ALONG_A,
    ALONG_B,
    ALPHA_A,
    ALPHA_B,
    AREA,
    BETA_A,
    BETA_B,
    BLOCK,
    C31,
    C42,
    LEAN_A,
    LEAN_B,
    SHAPE,
    STATE_ROWS,
    Laminate,
    Shells,
)

Array = NDArray[np.float64]

#: multiple of its stiffness that a kink counts as, so that a step of 0.9 is 0.55 of what the bounce would bear
KINK = (0.9 / 0.55) ** 2
#: rotations may add this share to the highest eigenvalue, so that they never govern the step
ROTARY_SHARE = 0.1


def rotary_inertia(translation: Array, rotation: Array, thickness: float) -> Array:
    """Rotary inertia per mass [mm^2]: that of the plate, t^2 / 12, or more where rotations would govern."""
    return np.maximum(thickness**2 / 12.0, rotation / (ROTARY_SHARE * translation))


def highest_stiffness(
    laminate: Laminate, position: Array, conn: NDArray[np.integer], shells: Shells
) -> tuple[Array, Array, Array]:
    """Bounds of each element's stiffness against translation [N/mm] and rotation [N mm], and its area, (n_el,) each."""
    row = element_rows(shells, len(conn))
    area, shape = row(AREA), row(SHAPE)
    distortion = 4.0 + 2.0 * (row(C31) ** 2 + row(C42) ** 2)
    corners = position[conn]
    x31, x42 = (np.sum((corners[:, i] - corners[:, j]) ** 2, axis=1) for i, j in ((2, 0), (3, 1)))
    edges = np.sum((corners - np.roll(corners, 1, axis=1)) ** 2, axis=(1, 2))
    rotation = shape * (2.0 * distortion * laminate.hourglass_bending + 0.5 * edges * laminate.hourglass_transverse)
    # shares of the patterns (-1, 0, 1, 0) and (0, -1, 0, 1); that of the hourglass control adds (1, -1, 1, -1)
    patterns = ((row(ALPHA_A), row(BETA_A)), (row(ALPHA_B), row(BETA_B)), (row(C31), row(C42)))
    tangent = [_largest_tangent(laminate, i) for i in range(2)]
    bent = [2.0 * float(laminate.outer[i]) * laminate.layer_offset**2 for i in range(2)]
    tangent = _with_coupling(tangent, laminate.coupling_membrane)
    bent = _with_coupling(bent, laminate.coupling_bending)
    stiffness = [area * (tangent[i] + laminate.transverse[i]) for i in range(2)]
    # of both fibres, as shear may turn one onto the other
    control = row(ALONG_A) * laminate.hourglass_fibre[0] + row(ALONG_B) * laminate.hourglass_fibre[1]
    control = control + (row(LEAN_A) + row(LEAN_B)) * laminate.hourglass_shear
    translation = _largest_row_sum(patterns, [*stiffness, control]) + 8.0 * shape * laminate.hourglass_transverse
    # warp turned against weft: gradients of both, which add where the fibres lean and an element is no rectangle
    lean = np.abs(row(ALPHA_A) * row(ALPHA_B) + row(BETA_A) * row(BETA_B))
    for i, (alpha, beta) in enumerate(patterns[:2]):
        gradient2 = 2.0 * (alpha**2 + beta**2)
        translation += area * (gradient2 + 2.0 * lean) * _shear_tangent(laminate)
        bending = bent[i] + 2.0 * laminate.twist
        rotation += area * (gradient2 * bending + 0.5 * laminate.transverse[i] * (alpha**2 * x31 + beta**2 * x42))
        # a turn is that of the fibres less that of the corner: its square is at most twice the sum of both squares
        translation += 0.5 * area * laminate.drilling * gradient2
    return translation, rotation + 0.5 * area * laminate.drilling, area


def _with_coupling(stiffness: list[float], coupling: float) -> list[float]:
    """Two uncoupled stiffnesses that are at least two coupled ones in every state."""
    ratio = np.sqrt(stiffness[0] / stiffness[1]) if coupling != 0.0 else 1.0
    return [stiffness[0] + abs(coupling) * ratio, stiffness[1] + abs(coupling) / ratio]


def element_rows(shells: Shells, n_el: int) -> Callable[[np.integer], Array]:
    """Looks up an element constant (n_el,) by its row."""
    blocks = shells.state.reshape(-1, STATE_ROWS, BLOCK)
    return lambda start: blocks[:, int(start) // BLOCK].ravel()[:n_el]


def _largest_row_sum(patterns: Sequence[tuple[Array, Array]], stiffness: Sequence[Array]) -> Array:
    """Largest sum over j of sqrt(k_i k_j) |p_i . p_j| of the elements' patterns, the last of hourglass control."""
    sums = []
    for i, (p, k) in enumerate(zip(patterns, stiffness, strict=True)):
        total = 4.0 * k if i == len(patterns) - 1 else 0.0 * k
        for q, other in zip(patterns, stiffness, strict=True):
            total = total + 2.0 * np.sqrt(k * other) * np.abs(p[0] * q[0] + p[1] * q[1])
        sums.append(total)
    return np.max(sums, axis=0)


def _shear_tangent(laminate: Laminate) -> float:
    """Largest tangent of the shear force, friction that sticks included [N/mm]."""
    stick = laminate.shear_stick if laminate.shear_friction > 0.0 else 0.0
    return (1.0 - laminate.shear_friction) * float(np.cumsum(laminate.shear_slope).max()) + stick


def _largest_tangent(laminate: Laminate, direction: int) -> float:
    """Largest tangent of the membrane force, pulled or pushed, along the fibre [N/mm], or :data:`KINK` times the kink
    between both at rest.

    Across it resists by the force over the stretch, which stays below: the force is at most this times the strain.
    """
    tangent = 2.0 * laminate.outer[direction] + np.cumsum(laminate.slope[direction])
    pushed = 2.0 * float(laminate.outer[direction]) + float(laminate.compression[direction])
    pulled = laminate.slope[direction][laminate.knee[direction] <= 0.0].sum()
    kink = abs(float(pulled) - float(laminate.compression[direction]))
    return max(float(tangent.max()), pushed, KINK * kink)
