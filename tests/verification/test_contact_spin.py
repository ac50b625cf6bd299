"""Friction moment of crossings by hand-posed yarns: a turn under weight, cycles, any direction, a trellis, restart."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.models.explicit_model import State
from knittest.pose import ALL, Body, Chain, Patch, Table, YarnContact, ramp, section
from knittest.runs.specimen import run_specimen

MU, RADIUS, PRESS = 0.3, 0.5, 2.0
#: yarns so stiff that they turn as one
STIFF = section(1e4, 200.0, 0.2, 1e-3, torsion=200.0)
CONTACT = YarnContact(500.0, 250.0, MU, patch=Patch.disc(RADIUS))
LIMIT = 2.0 / 3.0 * MU * PRESS * RADIUS
X = np.arange(-2.0, 2.01, 0.5)


def crossed(contact: YarnContact, turning: Table, frame: np.ndarray) -> tuple[Body, int]:
    """A yarn under PRESS on a held one, turned about the normal by ``turning`` [rad/ms]; both in axes ``frame`` (rows).

    Returns the body and the group of the turn.
    """
    zero = np.zeros(len(X))
    lower, upper = np.column_stack([X, zero, zero]), np.column_stack([zero, X, zero + 0.4])
    body = Body.of_chains([Chain(lower @ frame, STIFF), Chain(upper @ frame, STIFF)], contact, damping=0.5)
    held, top, middle = np.arange(len(X)), np.arange(len(X), 2 * len(X)), len(X) + len(X) // 2
    body.boundary.move(held, ALL)
    body.boundary.move([middle], ["x", "y", "rx", "ry"], axes=frame)
    group = body.boundary.move([middle], "rz", turning, axes=frame)
    for dof, share in zip("xyz", frame[2], strict=True):
        body.boundary.load(top, dof, np.full(len(top), -PRESS * share / len(top)), ramp(1.0, 1.0))
    return body, group


def turned(contact: YarnContact, turning: Table, time: float, frame: np.ndarray) -> tuple[np.ndarray, Body]:
    """Times [ms], angles [rad] and moments [N mm] of a turn, (n, 3), and the body at its end."""
    body, group = crossed(contact, turning, frame)
    rows: list[tuple[float, float, float]] = []
    body.advance(time, lambda b: rows.append((b.time, turning.integral(b.time), b.reaction(group))))
    return np.array(rows), body


#: 0.3 rad there, 0.6 back, 0.3 there, at 0.1 rad/ms
CYCLE = Table((1.5, 2.0, 4.5, 5.5, 11.0, 12.0, 14.5, 15.0), (0.0, 0.1, 0.1, -0.1, -0.1, 0.1, 0.1, 0.0))


def test_crossed_yarns_under_a_weight_resist_a_turn_both_ways():
    """+-(2/3) mu N R, the loss that moment times the way, and a cycle's work is its loss."""
    rows, body = turned(CONTACT, CYCLE, 15.5, np.eye(3))
    time, _, moment = rows.T
    for first, last, sign in ((3.0, 4.5, 1.0), (6.5, 11.0, -1.0), (13.0, 14.5, 1.0)):
        sliding = moment[(time > first) & (time < last)]
        assert sliding.mean() == pytest.approx(sign * LIMIT, rel=0.01)
        assert np.ptp(sliding) < 0.1 * LIMIT
    energies = body.energies()
    way = 1.2 - 5.0 * LIMIT / body.model.law.torsional  # the spring gives way first: once, then twice a turn back
    assert energies["friction_of_spin"] == pytest.approx(LIMIT * way, rel=0.01)
    assert energies["friction"] == pytest.approx(energies["friction_of_spin"], rel=0.01)
    assert abs(energies["balance"]) < 1e-3 * energies["external"]


