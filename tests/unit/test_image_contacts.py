"""Copies of one contact across the edge of a periodic cell: they go on from one state, wherever they are found."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.fabric.relaxation import relaxed_cell
from knittest.kernels import periodic
from knittest.kernels.state import CURVATURE
from knittest.models.image_contacts import masters, share_states
from knittest.models.meso import build_meso_cell
from knittest.models.periodic import _flag_near_pieces
from knittest.models.tool import constant
from knittest.pose import ALL, PeriodicBody, PeriodicChain, YarnContact, round_section

SECTION = round_section(modulus=2e3, diameter=0.5, density=1.5e-3)
STIFFNESS, DEPTH = 50.0, 0.02
CONTACT = YarnContact(normal=STIFFNESS, tangential=10.0, friction=0.3, damping=0.0)
SIDE = 3.0


def crossed(at: float) -> PeriodicBody:
    """Cell of two straight yarns, the upper at x = ``at`` and sunk into the other."""
    s = 0.5 * np.arange(6)[:, None]
    low = PeriodicChain(s * [1.0, 0.0, 0.0], SECTION, 0, along=0)
    up = PeriodicChain([at, -0.6, 0.5 - DEPTH] + s * [0.0, 1.0, 0.0], SECTION, 1, along=1)
    lattice = [(SIDE, 0.0, 0.0), (0.0, SIDE, 0.0)]
    return PeriodicBody.of_cell([low, up], lattice, CONTACT, ("a", "b"), threads=1)


def test_a_contact_that_slides_over_the_edge_presses_alike_in_all_its_copies() -> None:
    """A yarn slid along another, both held: k d everywhere, and the same spring, however late a copy is found."""
    body = crossed(1.6)
    cell, tracker = body.cell, body.cell.tracker
    own = np.flatnonzero(cell.owned)
    upper = cell.nodes.position[2, own] > 0.2
    for dof in ALL:
        body.boundary.move(own[~upper], dof)
        body.boundary.move(own[upper], dof, constant(5.0) if dof == ALL[0] else None)
    body.step(1)
    tracker.contacts.reach[: tracker.count] = 0.5
    seen = tracker.count
    body.advance(0.15)
    count = tracker.count
    assert count > seen == 1
    force, spring = tracker.contacts.force[:, :count], tracker.contacts.spring[:, :count]
    assert force[2] == pytest.approx(np.full(count, -STIFFNESS * DEPTH), rel=1e-9)
    assert np.abs(spring[0]) == pytest.approx(np.full(count, 0.3 * STIFFNESS * DEPTH / 10.0), rel=1e-9)


@pytest.mark.parametrize("curvature", [0.0, 0.3], ids=["flat", "bent"])
def test_copies_take_over_the_state_of_the_loaded_one_turned_with_their_image(curvature: float) -> None:
    """Two copies of a crossing, one of them new; where the fabric is bent, its vectors turn by the arc between them."""
    cell = crossed(2.7).cell
    cell.prepare()
    cell.bend_along(np.array([1.0, 0.0, 0.0]))
    cell.images.lattice[CURVATURE] = curvature
    periodic.move_images(1e-4, cell.nodes, cell.images)
    contacts, count = cell.tracker.contacts, cell.tracker.count
    turn = curvature * SIDE * cell.images.times[cell.images.of[contacts.piece[0, :count]], 0]
    loaded = int(np.argmax(turn))
    assert count == 2
    contacts.force[:, loaded], contacts.spring[:, loaded] = (0.1, 0.2, -1.0), (0.01, 0.02, 0.0)
    contacts.reach[loaded], contacts.twist[loaded], contacts.slipping[loaded] = 0.49, 0.3, 1.0
    share_states(contacts, count, cell.images, masters(cell.images))
    other = 1 - loaded
    angle = turn[other] - turn[loaded]
    assert abs(angle) == pytest.approx(curvature * SIDE)
    c, s = np.cos(angle), np.sin(angle)
    about = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])  # along to normal, as images turn
    for name in ("force", "spring", "offset"):
        rows = getattr(contacts, name)
        assert rows[:, other] == pytest.approx(about @ rows[:, loaded], abs=1e-12)
    for name in ("reach", "twist", "slipping"):
        assert getattr(contacts, name)[other] == getattr(contacts, name)[loaded]


def test_a_yarn_that_meets_its_own_image_is_the_other_way_round_in_one_of_both_copies() -> None:
    """Forces and offsets change sign, parameters and arms their places."""
    cell = crossed(1.6).cell
    images, contacts = cell.images, cell.tracker.contacts
    image = {(m, *images.times[images.of[g]]): g for g, m in zip(images.ghost, images.master, strict=True)}
    early, late = np.flatnonzero(cell.owned)[[1, 3]]
    contacts.piece[:, 0] = early, image[late, -1.0, 0.0]
    contacts.piece[:, 1] = late, image[early, 1.0, 0.0]
    contacts.parameter[:, 0], contacts.parameter[:, 1] = (0.2, 0.3), (0.3, 0.2)
    contacts.force[:, 0], contacts.couple[0], contacts.arm[0] = (0.1, 0.2, 0.3), 0.5, 0.4
    contacts.offset[:, 0] = 0.0, 0.0, 0.5
    share_states(contacts, 2, images, masters(images))
    assert contacts.force[:, 1] == pytest.approx([-0.1, -0.2, -0.3])
    assert contacts.offset[:, 1] == pytest.approx([0.0, 0.0, -0.5])
    assert contacts.parameter[:, 1] == pytest.approx([0.3, 0.2])
    assert (contacts.arm[1], contacts.couple[1]) == (pytest.approx(0.6), 0.5)


@pytest.mark.parametrize(("off", "looked_at"), [(0, [3, 4, 5, 6]), (3, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9])])
def test_ellipses_are_looked_for_where_centre_lines_are_nearest_beyond_the_cell(off: int, looked_at: list[int]) -> None:
    """Placed on a piece that touches the cell; looked for on such alone, a copy pressed one of both yarns there."""
    own = np.zeros(12, np.bool_)
    own[4:6] = True
    assert np.flatnonzero(_flag_near_pieces(own, off)).tolist() == looked_at


def test_cells_of_ellipses_look_further_than_those_of_circles() -> None:
    counts = {}
    for packing in (None, 0.9):
        sets = ["fabric.reinforcing.section.shape=ellipse", "fabric.reinforcing.section.fibre_density=1.53"]
        sets += [f"fabric.reinforcing.section.{field}.{direction}={value}" for direction in ("warp", "weft")
                 for field, value in (("packing", 0.9), ("width_to_height", 1.3))]  # fmt: skip
        run = resolve(test="cell", variant="2", scale="meso", preset="quick", sets=sets if packing else [])
        group = build_meso_cell(run, relaxed_cell(run.fabric), 1, 1).group
        counts[packing] = int(group.near.sum()) - int(group.owned.sum())
    assert counts[0.9] > counts[None] > 0


def test_of_copies_found_anew_the_one_that_inherited_its_depth_goes_before() -> None:
    """None looks back on a force; the first one in the list may have found no predecessor."""
    cell = crossed(2.7).cell
    cell.prepare()
    contacts, count = cell.tracker.contacts, cell.tracker.count
    assert count > 1
    contacts.force[:] = 0.0
    gap = np.linalg.norm(contacts.offset[:, :count], axis=0)
    contacts.reach[:count] = gap
    contacts.reach[count - 1] = gap[-1] + 0.01
    share_states(contacts, count, cell.images, masters(cell.images))
    assert contacts.reach[:count] - gap == pytest.approx(np.full(count, 0.01))


def test_a_copy_on_the_piece_before_is_one_of_the_same_crossing_and_keeps_the_overlap_of_the_start() -> None:
    """One copy, open, with an accepted overlap, ends its piece; another was found now where the next one begins."""
    cell = crossed(2.7).cell
    cell.prepare()
    contacts, count = cell.tracker.contacts, cell.tracker.count
    assert count > 1
    contacts.force[:], gap = 0.0, np.linalg.norm(contacts.offset[:, :count], axis=0)
    contacts.parameter[0, :count] = 0.999
    contacts.reach[:count], contacts.accepted[:count] = gap - 0.001, 0.02
    contacts.piece[0, 1] += 1
    contacts.parameter[0, 1], contacts.reach[1], contacts.accepted[1] = -0.001, gap[1], 0.0
    share_states(contacts, count, cell.images, masters(cell.images))
    assert contacts.accepted[:count] == pytest.approx(np.full(count, 0.02))
    assert contacts.reach[:count] == pytest.approx(gap - 0.001)
    assert contacts.parameter[0, :2] == pytest.approx([0.999, -0.001])
