"""Contacts are found before yarns touch, at the ends of yarns too; an overlap that was found late recovers."""

from dataclasses import replace

import numpy as np
import pytest

from knittest.kernels.search import REST
from knittest.models.contact_tracker import LEFT_FREE, PORTION, RECOVERY
from knittest.pose import ALL, Body, Chain, YarnContact, section
from knittest.solve.relaxation import settle

RADIUS, SIZE = 0.25, 1.0
YARN = section(5e3, 1.0, RADIUS, 1e-3)
CONTACT = YarnContact(normal=100.0, tangential=50.0, friction=0.2)
SPEED = 2.0  # mm/ms


def over(tip: float, angle_deg: float = 90.0) -> Body:
    """A yarn along x, which ends at ``tip`` [mm], falls from 0.3 mm on a fixed yarn through the origin."""
    way, angle = np.arange(-3.0, 3.01, SIZE), np.deg2rad(angle_deg)
    below = np.column_stack([way * np.cos(angle), way * np.sin(angle), np.zeros(7)])
    above = np.column_stack([tip - SIZE * np.arange(6.0, -1.0, -1.0), np.zeros(7), np.full(7, 2.0 * RADIUS + 0.3)])
    body = Body.of_chains([Chain(below, YARN), Chain(above, YARN)], CONTACT)
    body.boundary.move(np.arange(7), ALL)
    body.boundary.move(np.arange(7, 14), ["x", "y", "rx", "ry", "rz"])
    body.velocity[7:, 2] = -SPEED
    return body


def hidden(body: Body) -> float:
    """Deepest overlap without force over the radius."""
    return float(body.model.tracker.force_free().max(initial=0.0))


@pytest.mark.parametrize("tip", [0.45, 0.1, 0.0, -0.2, -0.4])
@pytest.mark.parametrize("angle", [90.0, 40.0])
def test_the_end_of_a_yarn_presses_another(tip: float, angle: float) -> None:
    """The last half element, and a cap of the yarn's radius about its last node. 7 kinetic mass units of 0.25 mJ at
    most sink in by sqrt(2 E / k) < 0.02 mm below the height at which the cap touches.
    """
    body, deepest = over(tip, angle), np.inf
    beside = max(-tip, 0.0) * np.sin(np.deg2rad(angle))
    for _ in range(60):
        body.advance(0.01)
        deepest = min(deepest, float(body.position[13, 2]))
        assert hidden(body) < 1e-3
    assert deepest > np.sqrt(4.0 * RADIUS**2 - beside**2) - 0.05
    assert body.velocity[13, 2] > 0.0


def pressed(held: bool) -> Body:
    """Two yarns that cross, the upper one moved by hand into the lower one by 0.1 mm, half of it without force."""
    way = np.arange(-3.0, 3.01, SIZE)
    below = np.column_stack([np.zeros(7), way, np.zeros(7)])
    above = np.column_stack([way, np.zeros(7), np.full(7, 2.0 * RADIUS + 0.01)])
    body = Body.of_chains([Chain(below, YARN), Chain(above, YARN)], CONTACT)
    body.boundary.move(np.arange(7), ALL)
    if held:
        body.model.nodes.inv_mass[7:] = 0.0
    body.step(1)
    body.model.nodes.position[2, 7:14] -= 0.11
    tracker = body.model.tracker
    tracker.contacts.offset[2] -= 0.11 * np.sign(tracker.contacts.offset[2])
    tracker.contacts.reach[: tracker.count] = 2.0 * RADIUS - 0.05
    return body


def test_an_overlap_that_came_without_force_gets_it_slowly_and_its_energy_is_booked() -> None:
    """The penalty's energy at a fixed gap goes from k 0.05^2 / 2 to k (0.1 - 1 % of the radius)^2 / 2."""
    body = pressed(held=True)
    tracker = body.model.tracker
    assert tracker.count == 1
    given, free = body.start().recovered_energy, hidden(body)
    assert free == pytest.approx(0.05 / RADIUS, abs=0.02)
    while hidden(body) > LEFT_FREE + 1e-9:
        before = hidden(body)
        body.step(1)
        assert 0.0 < before - hidden(body) <= min(max(before * body.dt / RECOVERY, REST), PORTION) + 1e-9
    assert hidden(body) == pytest.approx(LEFT_FREE, abs=1e-9)
    normal, depth = 100.0, 0.1 - LEFT_FREE * RADIUS
    found = body.start().recovered_energy
    assert body.energies()["contact_recovery"] == found
    assert found - given == pytest.approx(0.5 * normal * (depth**2 - (0.1 - free * RADIUS) ** 2), rel=0.02)


