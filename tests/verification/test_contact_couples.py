"""Friction acts where yarns touch, between their centre-lines: couples, rigid turns and rolling."""

import numpy as np
import pytest

from knittest.pose import ALL, Body, Chain, Table, YarnContact, section

LAW = section(1e4, 5.0, 0.2, 1e-3)
X = np.arange(-2.0, 2.01, 0.2)
RADII = 0.4


def along(axis: int, height: float = 0.0, shift: float = 0.0) -> np.ndarray:
    points = np.zeros((len(X), 3))
    points[:, axis], points[:, 1 - axis], points[:, 2] = X, shift, height
    return points


def crossed(friction: float = 0.5, depth: float = 0.0) -> Body:
    """Two yarns that cross, pressed ``depth`` into each other without having been so at the start."""
    contact = YarnContact(500.0, 250.0, friction, 0.0)
    body = Body.of_chains([Chain(along(0), LAW), Chain(along(1, RADII - depth), LAW)], contact)
    body.start()
    body.model.tracker.contacts.reach[:] = RADII
    return body


def angular_momentum(body: Body) -> np.ndarray:
    nodes, n = body.model.nodes, body.model.n_nodes
    orbital = np.cross(nodes.position[:, :n].T, body.model.mass[:, None] * nodes.velocity[:, :n].T)
    own: np.ndarray = (body.model.inertia[:, None] * nodes.spin[:, :n].T).sum(axis=0)
    return orbital.sum(axis=0) + own


def test_a_rubbing_impact_keeps_angular_momentum():
    """To round-off; with friction on the centre-lines it would gain mu N (r1 + r2) t, here more than a tenth."""
    body, upper = crossed(), slice(len(X), 2 * len(X))
    body.model.nodes.velocity[:, upper] = np.array([[0.3], [0.2], [-1.0]])
    before = angular_momentum(body)
    body.advance(0.1)
    assert body.energies()["friction"] > 1e-3 * body.energies()["kinetic"], "nothing rubbed"
    assert body.model.nodes.velocity[2, upper].mean() > -0.5, "it has not bounced"
    assert angular_momentum(body) == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rigid_turn_rubs_nothing_and_turns_the_sticking_spring(axis):
    """A quarter turn of touching yarns about any axis: no loss, the spring turns with them."""
    body = crossed(depth=0.01)
    nodes, n, contacts = body.model.nodes, body.model.n_nodes, body.model.tracker.contacts
    contacts.spring[:, 0] = [2e-3, 1e-3, 0.0]
    contacts.force[2, 0] = 1.0  # touching
    nodes.inv_mass[:], nodes.inv_inertia[:] = 0.0, 0.0
    start, spring, steps = nodes.position[:, :n].copy(), contacts.spring[:, 0].copy(), 2000
    angle, others = 0.5 * np.pi / steps, [(axis + 1) % 3, (axis + 2) % 3]

    def turned(vector: np.ndarray, by: float) -> np.ndarray:
        out = vector.copy()
        out[others[0]] = np.cos(by) * vector[others[0]] - np.sin(by) * vector[others[1]]
        out[others[1]] = np.sin(by) * vector[others[0]] + np.cos(by) * vector[others[1]]
        return out

    for step in range(steps):
        nodes.velocity[:, :n] = (turned(start, (step + 1) * angle) - turned(start, step * angle)) / body.dt
        body.step(1)
        nodes.spin[axis, :n] = angle / body.dt  # contacts look back on a step, the first on none
    # the last step has moved the yarns but not yet looked at them
    assert contacts.spring[:, 0] == pytest.approx(turned(spring, (steps - 1) * angle), abs=2e-5)
    assert abs(body.energies()["friction"]) < 1e-7


def test_a_yarn_pulled_across_others_rolls_on_them():
    """a = F / (m + I / r^2) without slip (rolling of a cylinder), I its rotary inertia about its axis, r its radius."""
    contact, press, pull, stiff = YarnContact(500.0, 250.0, 0.5), 2.0, 0.01, section(1e4, 5.0, 0.2, 1e-3, torsion=50.0)
    rails = [Chain(along(0, 0.0, shift), stiff) for shift in (-1.0, 1.0)]
    body = Body.of_chains([*rails, Chain(along(1, RADII), stiff)], contact)
    held, rolling = np.arange(2 * len(X)), np.arange(2 * len(X), 3 * len(X))
    body.boundary.move(held, ALL)
    share = body.model.mass[rolling] / body.model.mass[rolling].sum()
    body.boundary.load(rolling, "z", -press * share)
    body.boundary.load(rolling, "x", pull * share, Table((0.0, 0.2, 0.3), (0.0, 0.0, 1.0)))
    body.advance(0.5)
    start, since = body.velocity[rolling, 0] @ share, body.time
    body.advance(0.5)
    mass, inertia = body.model.mass[rolling].sum(), body.model.inertia[rolling].sum()
    radius = 0.5 * RADII - 0.5 * press / 2 / 500.0  # half the depth of one of two contacts
    expected = pull / (mass + inertia / radius**2)
    acceleration = (body.velocity[rolling, 0] @ share - start) / (body.time - since)
    assert acceleration == pytest.approx(expected, rel=0.02)
    assert acceleration < 0.95 * pull / mass, "it slides"
