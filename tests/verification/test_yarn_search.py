"""The search for contacts against all pairs of pieces, and what it looks at along with what has moved."""

import itertools

import numpy as np
import pytest

from knittest.base.errors import NumericalError
from knittest.kernels import search
from knittest.kernels.pair_search import BEYOND, crossing
from knittest.models.contact_tracker import CONTACT_SKIN
from knittest.models.explicit_model import make_nodes
from knittest.pose import Body, Chain, YarnContact, section

CARD = section(1e3, 5.0, 0.1, 1e-3)
RADIUS = 0.1


def wavy(rng: np.random.Generator, family: int, place: float, size: float) -> Chain:
    """A yarn that waves in both directions across itself, of elements of ``size`` [mm]; families never overlap."""
    along = np.arange(0.0, 6.0, size)
    amplitude, pitch, phase = rng.uniform(0.02, 0.05, 2), rng.uniform(3.0, 6.0, 2), rng.uniform(0.0, 6.0, 2)
    across, height = (a * np.sin(2.0 * np.pi * along / p + f) for a, p, f in zip(amplitude, pitch, phase, strict=True))
    columns = [along, place + across] if family == 0 else [place + across, along]
    return Chain(np.column_stack([*columns, height + family * (2.0 * RADIUS + 0.08)]), CARD)


@pytest.fixture(scope="module")
def body() -> Body:
    """Two families of eight yarns of unlike elements, some neighbours of which nearly touch all along."""
    rng = np.random.default_rng(3)
    places = np.cumsum(rng.uniform(0.3, 0.4, 8))
    chains = [wavy(rng, family, place, rng.choice([0.25, 1.0])) for family in range(2) for place in places]
    body = Body.of_chains(chains, YarnContact(500.0, 250.0, 0.3, 0.0))
    body.start()
    return body


def test_the_search_finds_what_all_pairs_show(body):
    """Every pair of pieces whose closest points lie on them, nearer than the skin: cells and bounds lose none."""
    tracker, group = body.model.tracker, body.model.group
    x, y, z = body.model.nodes.position
    near: dict[tuple[int, int], tuple[float, float, float]] = {}
    for i, j in itertools.combinations(np.flatnonzero(group.is_piece), 2):
        if group.chain[i] != group.chain[j] or j - i > group.exclude[i]:
            s, t, *offset, line = crossing(x, y, z, i, j)
            if 0.0 <= s < 1.0 and 0.0 <= t < 1.0 and np.linalg.norm(offset) < 2.0 * RADIUS + CONTACT_SKIN:
                near[int(i), int(j)] = s, t, line
    piece, place = tracker.contacts.piece[:, : tracker.count], tracker.contacts.parameter[:, : tracker.count]
    found = {(int(i), int(j)) for i, j in piece.T}
    lines = {pair for pair, (*_, line) in near.items() if line}
    last = group.is_piece & ~np.roll(group.is_piece, -1)
    first = group.is_piece & ~np.roll(group.is_piece, 1)
    at_end = (first | last)[piece].any(axis=0)
    beyond = ((place < 0.0) & first[piece]) | ((place >= 1.0) & last[piece])
    assert beyond.any()  # up to the last node of a yarn
    assert found - set(near) <= {(int(i), int(j)) for i, j in piece[:, at_end].T}
    assert ((place >= -BEYOND) & (place <= 1.0 + BEYOND) | beyond).all()
    assert np.linalg.norm(tracker.contacts.offset[:, : tracker.count], axis=0).max() < 2.0 * RADIUS + CONTACT_SKIN
    assert lines <= found
    assert len(lines) > 10
    assert len(near) - len(lines) > 10
    for i, j in set(near) - found:  # two pieces may see the same crossing
        s, t, _ = near[i, j]
        same = (group.chain[piece[0]] == group.chain[i]) & (group.chain[piece[1]] == group.chain[j])
        apart = np.abs(piece + place - np.array([[i + s], [j + t]])).max(axis=0)
        assert same.any()
        assert apart[same].min() < search.SAME


