"""Yarns that bend round others, as the search finds them: pressed piece by piece, one crossing each, restored."""

import numpy as np
import pytest

from knittest.kernels.contact import FIRST_ALONG, POINT
from knittest.models.crossings import crossings
from knittest.pose import ALL, Body, Chain, YarnContact, section

DRUM, SIZE, N = 0.4, 0.1, 12
STEP = (DRUM + SIZE) * np.pi / N


def half_turn(place: float) -> Chain:
    """A yarn over half of a drum along z, at ``place`` there, with straight legs; its spline just touches."""
    angle = np.linspace(np.pi, 0.0, N + 1)
    radius = (DRUM + SIZE) / (1.0 - 0.25 * (1.0 - np.cos(angle[0] - angle[1])))
    leg = -STEP * np.arange(1, 7)
    arc = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(N + 1, place)])
    left, right = (np.column_stack([np.full(6, p[0]), leg, np.full(6, place)]) for p in (arc[0], arc[-1]))
    return Chain(np.vstack([left[::-1], arc, right]), section(2e3, 1e-3, SIZE, 1e-3))


def pulled(*places: float) -> Body:
    """Yarns over half of one fixed drum, pulled by 2 N at their ends."""
    axis = np.column_stack([np.zeros(13), np.zeros(13), np.linspace(-1.2, 1.2, 13)])
    chains = [*(half_turn(place) for place in places), Chain(axis, section(1e4, 5.0, DRUM, 1e-3))]
    body = Body.of_chains(chains, YarnContact(500.0, 250.0, 0.0), damping=10.0)
    each = len(chains[0].points)
    ends = [first + end for first in range(0, each * len(places), each) for end in (0, each - 1)]
    body.boundary.move(np.arange(each * len(places), each * len(places) + 13), ALL)
    for end in ends:
        body.boundary.load([end], "y", -2.0)
    body.advance(0.5)
    return body


@pytest.fixture(scope="module")
def body() -> Body:
    return pulled(-0.4, 0.4)


def test_pieces_round_a_yarn_are_pressed_one_by_one(body):
    """All along half a turn, and on no piece twice; the mean force is 2 T / D a length, to the legs' uneven share."""
    tracker = body.model.tracker
    line, force = tracker.contacts.line[: tracker.count], tracker.contacts.force[:, : tracker.count]
    pieces = tracker.contacts.piece[:, : tracker.count]
    assert set(line) == {FIRST_ALONG}
    assert len({tuple(p) for p in pieces.T}) == tracker.count
    pressed = np.linalg.norm(force, axis=0)
    assert 2 * (N - 1) <= (pressed > 0.0).sum() <= 2 * (N + 1)
    assert np.median(pressed[pressed > 0.0]) == pytest.approx(2.0 * STEP / (DRUM + SIZE), rel=0.03)
    assert tracker.force_free().max() < 2e-3


def test_a_row_of_contacts_is_one_crossing(body):
    """Two yarns: two crossings of all their normal forces, pi T each without friction."""
    (found,) = crossings(body.model).values()
    assert found.count == pytest.approx(2.0)
    assert found.normal_force == pytest.approx(np.pi * 2.0, rel=0.03)
    assert found.largest_force == pytest.approx(found.normal_force, rel=0.01)
    assert found.angle == pytest.approx(90.0, abs=0.5)


def test_a_wrapped_yarn_goes_on_from_its_state(body):
    """Marks of what lies along others are part of it: looked for anew, contacts would come in another order."""
    tracker = body.model.tracker
    state = tracker.state()
    along = tracker._along.copy()
    assert (along >= 0).any()
    tracker._along[:] = -1
    tracker.restore(state)
    assert (tracker._along == along).all()


def test_a_yarn_that_is_straightened_ends_as_a_point():
    """Moved off its drum and laid straight across it, it lies along it no longer."""
    body = pulled(0.0)
    tracker, each = body.model.tracker, len(half_turn(0.0).points)
    x = body.model.nodes.position
    x[0, :each], x[1, :each] = STEP * (np.arange(each) - each // 2), DRUM + SIZE + 0.01
    tracker._moved[:] = True
    tracker._find_contacts()
    assert tracker.count == 1
    assert tracker.contacts.line[0] == POINT
    assert (tracker._along < 0).all()
