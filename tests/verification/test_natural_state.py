"""Yarns bent from a straight or partly set shape: energy of a bent arc, springing back, no strain at the start."""

import numpy as np
import pytest

from knittest.models.natural_state import natural_state
from knittest.pose import ALL, Body, Chain, section

RADIUS, BENDING, LENGTH = 2.0, 0.5, 3.0
CARD = section(axial=2000.0, bending=BENDING, radius=0.2, linear_density=2e-4)


def arc(n: int) -> np.ndarray:
    turn = np.linspace(0.0, LENGTH / RADIUS, n + 1)
    return RADIUS * np.column_stack([np.sin(turn), 1.0 - np.cos(turn), np.zeros(n + 1)])


@pytest.mark.parametrize("degree_of_set", [0.0, 0.4, 1.0])
def test_bent_arc_stores_the_bending_that_is_not_set(degree_of_set):
    """U = EI ((1 - set) / R)^2 L / 2; half a curvature is missing at each end, whose tangent is that of the element."""
    n = 200
    body = Body.of_chains([Chain(arc(n), CARD, degree_of_set=degree_of_set)])
    exact = 0.5 * BENDING * ((1.0 - degree_of_set) / RADIUS) ** 2 * LENGTH
    assert body.model.stored_energies().internal.sum() == pytest.approx(exact, rel=2.0 / n, abs=1e-12)
    assert body.model.prestressed == (degree_of_set < 1.0)


def test_released_arc_springs_straight():
    """All points come to rest on a line of the same length."""
    body = Body.of_chains([Chain(arc(24), CARD, degree_of_set=0.0)])
    body.boundary.move([0], ALL)
    body.relax()
    out = body.position - body.position[0]
    assert np.linalg.norm(out[-1]) == pytest.approx(LENGTH, rel=1e-3)
    along = out @ out[-1] / np.linalg.norm(out[-1])
    assert np.sqrt(np.maximum((out**2).sum(axis=1) - along**2, 0.0)).max() < 1e-3 * LENGTH


def test_set_shape_stays():
    """A shape that is fully set has neither turned nodes nor forces."""
    chord = np.diff(arc(24), axis=0, append=[[1.0, 0.0, 0.0]])
    rotation, tangent = natural_state(np.array([0, 25]), chord, np.ones(25))
    assert rotation == pytest.approx(np.tile([1.0, 0.0, 0.0, 0.0], (25, 1)))
    assert tangent[:-1] == pytest.approx(chord[:-1] / np.linalg.norm(chord[:-1], axis=1)[:, None])
