"""Second places of the search of pairs, beside the closest points from the middles of pieces. Plain Python."""

import numpy as np
import pytest
from contact_cases import contacts_of
from plain import plain

from knittest.kernels.contact import FIRST_ALONG, FIRST_END, LAST_END, POINT, SECOND_ALONG, SIDE_BY_SIDE, closest_step
from knittest.kernels.line_contact import MOST, Pieces, add_to_lists, find_tracked
from knittest.kernels.pair_search import (
    BESIDE_HELD,
    _first_place,
    _held_place,
    _limits_beside_held,
    _second_point,
    reach_of,
)
from knittest.kernels.search import _share_depth


@pytest.mark.parametrize("line", [POINT, SIDE_BY_SIDE, FIRST_ALONG, SECOND_ALONG])
def test_no_step_leads_away_from_the_closest_points(line: float) -> None:
    """Half the squared distance falls along every step: its gradient (w.u, -w.v) times the step is not above 0.

    An indefinite second derivative would lead uphill in a third of these cases, and through each other in a cell.
    """
    rng, moved = np.random.default_rng(7), 0
    for _ in range(300):
        w, u, v, a, b = rng.normal(size=(5, 3))
        s, t = rng.uniform(0.0, 1.0, 2)
        end_s, end_t = plain(closest_step)(s, t, *w, *u, *v, *a, *b, 0.0, 0.0, line)
        slope = (w @ u) * (end_s - s) - (w @ v) * (end_t - t)
        assert slope <= 1e-12
        moved += slope < -1e-9
    assert moved > 200


def curves(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, Pieces, np.ndarray]:
    """Positions (3, n), pieces and living elements of two yarns of the control points ``first`` and ``second``."""
    n, m = len(first), len(second)
    alive, one = np.ones(n + m), np.ones(n + m)
    alive[[n - 1, n + m - 1]] = 0.0
    pieces = Pieces(
        0.1 * one, 0.5 * one, np.ones(n + m, np.int64), np.repeat([0, 1], [n, m]), np.zeros(n + m, np.int64),
        np.arange(n + m), np.full((n + m, MOST), -1),
    )  # fmt: skip
    return np.vstack([first, second]).T, pieces, alive


def test_a_piece_at_an_end_reaches_to_its_last_node_unless_the_yarn_goes_on() -> None:
    line = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])
    _, pieces, alive = curves(line, line)
    limits = [plain(reach_of)(i, alive, pieces) for i in (1, 2, 3)]
    assert limits[0][0] == FIRST_END and limits[0][1] < 1.1
    assert limits[1][0] > -0.1 and limits[1][1] < 1.1
    assert limits[2][1] == LAST_END and limits[2][0] > -0.1
    assert plain(reach_of)(1, alive, pieces._replace(ends=False))[0] > -0.1


def test_the_tip_of_a_yarn_is_looked_at_beside_the_middle_of_its_last_piece() -> None:
    """A yarn that arches between two others' places: near at parameter 0.3, and at its tip half an element beyond."""
    first = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    second = np.array([[0.4, 0.6, 0.3], [0.5, 0.0, 0.45], [2.2, -0.1, 0.4], [2.4, 0.9, 0.3]])
    position, _, _ = curves(first, second)
    found = plain(_first_place)(*position, 1, 4, POINT, True)
    other = plain(_second_point)(*position, 1, 4, (LAST_END, 0.5), found[:2])
    again = plain(_second_point)(*position, 1, 4, (0.5, 0.5), found[:2])
    assert np.isnan(again[0])  # from the middle it is the same place
    assert found[0] == pytest.approx(0.21, abs=0.01) and other[0] == LAST_END


def wrapped(turn_deg: float, kink: float = 0.0) -> np.ndarray:
    """Positions (3, 10) of a yarn round the axis z at 1 mm, ``turn_deg`` a piece, whose element between the second and
    third node is nearer by ``kink`` [mm], and of a yarn along the axis.
    """
    angle = np.deg2rad(turn_deg) * (np.arange(5) - 1.5)
    radius = 1.0 / np.cos(0.5 * np.deg2rad(turn_deg))
    points = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(5)])
    points[1:3, 0] -= kink
    axis = np.column_stack([np.zeros(5), np.zeros(5), 0.5 * np.arange(-2.0, 3.0)])
    return np.vstack([points, axis]).T


