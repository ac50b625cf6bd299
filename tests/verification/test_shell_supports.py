"""Supports of shells: what is held stays, and its reactions are those of statics."""

import numpy as np
import pytest
from shell_cases import X, grid

from knittest.pose import ALL, Body, linear_laminate


def bracket() -> Body:
    """A square held along one side, pulled at one corner along z: the support feels moments about both axes."""
    points, cells = grid(2, 2, 10.0, 10.0)
    body = Body.of_shells(points, cells, linear_laminate((90.0, 60.0), (4.8, 3.6), 5.0, 1.0), 1e-3, 1.0, warp=X)
    body.boundary.load(8, "z", 0.2)
    return body


def test_held_rotations_do_not_creep():
    """All rotations held one by one: corrections about different axes must not add up to a turn (round-off)."""
    body = bracket()
    body.boundary.move([0, 1, 2], ALL)
    body.step(5000)
    assert np.abs(body.model.nodes.rotation[1:, :3]).max() < 1e-11
    assert abs(body.model.nodes.rotation[0, :3] - 1.0).max() < 1e-11


def test_reactions_after_relaxation_balance_the_load():
    """Sum of reactions = - load, and the damping of the body is its own again (tolerance of the relaxation)."""
    body = bracket()
    group = body.boundary.move([0, 1, 2], ["z"])
    body.boundary.move([0, 1, 2], ["x", "y", "rx", "ry", "rz"])
    assert body.relax(tolerance=1e-6).converged
    assert body.reaction(group) == pytest.approx(-0.2, rel=1e-5)
    assert np.all(body.model.nodes.damping_factor == 1.0)
