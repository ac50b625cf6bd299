"""Poisson coupling of a laminate's two directions, which leaves what strips of it do as it was."""

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.kernels.shell_state import Laminate

Array = NDArray[np.float64]


def coupled(card: Laminate, poisson: float, name: str = "poisson") -> Laminate:
    """``card`` whose weft contracts by ``poisson`` [-] times the strain of a warp that is pulled alone.

    The weft resists contraction as it does compression, C, so that the coupling is nu C_b / (1 - nu nu'), with
    nu' = nu C_b / C_a the contraction of the warp under a pull of the weft. Both directions become stiffer by
    C nu nu' / (1 - nu nu'), of which free contraction takes as much again: a strip without load at its sides follows
    the same tension curve. Bending likewise with D. Where the directions are linear and alike this is the isotropic
    plate. Raises :class:`InputError`, for the field ``name``, where some state would have less than no energy.
    """
    if poisson == 0.0:
        return card
    pushed, bending = card.compression + 2.0 * card.outer, 2.0 * card.outer * card.layer_offset**2
    stiffer, coupling = _of_strips(pushed, poisson, name, "in compression")
    more_bent, twist = _of_strips(bending, poisson, name, "in bending")
    outer = card.outer + more_bent / (2.0 * card.layer_offset**2)
    middle = stiffer - 2.0 * (outer - card.outer)
    slope = card.slope.copy()
    slope[:, 0] += middle
    new = card._replace(
        outer=outer, slope=slope, compression=card.compression + middle,
        coupling_membrane=coupling, coupling_bending=twist,
    )  # fmt: skip
    _check(new, poisson, name)
    return new


def _of_strips(stiffness: Array, poisson: float, name: str, what: str) -> tuple[Array, float]:
    """Additions (2,) to the stiffnesses (2,) of strips, and the coupling."""
    if not stiffness.any():  # a membrane does not bend
        return stiffness, 0.0
    if poisson**2 * stiffness[1] >= stiffness[0]:
        most = float(np.sqrt(stiffness[0] / stiffness[1]))
        raise InputError(
            f"{name} = {poisson:g}: {what} the warp is {stiffness[0]:.4g} and the weft {stiffness[1]:.4g}; expected a "
            f"size below the root of their ratio, {most:.4g}: else a pull would give energy"
        )
    back = poisson * float(stiffness[1] / stiffness[0])
    rest = 1.0 - poisson * back
    return poisson * back / rest * stiffness, poisson * float(stiffness[1]) / rest


def _check(card: Laminate, poisson: float, name: str) -> None:
    """Refuses a tangent so soft that the coupling outweighs it, and a middle layer that would push under a pull."""
    middle = np.minimum(np.cumsum(card.slope, axis=1).min(axis=1), card.compression)
    softest = middle + 2.0 * card.outer
    if card.coupling_membrane**2 >= softest[0] * softest[1]:
        raise InputError(
            f"{name} = {poisson:g}: the softest tangents, {softest[0]:.4g} and {softest[1]:.4g} N/mm, cannot carry a "
            f"coupling of {abs(card.coupling_membrane):.4g} N/mm; expected a smaller size"
        )
    if (np.cumsum(card.slope, axis=1) < 0.0).any():
        raise InputError(
            f"{name} = {poisson:g}: leaves less membrane stiffness than bending needs; expected a smaller size, or a "
            "larger thickness"
        )
