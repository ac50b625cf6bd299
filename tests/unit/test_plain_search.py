"""Pieces of yarns that touch at a point or along a line, and what such contacts inherit. Plain Python."""

import numpy as np
import pytest
from plain import plain
from scipy.spatial.transform import Rotation

from knittest.kernels.along import mark_along, mark_found
from knittest.kernels.contact import BESIDE, FIRST_ALONG, POINT, SECOND_ALONG
from knittest.kernels.pair_search import WRAPPED, crossing
from knittest.kernels.periodic_state import Images
from knittest.kernels.search import _add_contact, _before, _line_of, find_contacts, keep_contacts
from knittest.kernels.state import Contacts
from knittest.models.image_contacts import _crossings

SIZE = 0.4


def arc(curvature: float, height: float, shift: float = 0.0, angle_deg: float = 0.0) -> np.ndarray:
    """Control points (3, 3) of a piece along x that bends up with ``curvature`` [1/mm] at ``height`` [mm].

    ``shift`` along it [mm]; turned about the vertical axis by ``angle_deg``.
    """
    x = SIZE * np.array([-1.0, 0.0, 1.0]) + shift
    angle = np.deg2rad(angle_deg)
    sag = 0.5 * curvature * (x**2 - 0.25 * SIZE**2)  # the spline's height at x is c x^2 / 2
    return np.column_stack([x * np.cos(angle), x * np.sin(angle), height + sag])


def found(upper: np.ndarray, lower: np.ndarray) -> tuple[float, float, np.ndarray, bool]:
    s, t, *offset, line = plain(crossing)(*np.vstack([upper, lower]).T, 1, 4, 0, WRAPPED)
    return s, t, np.array(offset), line == BESIDE


def kind(upper: np.ndarray, lower: np.ndarray, along: int = 0) -> float:
    return plain(crossing)(*np.vstack([upper, lower]).T, 1, 4, along, WRAPPED)[-1]


@pytest.mark.parametrize(("angle", "line"), [(0.0, True), (13.5, True), (14.5, False), (90.0, False)])
def test_straight_pieces_are_lines_up_to_14_degrees(angle, line):
    assert found(arc(0.0, 0.7, angle_deg=angle), arc(0.0, 0.0))[3] is line


@pytest.mark.parametrize(("curvature", "line"), [(0.0, True), (0.07, True), (0.1, False), (1.0, False)])
def test_parallel_pieces_that_bend_apart_touch_at_a_point(curvature, line):
    """At a distance g, bent by c, the Hessian's determinant is (1 + g c) - 1 of the straight one's: 0.06 at c 0.086."""
    assert found(arc(curvature, 0.7), arc(0.0, 0.0))[3] is line
    assert found(arc(0.0, 0.7), arc(-curvature, 0.0))[3] is line


def test_the_point_is_where_arcs_are_nearest_not_the_middle_of_a_piece():
    """Two arcs back to back whose middles lie 0.15 mm from the place where they touch."""
    s, t, offset, line = found(arc(0.8, 0.7, shift=0.15), arc(-0.8, 0.0, shift=0.15))
    assert not line
    assert [s, t] == pytest.approx([0.5 - 0.15 / SIZE] * 2, abs=1e-6)
    assert offset == pytest.approx([0.0, 0.0, 0.7], abs=1e-9)


def test_arcs_about_one_axis_are_a_line():
    """Their distance is the same all along: the inner one bends away from the outer as the outer follows."""
    outer, inner = arc(-1.0 / 2.7, 0.7), arc(-1.0 / 2.0, 0.0)
    assert found(outer, inner)[3]
    assert found(arc(-1.0 / 0.3, 0.7), arc(1.0 / 0.3, 0.0))[3]  # both beyond the other's centre of curvature


def test_yarns_that_bend_towards_each_other_cross_by_their_angle_alone():
    """At 20 degrees: what bends them together makes no line of a crossing."""
    assert not found(arc(-0.2, 0.7, angle_deg=20.0), arc(0.2, 0.0))[3]


