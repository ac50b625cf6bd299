"""Contacts of elliptic sections in the explicit kernels, in plain Python: gradient, balance, rolling, rigid turns."""

from types import SimpleNamespace

import numpy as np
import pytest
from contact_cases import contacts_of, derivative, nodes_at
from plain import plain
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import minimize

from knittest.base.errors import InputError
from knittest.kernels.contact import SCRATCH, penalty
from knittest.kernels.contact_blocks import contact_forces, scatter_contacts
from knittest.kernels.line_contact import MOST, Pieces, mark_found
from knittest.kernels.section_blocks import COLUMNS, mark_ellipses, place_ellipses, turn_sections
from knittest.kernels.state import ContactLaw
from knittest.models.natural_state import check_conformity, conformity

DT = 1e-4
SMOOTH = ContactLaw(200.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.2, 0.1, 0.3)
STICKY = ContactLaw(200.0, 150.0, 9.0, 9.0, 0.0)
#: half width and half height [mm] of yarn A, on nodes 0 to 2, and B, on nodes 3 to 5
HALF = ((0.7, 0.35), (0.5, 0.3))
X = np.array([-2.0, 0.0, 2.0])


def along(angle, height, bow=0.0):
    """Three control points of a yarn in the plane at ``height``, at ``angle`` to x."""
    points = np.column_stack([X * np.cos(angle), X * np.sin(angle), np.full(3, height)])
    points[1, 2] += bow
    return points


def quaternion(vector):
    angle = float(np.linalg.norm(vector))
    return np.concatenate([[np.cos(0.5 * angle)], 0.5 * np.sinc(0.5 * angle / np.pi) * np.asarray(vector)])


def product(p, q):
    return np.concatenate([[p[0] * q[0] - p[1:] @ q[1:]], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])])


class Pair:
    """Two yarns of three control points with elliptic sections, in one tracked contact."""

    def __init__(self, a, b, tilt=(0.0, 0.0), half=HALF, line=0.0):
        self.nodes = nodes_at(np.hstack([a.T, b.T, np.zeros((3, 1))]))
        upright, square, excess = np.zeros((3, 6)), np.zeros(6), np.zeros(6)
        for yarn, (points, lean, (wide, high)) in enumerate(zip((a, b), tilt, half, strict=True)):
            tangent = (points[2] - points[0]) / np.linalg.norm(points[2] - points[0])
            up = np.array([0.0, 0.0, 1.0]) - tangent[2] * tangent
            up /= np.linalg.norm(up)
            of = slice(3 * yarn, 3 * yarn + 3)
            upright[:, of] = (np.cos(lean) * up + np.sin(lean) * np.cross(tangent, up))[:, None]
            square[of], excess[of] = wide**2, high**2 - wide**2
        self.contacts = contacts_of(
            (1, 4), line=np.full(1, line), shift=np.zeros((3, 1)), other=np.zeros((3, 1)), touch=np.zeros(1),
            upright=upright, turned=upright.copy(), square=square, excess=excess,
        )  # fmt: skip
        self.alive = np.array([1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0])
        self.place()

    def place(self):
        """Start where a search places the contact, free of what it was cut by."""
        c, centre = self.contacts, self.nodes.position
        places = np.zeros((1, 1, COLUMNS))
        at = 0.125 * centre[:, [0, 3]] + 0.75 * centre[:, [1, 4]] + 0.125 * centre[:, [2, 5]]
        places[0, 0, :6] = [0.5, 0.5, *(at[:, 0] - at[:, 1]), c.line[0]]
        pairs = np.array([[[1, 4]]])
        plain(place_ellipses)(pairs, places, np.array([1]), centre, c, self.alive, 9.0)
        assert pairs[0, 0].tolist() == [1, 4]
        row = places[0, 0]
        c.parameter[:, 0], c.offset[:, 0], c.shift[:, 0], c.other[:, 0] = row[:2], row[2:5], row[6:9], row[9:12]
        c.touch[0], c.arm[0], c.reach[0] = row[12], row[13], row[12]

    def step(self, law):
        """Evaluate the contact at the present poses."""
        plain(turn_sections)(0, 6, self.nodes, self.contacts)
        plain(contact_forces)((0, 1), DT, self.nodes, self.contacts, self.alive, law, law.spin, True, np.zeros(SCRATCH))

    def turn(self, node, vector):
        """Turn a node by a rotation vector."""
        self.nodes.rotation[:, node] = product(quaternion(vector), self.nodes.rotation[:, node])

    def settle(self):
        """Depth [mm] once the closest points have come to rest, of an overlap that is felt from its first touch on."""
        for _ in range(40):
            self.contacts.reach[:] = self.contacts.touch
            self.step(SMOOTH)
        return float(self.contacts.touch[0] - np.linalg.norm(self.contacts.offset[:, 0]))

    def energy(self):
        return plain(penalty)(self.settle(), *(SMOOTH[k] for k in (0, 5, 6, 7, 8)))[2]

    def on_nodes(self):
        """Forces [N] and moments [N mm] on the nodes, (6, 3)."""
        self.nodes.force[:], self.nodes.moment[:] = 0.0, 0.0
        plain(scatter_contacts)(0, self.nodes, self.contacts)
        return self.nodes.force[:, :6].T.copy(), self.nodes.moment[:, :6].T.copy()