def test_the_moment_begins_as_a_spring():
    """A turn within the limit stores k w^2 / 2 and comes back without loss."""
    stiffness = crossed(CONTACT, Table((0.0,), (0.0,)), np.eye(3))[0].model.law.torsional
    turn = 0.5 * LIMIT / stiffness
    there = Table((2.0, 4.0, 6.0, 12.0, 14.0, 16.0), (0.0, 0.5 * turn, 0.0, 0.0, -0.5 * turn, 0.0))
    rows, body = turned(CONTACT, there, 20.0, np.eye(3))
    time, _, moment = rows.T
    assert moment[(time > 9.0) & (time < 11.0)].mean() == pytest.approx(stiffness * there.integral(10.0), rel=0.02)
    assert abs(moment[time > 18.0].mean()) < 0.02 * LIMIT
    assert body.energies()["friction_of_spin"] < 1e-3 * LIMIT * turn


def test_the_moment_is_the_same_in_any_direction():
    """All turned by a rotation of 1.1 rad about (1, 2, 3)."""
    axis = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    across = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    frame = (np.eye(3) + np.sin(1.1) * across + (1.0 - np.cos(1.1)) * across @ across).T
    half = Table((2.0, 3.0), (0.0, 0.05))
    straight, tilted = (turned(CONTACT, half, 8.0, f)[0][:, 2] for f in (np.eye(3), frame))
    assert tilted == pytest.approx(straight, abs=0.01 * LIMIT)


def test_it_goes_on_from_a_state_to_the_same_bits():
    half = Table((2.0, 3.0), (0.0, 0.05))
    body, _ = crossed(CONTACT, half, np.eye(3))
    body.advance(3.5)
    kept: State = body.model.state()
    assert abs(body.model.tracker.contacts.twist[0]) > 1e-3
    again, _ = crossed(CONTACT, half, np.eye(3))
    going = again.start()
    again.model.restore(kept)
    going.time = body.time
    for one in (body, again):
        one.advance(1.0)
    assert again.position.tobytes() == body.position.tobytes()
    assert again.model.tracker.contacts.twist.tobytes() == body.model.tracker.contacts.twist.tobytes()


def test_a_trellis_of_rigid_yarns():
    """n crossings of moment M: F = n M dg/dd, d = H sin g the way of the driven ends at a height H."""
    grid, depth, height, contact = 2.0 * np.arange(3), 0.004, 5.0, CONTACT
    y = np.arange(-1.0, 6.0)
    flat, chains = np.zeros(len(y)), []
    chains += [Chain(np.column_stack([y, flat + g, flat]), STIFF) for g in grid]
    chains += [Chain(np.column_stack([flat + g, y, flat + 0.4 - depth]), STIFF) for g in grid]
    body = Body.of_chains(chains, contact, damping=0.2)
    n, node = len(y), np.arange(6 * len(y)).reshape(6, len(y))
    body.boundary.move(node[0], ALL)
    body.boundary.move(node[1:3].ravel(), ["z", "rx", "ry", "rz"])
    body.boundary.move(node[3:].ravel(), ["z", "rx", "ry"])
    body.boundary.move(node[3:, 1], ["x", "y"])  # hinges on the held yarn
    pull = body.boundary.move(node[3:, n - 1], "x", ramp(2.0, 0.05))
    body.start()
    body.model.tracker.contacts.reach[:] = 0.4  # touching, though they overlap at the start
    rows: list[tuple[float, float]] = []
    body.advance(26.0, lambda b: rows.append((b.position[node[3, n - 1], 0] / height, b.reaction(pull))))
    sine, force = np.array(rows).T
    assert sine[-1] > 0.24
    seen = sine > 0.05
    moment = 2.0 / 3.0 * MU * 500.0 * depth * RADIUS
    expected = 9.0 * moment / (height * np.sqrt(1.0 - sine[seen] ** 2))
    assert force[seen] == pytest.approx(expected, rel=0.03)


def test_a_frame_of_yarns_with_patches_keeps_its_gates_and_books_what_spins():
    patch = "{radius: {inlay_inlay: 0.5, inlay_loop: 0.5, loop_loop: 0.5}}"
    sets = ["rig.side=15", "rig.max_angle=12", f"fabric.contact.patch={patch}"]
    found = run_specimen(resolve(variant="2", scale="meso", preset="quick", test="picture-frame", sets=sets))
    energies = found.history.energies
    assert found.quality.failures == ()
    spun, friction = energies["friction_spin_mj"], energies["friction_mj"]
    assert 0.1 * friction[-1] < spun[-1] < 0.6 * friction[-1]
    assert (np.diff(spun) > -1e-9).all()