@pytest.mark.parametrize("seed", range(4))
def test_how_a_pair_lies_in_space_does_not_decide(seed):
    """A pair that touches at a point by its bends alone, turned at random: place, distance and kind stay."""
    turn, upper, lower = Rotation.random(random_state=seed), arc(0.5, 0.7, shift=0.1), arc(-0.5, 0.0, shift=0.1)
    s, t, offset, line = found(upper, lower)
    turned = found(turn.apply(upper), turn.apply(lower))
    assert turned[:2] == pytest.approx((s, t), abs=1e-9)
    assert turned[2] == pytest.approx(turn.apply(offset), abs=1e-9)
    assert not turned[3]
    assert not line
    assert found(turn.apply(arc(0.0, 0.7)), turn.apply(arc(0.0, 0.0)))[3]
    one_sided = found(turn.apply(arc(0.0, 0.7)), turn.apply(arc(-0.15, 0.0)))
    assert not one_sided[3]


@pytest.mark.parametrize(("share", "wraps"), [(0.9, False), (0.99, False), (1.01, True), (3.0, True)])
@pytest.mark.parametrize("angle", [90.0, 60.0, 45.0])
def test_a_yarn_lies_along_another_that_it_bends_around_by_their_distance(share, wraps, angle):
    """A helix at ``angle`` to the axis of the other, a distance g away, has the curvature sin^2(angle) / g."""
    bent = -share * np.sin(np.deg2rad(angle)) ** 2 / 0.7
    assert kind(arc(bent, 0.7, angle_deg=angle), arc(0.0, 0.0)) == (FIRST_ALONG if wraps else POINT)
    assert kind(arc(0.0, 0.7, angle_deg=angle), arc(-bent, 0.0)) == (SECOND_ALONG if wraps else POINT)


def test_a_yarn_that_lies_along_another_goes_on_to_until_it_is_nearly_straight():
    """By 0.2 of the radius of their distance it still does, by 0.1 it does not."""
    for share, goes_on in ((0.2, True), (0.1, False)):
        assert kind(arc(-share / 0.7, 0.7, angle_deg=90.0), arc(0.0, 0.0), 1) == (FIRST_ALONG if goes_on else POINT)
        assert kind(arc(0.0, 0.7, angle_deg=90.0), arc(share / 0.7, 0.0), -1) == (SECOND_ALONG if goes_on else POINT)
    assert kind(arc(-0.5, 0.7, angle_deg=90.0), arc(0.0, 0.0), -1) == POINT  # that the other does is no matter


@pytest.mark.parametrize(("held", "line"), [(0, FIRST_ALONG), (1, SECOND_ALONG)])
def test_a_held_place_is_the_middle_of_the_piece_that_bends(held, line):
    """Its partner's is the nearest to that: 0.1 mm along the straight yarn."""
    bent, straight = arc(-2.0, 0.7, angle_deg=90.0), arc(0.0, 0.0, shift=0.1)
    pieces = (bent, straight) if held == 0 else (straight, bent)
    *place, _, _, _, kind_found = plain(crossing)(*np.vstack(pieces).T, 1, 4, 0, WRAPPED)
    assert kind_found == line
    assert place[held] == 0.5
    assert place[1 - held] == pytest.approx(0.5 - 0.1 / SIZE, abs=1e-6)


def test_what_lies_along_a_yarn_spreads_to_the_pieces_beside_it_on_the_same_yarn():
    chain, along = np.array([0, 0, 0, 0, 0, 1, 1, 1]), np.zeros(8, np.int64)
    for line, marked in ((FIRST_ALONG, [1, 1, 1, 1, -1, -1, -1, -1]), (SECOND_ALONG, [-1] * 5 + [0, 0, 0])):
        one = contacts(line, 0.7, 0.7)
        one.piece[:, 0] = 1, 6
        plain(mark_along)(one, 1, chain, along)
        assert along.tolist() == marked
    plain(mark_along)(contacts(BESIDE, 0.7, 0.7), 1, chain, along)
    assert (along == -1).all()


def test_pieces_found_to_lie_along_a_yarn_are_known_by_its_chain():
    chain = np.array([0, 0, 0, 1, 1, 1])
    pairs, places = np.array([[[1, 4], [-1, 4]], [[2, 3], [0, 5]]]), np.zeros((2, 2, 6))
    places[:, :, 5] = [[FIRST_ALONG, FIRST_ALONG], [SECOND_ALONG, BESIDE]]
    along = np.zeros(6, np.int64)
    plain(mark_found)(pairs, places, np.array([2, 2]), chain, along)
    assert along.tolist() == [-1, 1, -1, 0, -1, -1]  # a pair marked as far apart does not count, nor yarns side by side