def test_yarns_that_were_found_late_are_pushed_apart_and_the_balance_holds() -> None:
    """Let go, the upper yarn leaves with the energy of the depth that it was given, and no other.

    k 0.05^2 / 2 comes from the move by hand, which no work is booked for.
    """
    body = pressed(held=False)
    for _ in range(250):
        body.advance(0.002)
    assert hidden(body) == 0.0
    energies = body.energies()
    assert energies["kinetic"] > 0.02
    assert energies["contact_recovery"] > 0.008
    assert energies["balance"] == pytest.approx(-0.5 * 100.0 * 0.05**2, rel=0.02)


def test_energy_given_before_the_test_is_no_work_of_the_test() -> None:
    body = pressed(held=True)
    going = body.start()
    settle(body.model, going.drive, going.tally, body.dt)
    assert hidden(body) == pytest.approx(LEFT_FREE, abs=1e-9)
    assert going.recovered_energy == 0.0 and going.tally.late[0] == 0.0


def test_how_deep_a_contact_was_found_is_kept() -> None:
    body = pressed(held=True)
    body.advance(0.05)
    assert body.start().tally.late[0] == pytest.approx(0.05 / RADIUS - LEFT_FREE, abs=0.02)
    assert hidden(body) < 0.1


@pytest.mark.parametrize("beside", [0.0, 3.0])
def test_a_cut_end_that_is_found_late_is_pushed_out_of_the_middle_of_a_yarn(beside: float) -> None:
    """Found beside the other yarn's cut end it is left alone: it lay in that end, which does not press it."""
    way, contact = np.arange(-6.0, 6.01, SIZE), replace(CONTACT, cut=2)
    zero = np.zeros(13)
    below = np.column_stack([way, zero, zero])
    above = np.column_stack([zero + beside, way + 5.5, zero + 2.0 * RADIUS + 0.2])
    fixed = np.column_stack([zero, way, zero - 2.0 * RADIUS - 0.01])  # a contact that the search has before
    body = Body.of_chains([Chain(points, YARN) for points in (below, above, fixed)], contact)
    body.boundary.move([*range(13), *range(26, 39)], ALL)
    body.step(1)
    assert body.model.tracker.count == 1
    body.model.nodes.position[2, 13:26] -= 0.25
    body.advance(0.5)
    rise = body.velocity[13:26, 2].max()
    assert rise > 0.05 if beside == 0.0 else abs(rise) < 1e-9


def test_a_contact_in_recovery_goes_on_from_its_state_to_the_bit() -> None:
    ends = []
    for restored in (False, True):
        body = pressed(held=True)
        tracker = body.model.tracker
        tracker.contacts.accepted[0] = 0.02
        body.advance(0.05)
        if restored:
            state = tracker.state()
            tracker.recovering, tracker.contacts.accepted[0] = 0, 0.0
            tracker.restore(state)
        body.advance(0.05)
        ends.append((body.start().recovered_energy, tracker.contacts.accepted[0], tracker.contacts.reach[0]))
    assert ends[0][0] > 0.0 and ends[0][1] == 0.02
    assert ends[0] == ends[1]


def test_two_crossings_of_yarns_about_an_element_apart_are_tracked_both() -> None:
    """Arcs that bend past each other at 28 degrees, one a little beside the other, are nearest in two places."""
    way, angle = np.arange(-2.0, 3.0), np.deg2rad(28.0)
    above = np.column_stack([way, np.zeros(5), 0.52 - 0.3 * way**2])
    below = np.column_stack([way * np.cos(angle) + 0.05, way * np.sin(angle) + 0.025, 0.3 * way**2])
    body = Body.of_chains([Chain(points, section(5e3, 1.0, 0.17, 1e-3)) for points in (above, below)], CONTACT)
    body.step(1)
    tracker = body.model.tracker
    places = tracker.contacts.piece[:, : tracker.count] + tracker.contacts.parameter[:, : tracker.count]
    assert tracker.count == 2
    assert 0.9 < abs(places[0, 0] - places[0, 1]) < 1.1
