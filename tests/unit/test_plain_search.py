"""Pieces of yarns that touch at a point or along a line, and what such contacts inherit. Plain Python."""

import numpy as np
import pytest
from contact_cases import contacts_of
from plain import plain
from scipy.spatial.transform import Rotation

from knittest.kernels.contact import POINT, SIDE_BY_SIDE
from knittest.kernels.line_contact import predecessor
from knittest.kernels.pair_search import crossing
from knittest.kernels.search import _add_contact
from knittest.kernels.state import Contacts

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
    s, t, *offset, line = plain(crossing)(*np.vstack([upper, lower]).T, 1, 4)
    return s, t, np.array(offset), line == 1.0


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


def contacts(line: float, reach: float, gap: float) -> Contacts:
    """One contact of pieces 1 and 4 that slips under 2 N."""
    return contacts_of(
        (1, 4), spring=np.array([[0.01], [0.02], [0.0]]), offset=np.array([[0.0], [0.0], [gap]]), slipping=np.ones(1),
        reach=np.full(1, reach), line=np.full(1, line), force=np.full((3, 1), 2.0),
    )  # fmt: skip


def add(old: Contacts, new: Contacts, piece: int = 1, gap: float = 0.68) -> bool:
    """Find a contact at a ``gap``, radii 0.75; whether it goes on from the old one at its place."""
    return plain(_add_contact)(piece, 4, 0.1, 0.2, 0.0, 0.0, gap, 0.0, 0.75, 0.5, 0.0, 0.0, old, 0, new, 0)


def test_a_line_that_becomes_a_crossing_keeps_depth_and_spring_at_its_new_place():
    """0.03 mm deep where it was sampled, 0.02 mm nearer where it touches now: no depth is given."""
    old, new = contacts(1.0, 0.73, 0.70), contacts(0.0, 9.0, 9.0)
    assert not add(old, new)
    assert new.reach[0] == pytest.approx(0.71)
    assert new.offset[2, 0] == 0.68
    assert new.parameter[:, 0] == pytest.approx([0.1, 0.2])
    assert new.spring[:, 0] == pytest.approx([0.01, 0.02, 0.0])
    assert not new.force.any()  # it looks back on no step
    assert not add(old, new, gap=0.74)
    assert new.reach[0] == 0.75  # never beyond the radii


def test_a_line_that_did_not_touch_gives_the_crossing_no_gap():
    """Its gap beyond the reach is none of the crossing, which starts free of force where it is found."""
    old, new = contacts(1.0, 0.70, 0.73), contacts(0.0, 9.0, 9.0)
    add(old, new)
    assert new.reach[0] == 0.68


def test_a_crossing_found_again_goes_on_where_it_was():
    old, new = contacts(0.0, 0.73, 0.70), contacts(0.0, 9.0, 9.0)
    assert add(old, new)
    assert new.reach[0] == 0.73
    assert new.offset[2, 0] == 0.70
    assert new.force.all()


def test_a_crossing_found_elsewhere_keeps_its_depth_not_its_reach():
    """0.03 mm deep at one place, 0.02 mm nearer at the one found: at the old reach it would be 0.05 mm deep."""
    old, new = contacts(0.0, 0.73, 0.70), contacts(0.0, 9.0, 9.0)
    assert not add(old, new, piece=2)
    assert new.reach[0] == pytest.approx(0.71)


def test_a_line_has_one_heir_that_of_its_own_pieces():
    """A line that goes on beside a new crossing keeps its depth to itself: handed over twice it would be energy."""
    kept = contacts(1.0, 0.73, 0.70)
    lists, chain, taken = (np.full(8, -1), np.full(1, -1)), np.array([0, 0, 0, 1, 1, 1, 1, 1]), np.zeros(1, np.bool_)
    lists[0][1] = 0

    def found(i: int, j: int, line: float = POINT) -> int:
        return int(plain(predecessor)(kept, lists, chain, taken, (i, j, 0.5, 0.5, line)))

    assert found(1, 5) == -1
    assert found(2, 4) == -1
    assert found(1, 4) == 0
    assert taken.all()
    assert found(1, 4) == -1
    taken[:], kept.line[0] = False, POINT
    assert found(1, 4, SIDE_BY_SIDE) == 0
    assert found(1, 4) == -1