def test_a_copy_the_other_way_round_is_the_same_contact_if_the_same_yarn_lies_along():
    """Two contacts of pieces 1 and 4 of a cell of one image, each seen from the other yarn."""
    master, still = np.arange(6), np.zeros((1, 2))
    images = Images(*[np.zeros(0)] * len(Images._fields))._replace(of=np.zeros(6, np.int64), times=still)
    pair = [contacts(line, 0.7, 0.7) for line in (FIRST_ALONG, SECOND_ALONG)]
    pair[1].piece[:, 0] = 4, 1
    (_, _, key), (swapped, _, same) = (_crossings(c, 1, images, master) for c in pair)
    assert swapped.all()
    assert (key == same).all()
    pair[1].line[0] = FIRST_ALONG
    assert (key != _crossings(pair[1], 1, images, master)[2]).any()


def test_a_crossing_goes_to_the_piece_that_it_was_on_and_to_no_other():
    """Handed over twice its depth would be energy; where the other yarn bends too, the first has it."""
    crossed, chain = contacts(POINT, 0.73, 0.70), np.array([0, 0, 0, 1, 1, 1])
    crossed.parameter[:, 0] = 0.9, 0.2
    head, following = np.full(6, -1), np.full(1, -1)
    head[1] = 0

    def heir(i: int, j: int, line: float, along: tuple[int, ...] = (-1,) * 6) -> bool:
        lying = np.array(along), chain
        return plain(_before)(crossed, head, following, chain, lying, i, j, 0.5, 0.5, line) == 0

    assert [heir(i, 4, FIRST_ALONG) for i in (0, 1, 2)] == [False, True, False]
    assert [heir(1, j, SECOND_ALONG) for j in (3, 4, 5)] == [False, True, False]
    assert heir(1, 5, FIRST_ALONG) and heir(2, 4, SECOND_ALONG)  # the place on the other yarn may differ
    assert not heir(1, 4, SECOND_ALONG, (-1, 1, -1, -1, 0, -1))
    assert not heir(1, 4, BESIDE)


@pytest.mark.parametrize("kind_before", [BESIDE, FIRST_ALONG, SECOND_ALONG])
@pytest.mark.parametrize("kind_now", [POINT, FIRST_ALONG, SECOND_ALONG])
def test_a_line_contact_that_changes_its_kind_keeps_its_depth(kind_before, kind_now):
    line, chain = contacts(kind_before, 0.73, 0.70), np.array([0, 0, 0, 1, 1, 1])
    head, following = np.full(6, -1), np.full(1, -1)
    head[1] = 0
    lying = np.full(6, -1), chain
    assert plain(_before)(line, head, following, chain, lying, 1, 4, 0.5, 0.5, kind_now) == 0
    elsewhere = plain(_before)(line, head, following, chain, lying, 1, 5, 0.3, 0.6, kind_now)
    assert elsewhere == (0 if (kind_before, kind_now) == (FIRST_ALONG, POINT) else -1)


def both(places: list[tuple[int, int, float, float, float]], old: Contacts) -> Contacts:
    """Contacts of two yarns of 10 pieces after a search that found ``places`` (i, j, s, t, line) and lost ``old``."""
    chain, nodes = np.repeat([0, 1], 10), 20
    pairs, found = np.array([[[i, j] for i, j, *_ in places]]), np.array([len(places)])
    rows = np.array([[[s, t, 0.0, 0.0, 0.70, line] for _, _, s, t, line in places]])
    along, new = np.full(nodes, -1), contacts(POINT, 0.0, 0.0)
    plain(mark_found)(pairs, rows, found, chain, along)
    new = Contacts(**{name: np.repeat(array, 4, axis=-1) for name, array in new._asdict().items()})  # room for four
    count = plain(find_contacts)(
        pairs,
        rows,
        found,
        np.full(nodes, 0.375),
        np.zeros(nodes, int),
        np.zeros((2, 1, 1)),
        chain,
        np.ones(nodes),
        np.ones(nodes, bool),
        (along, chain),
        0.1,
        old,
        1,
        new,
    )
    assert count == len(places)
    return new


def test_a_contact_has_one_heir_however_many_places_are_found():
    """Two nearest places of one piece, or a line of the same pieces beside a crossing: one keeps the depth."""
    for kind_before, places in (
        (POINT, [(3, 12, 0.5, 0.5, FIRST_ALONG), (3, 15, 0.5, 0.5, FIRST_ALONG)]),
        (FIRST_ALONG, [(3, 12, 0.5, 0.5, SECOND_ALONG), (3, 14, 0.5, 0.4, POINT)]),
    ):
        old = contacts(kind_before, 0.73, 0.70)
        old.piece[:, 0] = 3, 12
        new = both(places, old)
        assert sorted(new.reach[:2]) == pytest.approx([0.70, 0.73])