POSES = {
    "crossed, leaning": (along(0.0, 0.66, 0.1), along(np.deg2rad(70.0), 0.0, -0.05), (0.5, -0.8), 0.0),
    "aslant": (along(0.0, 0.72), along(np.deg2rad(25.0), 0.0), (0.9, 0.3), 0.0),
    "side by side": (along(0.0, 0.6) + np.array([0.0, 0.35, 0.0]), along(np.deg2rad(3.0), 0.0), (0.4, -0.3), 1.0),
}  # fmt: skip


@pytest.mark.parametrize("name", POSES)
def test_forces_and_couples_are_the_gradient_of_the_energy(name):
    """f = -dE/dx and m = -dE/d(turn) of every control point: no closed path makes energy, whatever leans and rolls."""
    a, b, tilt, line = POSES[name]
    pair, h = Pair(a, b, tilt, line=line), 1e-5
    assert 0.005 < pair.settle() < 0.3
    force, moment = pair.on_nodes()
    assert np.abs(moment).max() > 0.05 * np.abs(force).max()
    for node, axis in np.ndindex(6, 3):
        moved = -derivative(pair.energy, pair.nodes.position, (axis, node), h)
        turned = []
        for step in (h, -h):
            pair.turn(node, step * np.eye(3)[axis])
            turned.append(pair.energy())
            pair.turn(node, -step * np.eye(3)[axis])
        assert moved == pytest.approx(force[node, axis], abs=2e-3 * np.abs(force).max())
        assert (turned[1] - turned[0]) / (2.0 * h) == pytest.approx(moment[node, axis], abs=5e-3 * np.abs(moment).max())


def test_a_rubbing_contact_of_ellipses_keeps_angular_momentum():
    pair = Pair(*POSES["crossed, leaning"][:3])
    pair.settle()
    pair.nodes.position[:2, :3] += np.array([[0.004], [0.002]])
    pair.step(STICKY)
    force, moment = pair.on_nodes()
    total = np.cross(pair.nodes.position[:, :6].T, force) + moment
    assert np.abs(pair.contacts.spring).max() > 1e-3
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    assert np.abs(total.sum(axis=0)).max() < 1e-9 * np.abs(force).max()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rigid_turn_of_ellipses_rubs_and_closes_nothing(axis):
    pair, steps, angle = Pair(*POSES["crossed, leaning"][:3]), 200, 0.3
    depth = pair.settle()
    pair.contacts.spring[:] = 0.0
    turn = np.eye(3)[axis] * angle / steps
    pair.nodes.spin[:, :6] = turn[:, None] / DT
    matrix = turned_by(turn)
    for _ in range(steps):
        pair.nodes.position[:, :6] = matrix @ pair.nodes.position[:, :6]
        for node in range(6):
            pair.turn(node, turn)
        pair.step(STICKY)
    assert np.abs(pair.contacts.spring).max() < 2e-4  # the yarns turn by 0.2 mm there
    assert pair.contacts.reach[0] - np.linalg.norm(pair.contacts.offset[:, 0]) == pytest.approx(depth, rel=2e-3)


def turned_by(vector):
    q = quaternion(vector)
    return np.column_stack(
        [product(product(q, np.concatenate([[0.0], e])), q * [1, -1, -1, -1])[1:] for e in np.eye(3)]
    )


