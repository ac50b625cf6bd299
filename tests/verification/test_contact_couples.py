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


def pressed(upper: int, depth: float = 0.0) -> Body:
    """A yarn along x and one along axis ``upper``, ``depth`` in each other without having been so at the start."""
    contact = YarnContact(500.0, 250.0, 0.5, 0.0)
    body = Body.of_chains([Chain(along(0), LAW), Chain(along(upper, RADII - depth), LAW)], contact)
    body.start()
    body.model.tracker.contacts.reach[:] = RADII
    return body


def rotated(vector: np.ndarray, axis: int, by: float) -> np.ndarray:
    """``vector`` (3, ...) turned about a global axis."""
    out, (a, b) = vector.copy(), [(axis + 1) % 3, (axis + 2) % 3]
    out[a] = np.cos(by) * vector[a] - np.sin(by) * vector[b]
    out[b] = np.sin(by) * vector[a] + np.cos(by) * vector[b]
    return out


def turn(body: Body, axis: int, angle: float, steps: int) -> None:
    """Turn touching yarns rigidly about the origin, which springs and contacts see one step late."""
    nodes, n = body.model.nodes, body.model.n_nodes
    body.model.tracker.contacts.force[2] = 1.0  # touching
    nodes.inv_mass[:], nodes.inv_inertia[:] = 0.0, 0.0
    start, rate = nodes.position[:, :n].copy(), angle / steps
    for step in range(steps):
        nodes.velocity[:, :n] = (rotated(start, axis, (step + 1) * rate) - rotated(start, axis, step * rate)) / body.dt
        body.step(1)
        nodes.spin[axis, :n] = rate / body.dt  # contacts look back on a step, the first on none


def angular_momentum(body: Body) -> np.ndarray:
    nodes, n = body.model.nodes, body.model.n_nodes
    orbital = np.cross(nodes.position[:, :n].T, body.model.mass[:, None] * nodes.velocity[:, :n].T)
    own: np.ndarray = (body.model.inertia[:, None] * nodes.spin[:, :n].T).sum(axis=0)
    return orbital.sum(axis=0) + own


def test_a_rubbing_impact_keeps_angular_momentum():
    """To round-off; with friction on the centre-lines it would gain mu N (r1 + r2) t, here more than a tenth."""
    body, upper = pressed(1), slice(len(X), 2 * len(X))
    body.model.nodes.velocity[:, upper] = np.array([[0.3], [0.2], [-1.0]])
    before = angular_momentum(body)
    body.advance(0.1)
    assert body.energies()["friction"] > 1e-3 * body.energies()["kinetic"], "nothing rubbed"
    assert body.model.nodes.velocity[2, upper].mean() > -0.5, "it has not bounced"
    assert angular_momentum(body) == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rigid_turn_rubs_nothing_and_turns_the_sticking_spring(axis):
    """A quarter turn of touching yarns about any axis: no loss, the spring turns with them."""
    body, steps = pressed(1, depth=0.01), 2000
    spring = np.array([2e-3, 1e-3, 0.0])
    body.model.tracker.contacts.spring[:, 0] = spring
    turn(body, axis, 0.5 * np.pi, steps)
    # the last step has moved the yarns but not yet looked at them
    last = rotated(spring, axis, 0.5 * np.pi * (1.0 - 1.0 / steps))
    assert body.model.tracker.contacts.spring[:, 0] == pytest.approx(last, abs=2e-5)
    energies = body.energies()
    assert abs(energies["friction"] + energies["contact_damping"]) < 1e-7


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rigid_turn_of_yarns_side_by_side_rubs_nothing_over_searches(axis):
    """Their contacts are found anew when they have moved, and must not take the turn of the last step for a slide."""
    body = pressed(0, depth=0.01)
    before = body.model.tracker.searches
    turn(body, axis, 0.25 * np.pi, 300)
    tracker = body.model.tracker
    assert tracker.count >= len(X) // 2 and tracker.searches > before + (3 if axis == 0 else 20)
    assert np.abs(tracker.contacts.spring[:, : tracker.count]).max() < 1e-6
    energies = body.energies()
    assert abs(energies["friction"] + energies["contact_damping"]) < 1e-9


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