@pytest.mark.parametrize(("along", "kept"), [((-1,) * 6, 1), ((-1, 1) + (-1,) * 4, 0), ((1, -1, 1) + (-1,) * 3, 1)])
def test_a_crossing_ends_where_its_own_piece_lies_along_the_other_yarn(along, kept):
    """Beside such a piece it goes on: it would have no heir there, and its depth would be lost."""
    chain, new = np.array([0, 0, 0, 1, 1, 1]), contacts(POINT, 0.0, 0.0)
    arguments = np.full(6, 0.375), chain, np.ones(6), np.ones(6, bool), (np.array(along), chain), 0.1
    lists, taken = (np.full(6, -1), np.full(1, -1)), np.zeros(1, bool)
    assert plain(keep_contacts)(contacts(POINT, 0.73, 0.70), 1, *arguments, new, *lists, taken) == kept
    assert taken.sum() == kept


def contacts(line: float, reach: float, gap: float) -> Contacts:
    """One contact of pieces 1 and 4 that slips under 2 N."""
    return Contacts(
        piece=np.array([[1], [4]]), parameter=np.full((2, 1), 0.5), spring=np.array([[0.01], [0.02], [0.0]]),
        offset=np.array([[0.0], [0.0], [gap]]), slipping=np.ones(1), reach=np.full(1, reach), arm=np.full(1, 0.5),
        line=np.full(1, line), force=np.full((3, 1), 2.0), twist=np.zeros(1), couple=np.zeros(1),
        lever=np.zeros((2, 1)), half=np.array([0, 1]), half_start=np.array([0, 2]), share=np.ones(1),
    )  # fmt: skip


def test_a_line_that_becomes_a_crossing_keeps_depth_and_spring_at_its_new_place():
    """0.03 mm deep where it was sampled, 0.02 mm nearer where it touches now: no depth is given."""
    old, new = contacts(1.0, 0.73, 0.70), contacts(0.0, 9.0, 9.0)
    on = plain(_add_contact)(1, 4, 0.1, 0.2, 0.0, 0.0, 0.68, 0.0, 0.75, 0.5, 0.0, 0.0, old, 0, new, 0)
    assert not on
    assert new.reach[0] == pytest.approx(0.71)
    assert new.offset[2, 0] == 0.68
    assert new.parameter[:, 0] == pytest.approx([0.1, 0.2])
    assert new.spring[:, 0] == pytest.approx([0.01, 0.02, 0.0])
    assert not new.force.any()  # it looks back on no step
    deeper = plain(_add_contact)(1, 4, 0.1, 0.2, 0.0, 0.0, 0.74, 0.0, 0.75, 0.5, 0.0, 0.0, old, 0, new, 0)
    assert not deeper
    assert new.reach[0] == 0.75  # never beyond the radii


def test_a_line_that_did_not_touch_gives_the_crossing_no_gap():
    """Its gap beyond the reach is none of the crossing, which starts free of force where it is found."""
    old, new = contacts(1.0, 0.70, 0.73), contacts(0.0, 9.0, 9.0)
    plain(_add_contact)(1, 4, 0.1, 0.2, 0.0, 0.0, 0.68, 0.0, 0.75, 0.5, 0.0, 0.0, old, 0, new, 0)
    assert new.reach[0] == 0.68


def test_a_crossing_found_again_goes_on_where_it_was():
    old, new = contacts(0.0, 0.73, 0.70), contacts(0.0, 9.0, 9.0)
    assert plain(_add_contact)(1, 4, 0.1, 0.2, 0.0, 0.0, 0.68, 0.0, 0.75, 0.5, 0.0, 0.0, old, 0, new, 0)
    assert new.reach[0] == 0.73
    assert new.offset[2, 0] == 0.70
    assert new.force.all()


def test_a_line_has_one_heir_that_of_its_own_pieces():
    """A line that goes on beside a new crossing keeps its depth to itself: handed over twice it would be energy."""
    kept = contacts(1.0, 0.73, 0.70)
    head, following = np.full(8, -1), np.full(1, -1)
    head[1] = 0
    assert plain(_line_of)(kept, head, following, 1, 4) == 0
    assert plain(_line_of)(kept, head, following, 1, 5) == -1
    assert plain(_line_of)(kept, head, following, 2, 4) == -1
    kept.line[0] = 0.0
    assert plain(_line_of)(kept, head, following, 1, 4) == -1