def test_an_ellipse_rolls_along_a_yarn():
    """A = h + h'' = a^2 b^2 / h^3 is the radius of curvature: by an angle p the ellipse rolls on by the arc, the
    integral of A, its centre at h(p) over the line and h'(p) behind the point of touch. Nothing rubs.
    """
    wide, high = HALF[0]
    turn = np.linspace(0.0, 1.2, 1201)
    h = np.sqrt((high * np.cos(turn)) ** 2 + (wide * np.sin(turn)) ** 2)
    slope = (wide**2 - high**2) * np.sin(turn) * np.cos(turn) / h
    arc = cumulative_trapezoid((wide * high) ** 2 / h**3, turn, initial=0.0)
    way = arc - slope
    assert way[-1] > 0.3
    b = np.column_stack([X - 0.5, np.zeros(3), np.zeros(3)])
    pair = Pair(along(0.5 * np.pi, 0.25 + high - 0.02), b, half=(HALF[0], (0.25, 0.25)))
    pair.settle()
    pair.contacts.spring[:] = 0.0
    start = pair.nodes.position[:, :3].copy()
    for k in range(1, len(turn)):
        pair.nodes.position[0, :3] = start[0] + way[k]
        pair.nodes.position[2, :3] = start[2] + h[k] - h[0]
        for node in range(3):
            pair.turn(node, [0.0, turn[k] - turn[k - 1], 0.0])
        pair.nodes.spin[1, :3] = (turn[k] - turn[k - 1]) / DT
        pair.step(STICKY)
    # the depth of 0.02 mm lies half within either yarn
    assert np.abs(pair.contacts.spring).max() < 0.05 * arc[-1]


def nearest(pair, inside):
    """Gap [mm] of two yarns of ``pair`` as an optimiser sees it: surface points of both ellipses swept along splines,
    from the parameters ``inside`` on.
    """
    x, up = pair.nodes.position, pair.contacts.upright

    def surface(yarn, s, angle):
        p, w = x[:, 3 * yarn : 3 * yarn + 3], np.array([0.5 * (1 - s) ** 2, 0.5 + s - s * s, 0.5 * s * s])
        tangent = (p[:, 1] - p[:, 0]) + s * (p[:, 0] - 2 * p[:, 1] + p[:, 2])
        tangent /= np.linalg.norm(tangent)
        high = up[:, 3 * yarn] - (up[:, 3 * yarn] @ tangent) * tangent
        high /= np.linalg.norm(high)
        square = pair.contacts.square[3 * yarn]
        a, b = np.sqrt([square, square + pair.contacts.excess[3 * yarn]])
        return p @ w + a * np.cos(angle) * np.cross(high, tangent) + b * np.sin(angle) * high

    def apart(v):
        return np.sum((surface(0, v[0], v[1]) - surface(1, v[2], v[3])) ** 2)

    return float(np.sqrt(minimize(apart, inside, tol=1e-12).fun))


ROUND = ((0.35, 0.35), HALF[1])


@pytest.mark.parametrize(("bow", "half", "along_it"), [(-0.5, HALF, 0.0), (0.35, HALF, 0.22), (1.1, ROUND, 0.7)])
def test_the_gap_of_a_yarn_bent_over_an_inlay_is_that_of_an_optimiser(bow, half, along_it):
    """The inlay B lies flat below; the upper yarn bends over it (bow > 0) or away from it. A loop, which is round, may
    bend nearly along it: at 1 the nearest place becomes two.
    """
    pair = Pair(along(0.0, 0.75 - 0.75 * bow, bow), along(np.deg2rad(80.0), 0.0), (0.2, -0.1), half)
    pair.settle()
    gap = float(np.linalg.norm(pair.contacts.offset[:, 0]) - pair.contacts.touch[0])
    assert gap > 0.05
    assert gap == pytest.approx(nearest(pair, [0.5, -0.5 * np.pi, 0.5, 0.5 * np.pi]), abs=2e-4)
    tracker = SimpleNamespace(contacts=pair.contacts, count=1)
    assert max(conformity(tracker, pair.nodes.position)[0], 0.0) == pytest.approx(along_it, abs=0.06)


def test_yarns_that_bend_apart_side_by_side_are_placed_where_an_optimiser_sees_them():
    """Their tangents are parallel, so that no cross product gives the normal; one was not found until it overlapped."""
    for angle in (0.0, 0.02):
        pair = Pair(along(0.0, 1.05, -0.3), along(angle, 0.0), (0.3, -0.2), HALF)
        gap = float(np.linalg.norm(pair.contacts.offset[:, 0]) - pair.contacts.touch[0])
        assert gap > 0.05
        assert gap == pytest.approx(nearest(pair, [0.5, -0.5 * np.pi, 0.5, 0.5 * np.pi]), abs=2e-4)


