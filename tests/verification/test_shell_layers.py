"""The laminate decouples tension from bending: A follows the curve whatever D is, and D whatever the curve is."""

import numpy as np
import pytest
from shell_cases import CURVES, Solid, X, fabric, grid, per_width, solve

from knittest.kernels.shell_state import build_shells
from knittest.materials.laminate import laminate

LENGTH, WIDTH, LOAD = 100.0, 10.0, 3e-6


def solid(scale_curve: float = 1.0, bending: float = 5.05) -> Solid:
    curves = {d: (e, scale_curve * f) for d, (e, f) in CURVES.items()}
    position, conn = grid(20, 2, LENGTH, WIDTH)
    return Solid(
        position,
        build_shells(position, conn, X),
        laminate(fabric(bending_stiffness={"warp": bending, "weft": bending}), per_width(curves)),
    )


def pull(strip: Solid, strain: float) -> float:
    """Force per width [N/mm] of the strip stretched along the warp."""
    strip.place(strip.start * [strain, 0.0, 0.0])
    force, _ = strip.forces()
    return float(force[strip.start[:, 0] == 0.0, 0].sum()) / WIDTH


def sag(strip: Solid) -> float:
    """Tip deflection [mm] under a small end force."""
    free = np.zeros((strip.n, 6), bool)
    free[3:, [0, 2, 4]] = True
    load = np.zeros((strip.n, 6))
    load[-3:, 2] = LOAD / 3.0
    return float(solve(strip, free, np.zeros((strip.n, 6)), load)[-1, 2])


@pytest.mark.parametrize("strain", [0.001, 0.008, 0.015])
def test_membrane_does_not_feel_the_bending_stiffness(strain):
    """D times 8 changes the membrane force by less than 0.5 % (the layers' sum: by nothing but round-off)."""
    assert pull(solid(), strain) == pytest.approx(pull(solid(bending=8 * 5.05), strain), rel=1e-12)


def test_bending_does_not_feel_the_tension_curve():
    """Half and double the tension curve change the deflection by less than 0.5 %."""
    reference = sag(solid())
    assert sag(solid(scale_curve=2.0)) == pytest.approx(reference, rel=1e-6)
    assert sag(solid(scale_curve=0.5)) == pytest.approx(reference, rel=1e-6)
    # P L^3 / (3 D b) less 1 / (4 n^2), with transverse shear 5 D / t^2: w_s / w = 3 t^2 / (5 L^2)
    exact = LOAD * LENGTH**3 / (3.0 * 5.05 * WIDTH) * (1.0 + 3.0 * 2.22**2 / (5.0 * LENGTH**2))
    assert reference == pytest.approx(exact, rel=1.0 / (4.0 * 20**2) + 1e-4)


def test_bending_stiffness_of_a_stretched_strip():
    """Turning the directors of a flat strip at 0.8 % of tension stores D kappa^2 / 2: the tangent plays no part.

    Transverse shear is off; what is left is 1 - cos of the largest turn, 0.01 rad.
    """
    strip, curvature = solid(), 1e-4
    strip.laminate = strip.laminate._replace(transverse=np.zeros(2), hourglass_transverse=0.0)
    stretched, turn = strip.start * [0.008, 0.0, 0.0], np.zeros_like(strip.start)
    strip.place(stretched)
    flat = strip.energy()
    turn[:, 1] = -curvature * strip.start[:, 0]
    strip.place(stretched, turn)
    assert strip.energy() - flat == pytest.approx(0.5 * 5.05 * curvature**2 * LENGTH * WIDTH, rel=1e-4)
