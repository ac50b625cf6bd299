"""Pinched cylinder with rigid diaphragms, nu = 0.3: Poisson coupling and turns about the normal in one curved shell."""

import numpy as np
import pytest
from shell_cases import grid

from knittest.pose import ALL, Body, linear_laminate

RADIUS, LENGTH, THICKNESS, MODULUS, NU = 300.0, 600.0, 3.0, 3e6, 0.3
LOAD = 1000.0
#: deflection under the load of 1 (Flügge's series; MacNeal & Harder 1985; Belytschko et al. 1985)
SOFTNESS = 1.8248e-5


def deflection(n: int) -> float:
    """Deflection [mm] under the load of an eighth of the cylinder in ``n`` x ``n`` shells, along and around."""
    flat, cells = grid(n, n, 0.5 * LENGTH, 0.5 * np.pi)
    along, angle = flat[:, 0], flat[:, 1]
    points = np.column_stack([along, RADIUS * np.sin(angle), RADIUS * np.cos(angle)])
    shear, bending = MODULUS * THICKNESS / (2.0 * (1.0 + NU)), MODULUS * THICKNESS**3 / 12.0
    card = linear_laminate(
        (MODULUS * THICKNESS,) * 2, (bending,) * 2, shear, THICKNESS, twist=shear * THICKNESS**2 / 12.0, poisson=NU
    )
    body = Body.of_shells(points, cells, card, 1e-3, THICKNESS, warp=(1.0, 0.0, 0.0))
    middle, end, top, side = along == 0.0, along == along.max(), angle == 0.0, angle == angle.max()
    held = (middle, end | top, end | side, top | side, middle | side, middle | top)
    for dof, nodes in zip(ALL, held, strict=True):
        body.boundary.move(np.flatnonzero(nodes), dof)
    loaded = int(np.flatnonzero(middle & top)[0])
    body.boundary.load([loaded], "z", -0.25 * LOAD)
    body.relax(tolerance=1e-4)
    return RADIUS - float(body.position[loaded, 2])


def test_pinched_cylinder():
    """Within 5 % at 32 shells an edge; a local bend of 2 sqrt(R t) = 60 mm under the load wants them that fine."""
    coarse, fine = (deflection(n) / (SOFTNESS * LOAD) for n in (16, 32))
    assert coarse < fine
    assert fine == pytest.approx(1.0, abs=0.05)