@pytest.mark.parametrize(("turn", "kink", "found"), [(15.0, 0.0, False), (85.0, 0.0, False), (85.0, 0.4, True)])
def test_a_yarn_along_another_is_held_between_middles_only_where_it_is_nearer_there(turn, kink, found) -> None:
    """The spline of a regular wrap is nearer between middles by 4.7 % at 85 degrees a piece, which needs no contact."""
    position = wrapped(turn, kink)
    s, t, *_ = plain(_held_place)(*position, 2, 7, FIRST_ALONG, 2, (0.5, 0.5), 0.5, False)
    assert np.isfinite(s) == found
    assert np.isfinite(t)
    other_way = np.hstack([position[:, 5:], position[:, :5]])
    s, t, *_ = plain(_held_place)(*other_way, 2, 7, SECOND_ALONG, 2, (0.5, 0.5), 0.5, False)
    assert np.isfinite(t) and np.isfinite(s) == found


@pytest.mark.parametrize(
    ("tip", "coarse", "places"),
    [
        (0.5, False, []),
        (0.5, True, [0.0]),
        (FIRST_END, False, [FIRST_END]),
        (FIRST_END, True, [FIRST_END, 0.0]),
        (LAST_END, False, [LAST_END]),
        (LAST_END, True, [LAST_END, 0.0, 1.0]),
    ],
)
def test_a_piece_along_another_is_held_where_its_yarn_ends_and_half_an_element_apart_if_it_is_coarse(
    tip: float, coarse: bool, places: list[float]
) -> None:
    position = wrapped(30.0)
    found = [plain(_held_place)(*position, 2, 7, FIRST_ALONG, k, (tip, 0.5), 0.5, coarse)[0] for k in (1, 2, 3)]
    assert [s for s in found if np.isfinite(s)] == places


def test_a_point_beside_a_piece_that_is_held_is_looked_for_up_to_what_its_middle_reaches() -> None:
    """Piece 2 of the first yarn lies along the second: a point of piece 3 may lie on it, one of piece 1 too."""
    line = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])
    _, pieces, alive = curves(line, line)
    pieces.along[2, 0] = 1
    limits = [plain(reach_of)(i, alive, pieces) for i in (1, 2, 3)]
    assert plain(_limits_beside_held)(limits[2], 3, 7, True, pieces) == (-BESIDE_HELD, limits[2][1])
    assert plain(_limits_beside_held)(limits[0], 1, 7, True, pieces) == (limits[0][0], 1.0 + BESIDE_HELD)
    assert plain(_limits_beside_held)(limits[1], 2, 7, True, pieces) == limits[1]
    assert plain(_limits_beside_held)(limits[1], 7, 3, False, pieces) == limits[1]


def test_a_crossing_that_comes_up_beside_a_loaded_one_takes_over_half_of_its_energy() -> None:
    """Depths 0.05 and 0 become 0.05 / sqrt 2 each, the second no deeper than its overlap: the sum of squares stays."""
    for overlap in (0.06, 0.01, 0.0, -0.02):
        contacts = contacts_of(
            (2, 7), (2, 7), offset=np.array([[0.0, 0.0], [0.0, 0.0], [0.45, 0.5 - overlap]]),
            reach=np.array([0.5, min(0.5, 0.5 - overlap)]),
        )  # fmt: skip
        plain(_share_depth)(0, 1, 0.5, contacts)
        depth = contacts.reach - contacts.offset[2]
        taken = np.clip(overlap, 0.0, 0.05 / np.sqrt(2.0))
        assert np.maximum(depth, 0.0) == pytest.approx([np.sqrt(0.05**2 - taken**2), taken])
        assert (contacts.reach <= 0.5).all()


def test_a_held_contact_is_the_tracked_one_only_at_its_own_place() -> None:
    """One held at the middle of a piece, another where the piece begins: 0.5 elements apart along the held yarn."""
    lists, chain = (np.full(10, -1), np.full(1, -1)), np.repeat([0, 1], 5)
    for line, held in ((FIRST_ALONG, 0), (SECOND_ALONG, 1), (POINT, 0)):
        contacts = contacts_of((2, 7), reach=np.ones(1), arm=np.ones(1), line=np.full(1, line))
        lists[0][:] = -1
        plain(add_to_lists)(contacts, 0, lists)
        place = [2, 7, 0.5, 0.5, line]
        assert plain(find_tracked)(contacts, lists, chain, tuple(place), 0.9) == 0
        place[2 + held] = 0.0
        assert plain(find_tracked)(contacts, lists, chain, tuple(place), 0.9) == (0 if line == POINT else -1)