def test_what_goes_half_the_way_is_looked_at_along_but_calls_for_no_search(body):
    nodes, n = body.model.nodes, body.model.n_nodes
    since, moved = nodes.position[:, :n].copy(), np.zeros(n, np.bool_)
    since[0, 3] += 1.1 * search.SOON
    assert search.flag_moved(nodes, since, 0.0, 1.0, moved)[0] == 0
    since[1, 5], since[2, 7] = since[1, 5] - 1.01, since[2, 7] - 0.9 * search.SOON
    count, speed = search.flag_moved(nodes, since, 0.0, 1.0, moved)
    assert (count, speed) == (1, 0.0)
    assert np.flatnonzero(moved).tolist() == [3, 5]


def test_the_common_motion_is_found_and_what_moves_beside_it():
    """A sheared and turned sheet: the fit returns the gradient; one node that moves beside it is flagged."""
    rng = np.random.default_rng(5)
    nodes = make_nodes(rng.uniform(-30.0, 30.0, (500, 3)), np.ones(500), np.ones(500))
    reference, motion = nodes.position[:, :500].copy(), np.zeros((2, 3, 4))
    gradient, shift = rng.uniform(-0.1, 0.1, (3, 3)), rng.uniform(-5.0, 5.0, (3, 1))
    nodes.position[:, :500] += gradient @ reference + shift
    nodes.velocity[:, :500] = 2.0 * gradient @ reference
    basis = search.motion_basis(reference, 0.0)
    search.fit_motion(nodes, reference, basis, 1, motion)
    np.testing.assert_allclose(motion[0], np.hstack([gradient, shift]), atol=1e-12)
    np.testing.assert_allclose(motion[1], np.hstack([2.0 * gradient, 0.0 * shift]), atol=1e-12)
    moved = np.zeros(500, np.bool_)
    nodes.position[1, 7] += 1.0
    count, farthest, _ = search.flag_deviating(nodes, reference, motion, np.zeros((3, 500)), 0.1, 0.9, moved)
    assert (count, np.flatnonzero(moved).tolist()) == (1, [7])
    assert farthest == pytest.approx(1.0, rel=1e-9)


def parallel_yarns(n: int, spacing: float) -> Body:
    """``n`` straight yarns side by side, ``spacing`` [mm] apart, so far that none is tracked."""
    along, zero = np.arange(4.0), np.zeros(4)
    chains = [Chain(np.column_stack([along, zero + k * spacing, zero]), CARD) for k in range(n)]
    body = Body.of_chains(chains, YarnContact(500.0, 250.0, 0.3, 0.0))
    body.start()
    assert body.model.tracker.count == 0
    return body


@pytest.mark.parametrize("turns", [0.0, 0.02])
def test_yarns_that_only_the_common_motion_brings_together_are_found(turns):
    """A sheet that is compressed evenly, and turns: no yarn moves beside the others, and all neighbours meet."""
    n, spacing = 40, 0.4
    body = parallel_yarns(n, spacing)
    position, tracker = body.model.nodes.position, body.model.tracker
    start, gap, width = position.copy(), spacing, 2.0 * RADIUS
    for step in range(1, 120):
        angle, share = turns * step, 1.0 - 0.005 * step
        gap = share * spacing
        x, y = start[0], share * start[1]
        position[0], position[1] = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
        tracker.update(0.0)
        if gap < width:
            touching = tracker.group.chain[tracker.contacts.piece[:, : tracker.count]]
            assert {tuple(pair) for pair in touching.T.tolist()} >= {(k, k + 1) for k in range(n - 1)}
    assert gap < width


def test_a_sheet_that_only_moves_as_a_whole_is_not_searched_again():
    """It is moved by 50 mm: far beyond the skin."""
    body = parallel_yarns(40, 0.4)
    position, tracker = body.model.nodes.position, body.model.tracker
    searches = tracker.searches
    for _ in range(100):
        position[0] += 0.5
        tracker.update(0.0)
    assert tracker.searches == searches


