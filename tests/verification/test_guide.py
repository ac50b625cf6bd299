"""A guide moves nodes as told without a force from elsewhere, and damping acts on what deviates from it.

Closed forms: nodes at rest that start with the guide keep its velocity u at every step, the work is m u^2 / 2 and
damping takes nothing. A deviation w decays as exp(-c t), whatever u is.
"""

import numpy as np
import pytest

from knittest.pose import Body, Chain, Table, ramp, section

SOFT = section(1e-6, 1e-10, 0.2, 1e-3, shear=1e-6)
SPEED, START, DAMPING = 3.0, 0.02, 40.0


def guided(damping: float, guide: bool = True) -> Body:
    """A chain along x as soft as nothing, stretched evenly along y by a guide: u = x v / L."""
    points = np.column_stack([np.linspace(0.0, 4.0, 9), np.zeros(9), np.zeros(9)])
    body = Body.of_chains([Chain(points, SOFT)], None, safety=1e-5)
    body.damping = damping
    if guide:
        body.boundary.guide(np.arange(9), "y", ramp(START, SPEED), points[:, 0] / 4.0)
    return body


@pytest.mark.parametrize("damping", [0.0, DAMPING])
def test_nodes_move_with_their_guide(damping):
    body = guided(damping)
    body.advance(0.5 * START)
    body.advance(1.5 * START)
    model, going = body.model, body.start()
    expected = SPEED * np.linspace(0.0, 1.0, 9)
    assert model.nodes.velocity[1, :9] == pytest.approx(expected, abs=2e-3 * SPEED)
    travel = ramp(START, SPEED).integral(going.time)
    assert model.nodes.position[1, :9] == pytest.approx(travel * expected / SPEED, rel=2e-3, abs=1e-6)
    work, kinetic = going.work()[0], 0.5 * float(model.mass @ expected**2)
    assert work == pytest.approx(kinetic, rel=5e-3)
    assert going.damping_loss - going.guide_energy == pytest.approx(0.0, abs=2e-2 * kinetic)


def test_a_deviation_from_the_guide_decays_and_damping_takes_its_energy():
    body = guided(DAMPING)
    body.advance(2.0 * START)
    model, going = body.model, body.start()
    model.nodes.velocity[1, :9] += 0.5
    body.step(1)  # damping is summed by the trapezoidal rule, which does not see the jump
    before, energy, at = going.damping_loss - going.guide_energy, kinetic(model), going.time
    body.advance(0.05)
    deviation = model.nodes.velocity[1, :9] - SPEED * np.linspace(0.0, 1.0, 9)
    assert deviation == pytest.approx(np.full(9, 0.5 * np.exp(-DAMPING * (going.time - at))), rel=1e-2)
    assert going.damping_loss - going.guide_energy - before == pytest.approx(energy - kinetic(model), rel=0.05)


def kinetic(model):
    """Kinetic energy along y [mJ]."""
    return 0.5 * float(model.mass @ model.nodes.velocity[1, :9] ** 2)


def test_without_a_guide_damping_drags_on_the_motion():
    body = guided(DAMPING, guide=False)
    body.start()
    body.model.nodes.velocity[1, :9] = SPEED
    body.advance(0.05)
    assert body.model.nodes.velocity[1, :9] == pytest.approx(np.full(9, SPEED * np.exp(-DAMPING * 0.05)), rel=1e-2)


def test_a_guide_wants_an_axis():
    from knittest.errors import InputError

    with pytest.raises(InputError, match="axis"):
        guided(0.0, guide=False).boundary.guide([0], "rx", Table((0.0,), (1.0,)))
