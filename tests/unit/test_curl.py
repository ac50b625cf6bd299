"""Curl of a cell: moment that keeps it flat over its bending stiffness, held against the closed form of two layers."""

import numpy as np
import pytest

from knittest.pose import PeriodicBody, PeriodicChain, round_section
from knittest.solve.relaxed_cell import PROBE, WAY, Curl, _bend_rate, curl_of

DIAMETER, ARM, DRAWN, PITCH = 0.1, 0.5, 0.002, 2.0
SECTION = round_section(modulus=2e3, diameter=DIAMETER, density=1.5e-3)


def two_layers(direction: int, upper: float) -> PeriodicBody:
    """Straight yarns along x (0) or y (1), :data:`ARM` above and below the middle and held there; the ``upper`` or the
    lower one is drawn in.
    """
    n = 4
    chains = []
    for height, draw_in in ((ARM, upper * DRAWN), (-ARM, (1.0 - upper) * DRAWN)):
        points = np.zeros((n, 3))
        points[:, direction], points[:, 2] = np.arange(n) / n, height
        chains.append(PeriodicChain(points, SECTION, 0, loop_shortening=draw_in, along=direction))
    sizes = (1.0, PITCH) if direction == 0 else (PITCH, 1.0)
    body = PeriodicBody.of_cell(chains, np.hstack([np.diag(sizes), np.zeros((2, 1))]), threads=1)
    body.boundary.move(np.flatnonzero(body.cell.owned), "z")
    body.cell.bend_along(np.eye(3)[direction])
    return body


@pytest.mark.parametrize(("direction", "upper"), [(0, 1.0), (1, 0.0)])
def test_two_layers_of_which_one_is_shorter_curl_as_the_closed_form(direction, upper):
    """A layer shorter by p at the arm h bears EA p: M = EA p h, D = 2 (EA h^2 + EI), hollow towards the short one."""
    found = curl_of(lambda: two_layers(direction, upper), np.eye(3)[direction])
    sign = 1.0 if upper else -1.0
    axial, bending = SECTION.axial, SECTION.axial * DIAMETER**2 / 16.0
    assert found.moment == pytest.approx(-sign * axial * DRAWN / (1.0 - DRAWN) * ARM / PITCH, rel=1e-3)
    assert found.stiffness == pytest.approx(2.0 * (axial * ARM**2 + bending) / PITCH, rel=0.01)
    assert found.curvature == pytest.approx(sign * DRAWN * ARM / (2.0 * (ARM**2 + DIAMETER**2 / 16.0)), rel=0.01)


def test_a_moment_towards_the_back_curls_towards_the_back():
    assert Curl(0.1, 5.0).curvature == pytest.approx(-0.02)


def test_the_cell_is_bent_by_the_probe_from_rest_to_rest():
    table = _bend_rate(PROBE)
    assert table.integral(WAY) == pytest.approx(PROBE) and table.value[0] == table.value[-1] == 0.0