def test_the_largest_strain_since_the_whole_search_bounds_what_it_closes():
    """A sheet that was strained and is straight again: pieces searched meanwhile moved by the larger strain."""
    tracker = parallel_yarns(10, 0.4).model.tracker
    tracker._motion[0, 0, 0] = 0.01
    closed = tracker._closing_by_strain(0.0, 0.5)
    assert closed == pytest.approx(4.0 * 0.01 * (RADIUS + 0.5) / 0.99)
    tracker._motion[:] = 0.0
    assert tracker._closing_by_strain(0.0, 0.5) == closed


def test_one_node_that_is_not_finite_does_not_end_the_search():
    """The affine motion cannot be fitted: displacements are absolute, and the search names the node."""
    body = parallel_yarns(40, 0.4)
    body.model.nodes.position[0] += 1.0
    body.model.nodes.position[1, 8] = np.nan
    with pytest.raises(NumericalError, match="position of node 8"):
        body.model.tracker.update(0.0)


def test_displacements_begin_anew_for_what_was_searched_in_a_sheet_that_strains():
    """A sheet strains, shifts, and one yarn moves by itself: its displacement and no other begins where it is."""
    body = parallel_yarns(40, 0.4)
    position, tracker = body.model.nodes.position, body.model.tracker
    start = position.copy()
    own = np.array([0.0, 0.0, 0.05])
    position[0], position[1] = 1.003 * start[0] + 7.0, 0.996 * start[1] - 3.0
    position[:, 8:12] += own[:, None]
    searches = tracker.searches
    tracker.update(0.0)
    assert tracker.searches == searches + 1
    np.testing.assert_allclose(tracker._since[:, 8:12], np.repeat(own[:, None], 4, axis=1), atol=0.004)
    np.testing.assert_array_equal(tracker._since[:, 20:], 0.0)
    tracker.update(0.0)  # nothing moved since
    assert tracker.searches == searches + 1


def test_what_strain_and_speed_close_until_the_next_look_counts():
    """Nothing has moved yet: a rate of strain alone calls for a whole search, a node's own speed for its own."""
    body = parallel_yarns(40, 0.4)
    nodes, tracker = body.model.nodes, body.model.tracker
    searches = tracker.searches
    nodes.velocity[1] = -0.01 * nodes.position[1]
    tracker.update(0.01)
    assert tracker.searches == searches
    tracker.update(5.0)
    assert tracker.searches == searches + 1


def crossing_yarns(gap: float, at: float) -> Body:
    """A yarn along x, and one along y that crosses it ``gap`` [mm] above touching, at x = ``at`` [mm]."""
    along, zero = np.arange(7.0), np.zeros(7)
    lower = Chain(np.column_stack([along, zero, zero]), CARD)
    upper = Chain(np.column_stack([zero + at, along - 3.2, zero + 2.0 * RADIUS + gap]), CARD)
    body = Body.of_chains([lower, upper], YarnContact(500.0, 250.0, 0.3, 0.0))
    body.start()
    return body


def test_a_piece_is_looked_at_when_a_node_beside_its_own_moves():
    """A yarn that turns about a node which stands."""
    body = crossing_yarns(1.2 * CONTACT_SKIN, at=2.6)
    position, tracker = body.model.nodes.position, body.model.tracker
    assert tracker.count == 0
    for _ in range(30):  # the place at 2.6 rises by 0.405 of this
        position[2, 2] += 0.1 * CONTACT_SKIN
        tracker.update(0.0)
    assert tracker.count == 1


def test_ways_there_and_back_do_not_add_up_unseen():
    """A yarn draws back by less than is looked at; the other is looked at; then both come near."""
    body = crossing_yarns(1.01 * CONTACT_SKIN, at=3.2)
    position, tracker = body.model.nodes.position, body.model.tracker
    tracker._since[2, 7:14] -= 0.49 * search.SOON * CONTACT_SKIN  # as if it had drawn back since

    def moved(yarn: int, axis: int, skins: float) -> int:
        position[axis, 7 * yarn : 7 * yarn + 7] += skins * CONTACT_SKIN
        tracker.update(0.0)
        return tracker.count

    assert moved(0, 0, 0.6) == 0
    moved(1, 2, -0.49 * (1.0 + search.SOON))
    assert moved(0, 2, 0.49) == 1