def test_closest_points_of_flat_yarns_that_wrap_each_other_come_to_rest():
    """Each bends by 0.53 towards the section of the other. With its own section, that turns with it, taken for one that
    does not, it would be 0.79, and steps would go past the closest points by 1.2 times their distance, for ever.
    """
    half, bow, size = (0.7, 0.4), 0.04, 0.25
    upper, lower = along(0.0, 0.0, bow / size), along(0.5 * np.pi, 0.0, -bow / size)
    upper, lower = size * upper + np.array([0.02, 0.0, 0.85 - 1.5 * bow]), size * lower
    pair = Pair(upper, lower, half=(half, half))
    for node, slope in ((0, 4.0 * bow), (2, -4.0 * bow)):  # sections stand across their yarns
        for start, lean in ((0, [-slope, 0.0, 1.0]), (3, [0.0, slope, 1.0])):
            pair.contacts.upright[:, start + node] = np.array(lean) / np.linalg.norm(lean)
    pair.contacts.turned[:] = pair.contacts.upright
    pair.place()
    placed = pair.contacts.parameter.copy()
    pair.contacts.parameter[:] += 0.02
    pair.settle()
    assert pair.contacts.parameter == pytest.approx(placed, abs=1e-4)
    tracker = SimpleNamespace(contacts=pair.contacts, count=1)
    assert conformity(tracker, pair.nodes.position)[0] == pytest.approx(0.53, abs=0.03)


@pytest.mark.parametrize(("ratio", "marks"), [(1.8, True), (1.3, False)])
def test_a_yarn_that_bends_about_the_curvature_of_a_section_lies_along_it(ratio, marks):
    """Curvature times distance 1.03 and 0.74; that to the centre-lines is 0.57 and 0.64, of no wrap."""
    tracker, position = bent_over(ratio, 0.0)
    contacts, nodes = tracker.contacts, 6
    at = 0.125 * position[:, [0, 3]] + 0.75 * position[:, [1, 4]] + 0.125 * position[:, [2, 5]]
    places = np.array([[[0.5, 0.5, *(at[:, 0] - at[:, 1]), 0.0]]])
    one, none = np.ones(nodes), np.full((nodes, MOST), -1)
    chain = np.repeat([0, 1], 3)
    pieces = Pieces(one, one, np.ones(nodes, np.int64), chain, one < 0.0, np.arange(nodes), none)
    pairs, found = np.array([[[1, 4]]]), np.array([1])
    assert plain(mark_found)(pairs, places, found, position, contacts.excess, pieces) == 0
    assert plain(mark_ellipses)(pairs, places, found, position, contacts, pieces) == (3 if marks else 0)
    assert (none[:3, 0] == 1).all() == marks


def bent_over(ratio, force, settled=True):
    """A round yarn that bends over an inlay of a width over height, of the area of HALF[1], and presses it."""
    high = np.sqrt(HALF[1][0] * HALF[1][1] / ratio)
    pair = Pair(along(0.0, 0.75 - 0.75 * 1.6, 1.6), along(0.5 * np.pi, 0.0), half=(ROUND[0], (ratio * high, high)))
    if settled:
        pair.settle()
    pair.contacts.force[2, 0] = force
    return SimpleNamespace(contacts=pair.contacts, count=1, name_of=lambda i: f"yarn {i // 3}"), pair.nodes.position


def test_a_section_along_which_a_loaded_loop_bends_is_refused_with_a_ratio_that_conforms_by_less():
    tracker, position = bent_over(1.8, 0.1, settled=False)
    assert 1.0 < conformity(tracker, position)[0] < 1.2
    with pytest.raises(
        InputError, match=r"yarn 0 and yarn 1 bend around a section 1.8 times .* expected at most about 1.25"
    ) as said:
        check_conformity(tracker, position)
    most = float(str(said.value).split("at most about ")[1])
    assert conformity(*bent_over(most, 0.1))[0] < 0.9 * conformity(tracker, position)[0]
    check_conformity(*bent_over(most, 0.1))
    check_conformity(*bent_over(1.5, 0.1))  # nearly along it: the nearest place is one
    check_conformity(*bent_over(1.8, 0.0, settled=False))  # nothing presses


def test_a_contact_that_runs_along_a_yarn_that_swings_closes_by_what_both_do_together():
    """A swings by p about y while B, below and across it, moves on by e along it: the gap there closes by p e, half of
    which the yarns do where the contact was and half where it runs to.
    """
    pair, swing, way = Pair(along(0.0, 0.6), along(0.5 * np.pi, 0.0)), 2e-4, 0.05
    pair.contacts.reach[0] = pair.settle() + np.linalg.norm(pair.contacts.offset[:, 0])
    pair.step(SMOOTH)
    before = pair.contacts.reach[0] - np.linalg.norm(pair.contacts.offset[:, 0])
    for node in range(3):
        pair.turn(node, [0.0, swing, 0.0])
        pair.nodes.velocity[2, node] = -swing * pair.nodes.position[0, node] / DT
        pair.nodes.spin[1, node] = swing / DT
        pair.nodes.velocity[0, 3 + node] = way / DT
    pair.nodes.position[:] += DT * pair.nodes.velocity
    pair.step(SMOOTH)
    after = pair.contacts.reach[0] - np.linalg.norm(pair.contacts.offset[:, 0])
    assert after - before == pytest.approx(swing * way, rel=0.02)
