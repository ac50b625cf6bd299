"""Pieces of yarns that lie along others, what their contacts hold and inherit. Plain Python."""

import numpy as np
import pytest
from contact_cases import contacts_of
from plain import plain

from knittest.kernels.contact import FIRST_ALONG, POINT, SECOND_ALONG, SIDE_BY_SIDE, closest_step
from knittest.kernels.line_contact import (
    MOST,
    SPREAD,
    Pieces,
    add_to_lists,
    contact_kind,
    flag_other_kinds,
    mark_found,
    mark_tracked,
    predecessor,
)
from knittest.kernels.pair_search import _closest
from knittest.kernels.search import _needs_search
from knittest.kernels.state import Contacts
from knittest.models.image_contacts import LINES

APART, PIECE = 0.5, 0.1


def bent(radius: float, along: int, lowest: float, up: float, n: int = 11) -> np.ndarray:
    """Control points (n, 3) of an arc over the origin in the plane of ``along`` (0: x, 1: y) and z, from its lowest or
    (``up`` -1) highest point at ``lowest``; straight where ``radius`` is infinite.
    """
    way = PIECE * (np.arange(n) - n // 2)
    points = np.zeros((n, 3))
    points[:, along] = way if np.isinf(radius) else radius * np.sin(way / radius)
    points[:, 2] = lowest + (0.0 if np.isinf(radius) else up * radius * (1.0 - np.cos(way / radius)))
    return points


class Two:
    """Two yarns of 11 nodes that cross over the origin, ``gap`` apart, marks of theirs, and a pair at their middles."""

    def __init__(self, first: np.ndarray, second: np.ndarray, master: np.ndarray | None = None) -> None:
        n = len(first)
        self.position, self.middle = np.vstack([first, second]).T, (n // 2, n + n // 2)
        one, chain = np.ones(2 * n), np.repeat([0, 1], n)
        self.pieces = Pieces(
            0.25 * one, 0.5 * PIECE * one, np.full(2 * n, 5), chain, one < 0.0,
            np.arange(2 * n) if master is None else master, np.full((2 * n, MOST), -1),
        )  # fmt: skip

    def found(self, line: float = POINT) -> int:
        """Mark by a pair found at the middles; returns how many marks are new."""
        pairs, places = np.array([[self.middle]]), np.zeros((1, 1, 6))
        offset = self.position[:, self.middle[0]] - self.position[:, self.middle[1]]
        places[0, 0] = [0.5, 0.5, *offset, line]
        return int(plain(mark_found)(pairs, places, np.array([1]), self.position, np.zeros(0), self.pieces))

    @property
    def marked(self) -> dict[int, list[int]]:
        """Marks by piece."""
        return {i: [int(k) for k in row if k >= 0] for i, row in enumerate(self.pieces.along) if row.max() >= 0}

    def kind(self, i: int = 0, j: int = 0) -> float:
        """Kind of the pair ``i``, ``j`` pieces beyond the middles."""
        return float(plain(contact_kind)(self.middle[0] + i, self.middle[1] + j, self.pieces))


STRAIGHT = np.inf


def crossed(first: float, second: float) -> Two:
    """The first yarn above, along x, which bends down round the second, along y, which bends up round it."""
    return Two(bent(first, 0, APART, -1.0), bent(second, 1, 0.0, 1.0))


def test_a_yarn_bent_about_the_axis_of_another_lies_along_it():
    """Two pieces on either side of the one that was found; the straight yarn lies along nothing."""
    pair = crossed(APART, STRAIGHT)
    assert pair.found() == 2 * SPREAD + 1
    assert pair.marked == {i: [1] for i in range(5 - SPREAD, 6 + SPREAD)}
    assert pair.kind() == FIRST_ALONG
    assert pair.kind(SPREAD, 3) == FIRST_ALONG  # any piece of that yarn
    assert pair.kind(SPREAD + 1) == POINT
    other = crossed(STRAIGHT, APART)
    assert other.found() == 2 * SPREAD + 1 and other.kind() == SECOND_ALONG
    assert set(other.marked) == set(range(16 - SPREAD, 17 + SPREAD))


@pytest.mark.parametrize(
    ("first", "second"),
    [(STRAIGHT, STRAIGHT), (2.0 * APART, STRAIGHT), (1.2 * APART, STRAIGHT), (1.2 * APART, 1.2 * APART)],
)
def test_crossings_with_one_closest_point_are_points(first, second):
    """(1 - d/R) (1 - d/r): 1, 0.5, 0.17 and 0.028, above 0.02."""
    pair = crossed(first, second)
    assert pair.found() == 0
    assert pair.kind() == POINT


def test_hooks_that_bend_round_each_other_are_held_on_the_sharper_one():
    """(1 - 1/1.1) (1 - 1/1.15) = 0.012; alike, the first is held. Both inside of each other's
    centres of curvature make a positive product."""
    for first, second, kind in [
        (1.2, 1.01, SECOND_ALONG), (1.1, 1.15, FIRST_ALONG), (1.15, 1.14, FIRST_ALONG), (0.6, 0.9, FIRST_ALONG),
        (0.9, 0.6, SECOND_ALONG), (0.50, 0.52, FIRST_ALONG),
    ]:  # fmt: skip
        pair = crossed(first * APART, second * APART)
        assert pair.found() == 2 * SPREAD + 1
        assert pair.kind() == kind


def test_a_shallow_crossing_of_yarns_that_hardly_bend_is_no_wrap():
    """At 20 degrees and d/R = 0.1: determinant 0.017, but neither bends round the other, and none would stay marked."""
    pair = crossed(10.0 * APART, STRAIGHT)
    angle = np.deg2rad(20.0)
    along = pair.position[1, 11:].copy()
    pair.position[0, 11:], pair.position[1, 11:] = along * np.cos(angle), along * np.sin(angle)
    assert pair.found() == 0


@pytest.mark.parametrize(("ratio", "stays"), [(0.2, True), (0.1, False)])
def test_what_lies_along_stays_until_it_hardly_bends(ratio, stays):
    """Held contacts mark anew while 1 - d/R is below 0.85, whatever the determinant."""
    for first, second, line in [(APART / ratio, STRAIGHT, FIRST_ALONG), (STRAIGHT, APART / ratio, SECOND_ALONG)]:
        assert (crossed(first, second).found(line) > 0) is stays


def test_copies_in_a_cell_have_their_marks_in_common():
    """A copy of the wrapping yarn, with no mark of its own, and one of the other."""
    master = np.arange(22)
    pair = crossed(APART, STRAIGHT)
    pair.found()
    copies = Two(bent(APART, 0, APART, -1.0), bent(STRAIGHT, 1, 0.0, 1.0), master)
    copies.pieces.chain[:] = np.repeat([2, 3], 11)  # numbers of the copies; those of their masters count
    everything = Pieces(*(
        np.concatenate([a, b]) for a, b in zip(pair.pieces[:6], copies.pieces[:6], strict=True)
    ), pair.pieces.along)  # fmt: skip
    assert plain(contact_kind)(22 + 5, 33 + 5, everything) == FIRST_ALONG
    assert plain(contact_kind)(33 + 5, 22 + 5, everything) == SECOND_ALONG
    assert plain(contact_kind)(5, 33 + 5, everything) == FIRST_ALONG


def test_where_both_lie_along_each_other_the_lower_master_is_held():
    """Whichever way round a copy is."""
    pair = crossed(APART, APART)
    for i in range(22):
        pair.pieces.along[i, 0] = 1 - pair.pieces.chain[i]
    assert pair.kind() == FIRST_ALONG
    turned = pair.pieces._replace(master=np.arange(22)[::-1].copy(), chain=np.repeat([1, 0], 11)[::-1].copy())
    assert plain(contact_kind)(*pair.middle, turned) == SECOND_ALONG


def test_a_piece_keeps_a_mark_for_each_yarn_that_it_lies_along():
    pair = crossed(APART, STRAIGHT)
    pair.pieces.along[5, 0] = 7
    assert pair.found() == 2 * SPREAD + 1
    assert pair.marked[5] == [7, 1]
    assert pair.found() == 0  # nothing twice


def step_of(line: float) -> tuple[float, float]:
    """Step of both parameters towards closest points 0.1 away, of yarns at 60 degrees."""
    offset = (-0.1, -0.05, APART)
    s, t = plain(closest_step)(0.5, 0.5, *offset, 1.0, 0.0, 0.0, 0.5, 0.75**0.5, 0.0, *np.zeros(8), line)
    return 0.5 - s, 0.5 - t


def test_each_kind_holds_its_parameter():
    free = step_of(POINT)
    assert all(abs(v) > 1e-3 for v in free)
    for line in (SIDE_BY_SIDE, FIRST_ALONG):
        assert step_of(line)[0] == 0.0
        assert step_of(line)[1] == pytest.approx(0.05 + 0.05 * 0.75**0.5)  # the foot of the point on the second yarn
    assert step_of(SECOND_ALONG)[1] == 0.0
    assert step_of(SECOND_ALONG)[0] == pytest.approx(-0.1)


def test_a_held_piece_is_sampled_at_its_middle():
    """0.03 along the other yarn from its middle; the point would run to the apex of the arc, half a piece on."""
    pair = crossed(4.0 * APART, STRAIGHT)
    pair.position[1, :11] += 0.03
    s, t, *offset, _ = plain(_closest)(*pair.position, 6, 16, 0.5, 0.5, FIRST_ALONG, 8)
    assert s == 0.5
    assert t == pytest.approx(0.5 + 0.03 / PIECE, abs=1e-12)
    assert offset[1] == pytest.approx(0.0, abs=1e-12)
    t_held = plain(_closest)(*pair.position, 6, 16, 0.5, 0.5, SECOND_ALONG, 8)[1]
    assert t_held == 0.5
    assert plain(_closest)(*pair.position, 6, 16, 0.5, 0.5, POINT, 8)[0] < 0.0


def contact(line: float, pieces: tuple[int, int]) -> Contacts:
    """One contact of ``pieces``."""
    offset = np.array([[0.0], [0.0], [APART]])
    return contacts_of(pieces, offset=offset, reach=np.full(1, APART + 0.01), line=np.full(1, line))


@pytest.mark.parametrize(
    ("was", "place", "heir"),
    [
        (POINT, (5, 16, 0.5, 0.5, FIRST_ALONG), True),
        (POINT, (5, 17, 0.5, -0.2, FIRST_ALONG), True),  # the place on the other yarn is free
        (POINT, (6, 16, 0.5, 0.5, FIRST_ALONG), False),  # held at another piece
        (POINT, (6, 16, -0.3, 0.5, SECOND_ALONG), True),
        (POINT, (5, 17, 0.5, 0.5, SECOND_ALONG), False),
        (FIRST_ALONG, (5, 17, 0.1, -0.4, POINT), True),
        (FIRST_ALONG, (6, 16, -0.1, 0.5, POINT), False),
        (SECOND_ALONG, (6, 16, -0.1, 0.5, POINT), True),
        (FIRST_ALONG, (5, 17, 0.5, -0.4, FIRST_ALONG), True),
        (FIRST_ALONG, (6, 16, 0.5, 0.5, FIRST_ALONG), False),
        (SIDE_BY_SIDE, (5, 16, 0.5, 0.5, FIRST_ALONG), True),
        (SIDE_BY_SIDE, (5, 17, 0.5, -0.2, FIRST_ALONG), True),
        (SIDE_BY_SIDE, (5, 17, 0.5, -0.2, POINT), False),
    ],
)
def test_depth_goes_to_the_contact_at_the_held_piece(was, place, heir):
    old, chain = contact(was, (5, 16)), np.repeat([0, 1], 11)
    lists, taken = (np.full(22, -1), np.full(1, -1)), np.zeros(1, np.bool_)
    plain(add_to_lists)(old, 0, lists)
    assert plain(predecessor)(old, lists, chain, taken, place) == (0 if heir else -1)
    assert taken[0] == heir
    assert plain(predecessor)(old, lists, chain, taken, place) == -1  # one heir


@pytest.mark.parametrize(
    ("line", "marked", "moved", "looked_for"),
    [
        (POINT, False, True, False),
        (POINT, True, False, True),
        (FIRST_ALONG, True, False, False),
        (FIRST_ALONG, True, True, True),
        (FIRST_ALONG, False, False, True),
        (SECOND_ALONG, True, False, True),
        (SIDE_BY_SIDE, False, False, False),
        (SIDE_BY_SIDE, True, False, True),
    ],
)
def test_contacts_that_are_no_longer_what_they_were_are_looked_for_anew(line, marked, moved, looked_for):
    pair = crossed(APART, STRAIGHT)
    if marked:
        pair.found()
    assert bool(plain(_needs_search)(*pair.middle, 0.5, 0.5, line, np.full(22, moved), pair.pieces)) is looked_for


def test_tracked_contacts_mark_as_found_ones_do():
    pair = crossed(APART, STRAIGHT)
    assert plain(mark_tracked)(contact(POINT, pair.middle), 1, pair.position, pair.pieces) == 2 * SPREAD + 1
    assert plain(mark_tracked)(contact(POINT, pair.middle), 0, pair.position, pair.pieces) == 0


def test_copies_of_a_held_contact_are_one_whichever_way_round():
    """Yarns side by side are not: the one way round another yarn is sampled."""
    kinds = np.array([POINT, SIDE_BY_SIDE, FIRST_ALONG, SECOND_ALONG], int)
    assert LINES[1][kinds[3]] == LINES[0][kinds[2]]
    assert LINES[1][kinds[2]] == LINES[0][kinds[3]]
    assert LINES[1][kinds[1]] != LINES[0][kinds[1]]
    assert LINES[1][kinds[0]] == LINES[0][kinds[0]]


def test_contacts_that_marks_make_another_kind_are_looked_for_where_nothing_moved():
    """One that walked onto a marked piece would be dropped, and not found."""
    pair = crossed(APART, STRAIGHT)
    pair.found()
    for line, told in ((POINT, True), (FIRST_ALONG, False), (SECOND_ALONG, True), (SIDE_BY_SIDE, True)):
        moved = np.zeros(22, np.bool_)
        plain(flag_other_kinds)(contact(line, pair.middle), 1, pair.pieces, moved)
        assert np.flatnonzero(moved).tolist() == (list(pair.middle) if told else [])


def test_a_piece_does_not_lie_along_its_own_image():
    pair = crossed(APART, STRAIGHT)
    pair.found()
    own = pair.pieces._replace(master=np.full(22, 5), chain=np.zeros(22, np.int64))
    own.along[:] = 0
    assert plain(contact_kind)(*pair.middle, own) == POINT


def test_of_two_contacts_at_a_place_the_one_that_is_free_is_taken():
    old, chain = contact(POINT, (5, 16)), np.repeat([0, 1], 11)
    both = Contacts(*(np.concatenate([row, row], axis=-1) for row in old[:18]))
    lists, taken = (np.full(22, -1), np.full(2, -1)), np.zeros(2, np.bool_)
    for c in (0, 1):
        plain(add_to_lists)(both, c, lists)
    place = (5, 16, 0.5, 0.5, FIRST_ALONG)
    assert sorted(plain(predecessor)(both, lists, chain, taken, place) for _ in range(2)) == [0, 1]
    assert plain(predecessor)(both, lists, chain, taken, place) == -1