def side_by_side(shift: float, cut: int) -> Body:
    """Two straight yarns of nine nodes that lie 0.9 of their width apart, one ``shift`` [mm] ahead."""
    along, zero = np.arange(9.0), np.zeros(9)
    yarns = [np.column_stack([along + k * shift, zero + 1.8 * RADIUS * k, zero]) for k in range(2)]
    body = Body.of_chains([Chain(points, CARD) for points in yarns], YarnContact(500.0, 250.0, 0.3, 0.0, cut=cut))
    body.start()
    return body


@pytest.mark.parametrize(
    ("cut", "shift", "touching"), [(0, 0.0, range(1, 8)), (2, 0.0, range(3, 6)), (2, 4.0, [4, 5, 7, 7])]
)
def test_cut_ends_do_not_press_each_other_but_the_middles_of_others(cut, shift, touching):
    """Pieces 1, 2, 6, 7 of either yarn are cut off by jaws; where one lies on the middle of the other it presses.

    The ends of both yarns, beyond the middle of their last elements, press at points of pieces 4 and 7.
    """
    tracker = side_by_side(shift, cut).model.tracker
    assert sorted(tracker.contacts.piece[0, : tracker.count].tolist()) == list(touching)
    ends = [1, 2, 6, 7] if cut else []
    expected = [i in ends or j - 9 in ends for i, j in tracker.contacts.piece[:, : tracker.count].T]
    assert tracker.end_flags().tolist() == expected


def bent(curvature: float, gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Control points (13, 3) of a yarn that bends up from a straight one below, ``gap`` [mm] apart at the middle."""
    along, zero = 0.4 * np.arange(-6.0, 7.0), np.zeros(13)
    height = gap + 0.5 * curvature * (along**2 - 0.2**2)
    return np.column_stack([along, zero, height]), np.column_stack([along, zero, zero])


def test_yarns_side_by_side_that_bend_apart_and_back_keep_the_depth_of_their_middle():
    """Pressed along a line by 5 um; bent until they touch at a point: it has that depth, no other contact has any.

    Bent back it stays, and no line is added where it is: both would press.
    """
    upper, lower = bent(0.0, 1.9 * RADIUS)
    body = Body.of_chains([Chain(upper, CARD), Chain(lower, CARD)], YarnContact(500.0, 250.0, 0.3, 0.0))
    body.start()
    tracker, position = body.model.tracker, body.model.nodes.position
    assert tracker.contacts.line[: tracker.count].all()
    tracker.contacts.reach[: tracker.count] = 1.95 * RADIUS
    position[:, :13] = bent(1.5, 1.9 * RADIUS)[0].T
    tracker.update(0.0)
    gap = np.linalg.norm(tracker.contacts.offset[:, : tracker.count], axis=0)
    depth = np.sort(tracker.contacts.reach[: tracker.count] - gap)
    assert depth[-1] == pytest.approx(0.05 * RADIUS, abs=1e-4)
    assert depth[:-1] == pytest.approx(0.0, abs=1e-9)
    assert not tracker.contacts.line[: tracker.count].all()
    pairs = tracker.contacts.piece[:, : tracker.count].T.tolist()
    position[:, :13] = upper.T
    tracker.update(0.0)
    now = tracker.contacts.piece[:, : tracker.count].T.tolist()
    kept = [pair for pair, line in zip(now, tracker.contacts.line[: tracker.count], strict=True) if not line]
    assert kept == [pair for pair in pairs if pair in kept]
    assert len(kept) == 1
    assert len(now) == len({tuple(pair) for pair in now})  # no line where the crossing is
