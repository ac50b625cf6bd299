"""Friction moment of a crossing in plain Python: spring, shared limit, losses, couples, lever. No compiling."""

import numpy as np
import pytest
from plain import plain
from test_plain_contact import DT, REACH, SMOOTH, Crossing

from knittest.kernels.line_contact import MOST, Pieces
from knittest.kernels.monitor import contact_statistics
from knittest.kernels.search import find_contacts
from knittest.kernels.spin import lever_of, shares_left
from knittest.kernels.state import ContactLaw, Contacts

#: friction 0.4 until it slips, then 0.3; torsional 2 N mm/rad
LAW = ContactLaw(20.0, 150.0, 0.4, 0.3, 0.0, torsional=2.0)
LEVER = 0.25


class Spinning(Crossing):
    """A crossing whose closest points are found, with a patch of the given lever [mm]."""

    def __init__(self, lever: float = LEVER, law: ContactLaw = LAW) -> None:
        super().__init__(law)
        self.contacts.lever[:] = [[1e30], [lever]]
        self.friction, self.spun = 0.0, 0.0
        self.step(law)
        self.contacts.spring[:], self.contacts.slipping[:] = 0.0, 0.0
        self.normal = self.contacts.offset[:, 0] / np.linalg.norm(self.contacts.offset)
        self.pressure = float(np.linalg.norm(self.contacts.force))
        along = np.cross(self.normal, [0.0, 1.0, 0.0])
        self.along = along / np.linalg.norm(along)

    def move(self, turn: float, slide: float = 0.0) -> float:
        """Turn yarn A by ``turn`` [rad] about the normal and slide it [mm] across it; returns the moment [N mm] on A.

        The spins turn, the control points only slide: the shape of the yarns is no matter of the spring.
        """
        self.nodes.spin[:, :3] = turn / DT * self.normal[:, None]
        self.nodes.position[:, :3] += slide * self.along[:, None]
        lost, spun, _ = self.step()
        self.friction, self.spun = self.friction + lost, self.spun + spun
        return -float(self.contacts.couple[0] * np.linalg.norm(self.contacts.offset))

    def rub(self) -> float:
        """Friction force [N] along the slide on yarn A."""
        return float(self.contacts.force[:, 0] @ self.along)


def test_the_moment_rises_by_its_spring_and_ends_at_its_limit():
    """-k w, against the turn, until mu_s N l; then mu_k N l."""
    crossing = Spinning()
    moments = [crossing.move(1e-2) for _ in range(1500)]
    assert moments[0] == pytest.approx(-2.0 * 1e-2, rel=1e-9)
    most = crossing.pressure * LEVER
    assert min(moments) == pytest.approx(-0.4 * most, rel=0.04)  # within a step
    assert moments[-1] == pytest.approx(-0.3 * most, rel=1e-9)
    assert crossing.friction == pytest.approx(crossing.spun, rel=1e-6) and crossing.spun > 1.0


def test_a_cycle_of_spin_makes_no_energy():
    """Minus the work of the mean moment on a turn there and back = energy in the spring + loss, to round-off."""
    crossing, moment, work = Spinning(), 0.0, 0.0
    for turn in 1e-2 * np.concatenate([np.full(700, 1.0), np.full(1300, -1.0), np.full(600, 1.0), np.full(7, -1.0)]):
        before, moment = moment, crossing.move(turn)
        work -= 0.5 * (before + moment) * turn
    stored = 0.5 * LAW.torsional * float(crossing.contacts.twist[0]) ** 2
    assert stored > 0.01 and crossing.spun > 1.0
    assert work == pytest.approx(stored + crossing.spun, rel=1e-9)
    depth = REACH - float(np.linalg.norm(crossing.contacts.offset))
    energy, _ = plain(contact_statistics)(crossing.contacts, 1, LAW, np.ones(7))
    assert energy == pytest.approx(10.0 * depth**2 + stored + 75.0 * float((crossing.contacts.spring**2).sum()))


@pytest.mark.parametrize("torsional", [0.5, 150.0 * LEVER**2, 60.0])
@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0, 4.0])
def test_slip_and_spin_share_one_limit(torsional, ratio):
    """f : M / l = v : l w at steady slip whatever the springs, on the ellipse."""
    crossing = Spinning(law=LAW._replace(torsional=torsional, static=0.03, kinetic=0.02))
    for slide in np.repeat([1.0, -1.0], 100) * ratio * LEVER * 1e-3:
        moment = crossing.move(1e-3, slide)
    limit = 0.02 * crossing.pressure
    f, m = abs(crossing.rub()) / limit, abs(moment) / (limit * LEVER)
    size = np.hypot(1.0, ratio)
    assert (f, m) == (pytest.approx(ratio / size, abs=0.02), pytest.approx(1.0 / size, abs=0.02))


def test_shares_left_lie_on_the_limit_along_its_normal():
    """f = f0 / x, m = m0 / (1 + r (x - 1)), f^2 + m^2 = limit^2, against a bisection."""
    for f0, m0, ratio in ((1.1, 0.2, 0.1), (0.8, 0.8, 8.0), (0.01, 2.0, 0.3), (2.0, 0.0, 5.0)):
        low, high = 1.0, 1e3
        for _ in range(200):
            x = 0.5 * (low + high)
            low, high = (x, high) if (f0 / x) ** 2 + (m0 / (1.0 + ratio * (x - 1.0))) ** 2 > 1.0 else (low, x)
        f_left, m_left = plain(shares_left)(f0 * f0, m0 * m0, 1.0, ratio)
        assert (f0 * f_left) ** 2 + (m0 * m_left) ** 2 == pytest.approx(1.0, rel=1e-12)
        assert (f_left, m_left) == pytest.approx((1.0 / x, 1.0 / (1.0 + ratio * (x - 1.0))), rel=1e-3)
    assert plain(shares_left)(4.0, 1.0, 0.0, 1.0) == (0.0, 0.0)


def test_the_loss_of_both_is_that_of_central_differences():
    """Work of the mean force on the slide and of the mean moment on the turn = springs + loss."""
    crossing, work, moment = Spinning(), 0.0, 0.0
    force = np.zeros(3)
    for k in range(400):
        turn, slide = (9e-3, 1e-4) if k % 200 < 120 else (-9e-3, -1.5e-4)
        before, old = moment, force
        moment = crossing.move(turn, slide)
        rub = crossing.contacts.force[:, 0]
        force = rub - crossing.normal * (rub @ crossing.normal)
        work -= 0.5 * (before + moment) * turn + 0.5 * float((old + force) @ crossing.along) * slide
    stored = 0.5 * LAW.torsional * float(crossing.contacts.twist[0]) ** 2
    stored += 0.5 * LAW.tangential * float((crossing.contacts.spring**2).sum())
    assert crossing.spun > 0.1 and crossing.friction - crossing.spun > 0.01
    assert work == pytest.approx(stored + crossing.friction, rel=0.02)


def test_the_couple_is_equal_and_opposite_and_against_the_turn():
    """On the nodes of either yarn by its spline weights; forces and arms keep their balance."""
    crossing = Spinning()
    moment = crossing.move(1e-2)
    free = Spinning(0.0)
    free.move(1e-2)
    couples = crossing.on_nodes()[1] - free.on_nodes()[1]
    normal = crossing.contacts.offset[:, 0] / np.linalg.norm(crossing.contacts.offset)
    assert couples[:3].sum(axis=0) == pytest.approx(moment * normal, rel=1e-6)
    assert couples[3:].sum(axis=0) == pytest.approx(-moment * normal, rel=1e-6)
    assert moment < 0.0 and (couples[:, 1] != 0.0).all()
    assert couples[1] @ normal == pytest.approx(0.75 * moment, rel=0.05)  # middle node of a piece


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rigid_turn_spins_nothing(axis):
    """Both yarns turn with the normal."""
    crossing = Spinning()
    crossing.contacts.twist[:] = 0.05
    spin = np.eye(3)[axis] * 1e-3 / DT
    crossing.nodes.spin[:, :6] = spin[:, None]
    crossing.nodes.position[:, :6] += DT * np.cross(spin, crossing.nodes.position[:, :6].T).T
    crossing.step()
    assert crossing.contacts.twist[0] == pytest.approx(0.05, abs=1e-12)


def test_a_turn_about_another_axis_is_no_spin():
    crossing = Spinning()
    crossing.nodes.spin[:, :3] = crossing.along[:, None] * 1e-2 / DT
    crossing.step()
    assert abs(crossing.contacts.twist[0]) < 1e-9


def test_nothing_resists_without_a_patch_or_when_a_yarn_is_broken():
    free = Spinning(0.0)
    assert free.move(1e-2) == 0.0 and free.contacts.twist[0] == 0.0
    crossing = Spinning()
    crossing.move(1e-2)
    held = crossing.contacts.twist[0]
    broken = Spinning()
    broken.contacts.twist[:] = held
    lost, spun, _ = broken.step(alive=np.array([1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0]))
    assert broken.contacts.twist[0] == broken.contacts.couple[0] == 0.0
    assert spun == pytest.approx(0.5 * LAW.torsional * held**2) and lost >= spun


def test_a_contact_that_was_just_found_spins_by_nothing():
    crossing = Spinning()
    crossing.contacts.force[:] = 0.0
    assert crossing.move(1e-2) == 0.0


@pytest.mark.parametrize(("softening", "power"), [(1.0, 0.25), (3.0, 0.125)])
def test_the_lever_grows_by_its_power_to_its_largest(softening, power):
    for force in (0.01, 0.3, 5.0):
        assert plain(lever_of)(force, 0.2, 9.0, softening) == pytest.approx(0.2 * force**power, rel=1e-12)
    assert plain(lever_of)(5.0, 0.2, 0.15, softening) == 0.15


def test_without_torsional_stiffness_the_bits_are_those_of_no_patch():
    smooth = ContactLaw(200.0, 150.0, 0.3, 0.2, 0.0)
    pair = Spinning(law=smooth), Crossing(smooth)
    for crossing in pair:
        crossing.nodes.spin[:, :3] = 3.0
        crossing.nodes.position[0, :3] += 3e-3
        crossing.step(smooth)
    for name in ("spring", "force", "couple"):
        assert getattr(pair[0].contacts, name).tobytes() == getattr(pair[1].contacts, name).tobytes()
    assert SMOOTH.torsional == 0.0


AT_ONE_PLACE = np.zeros((3, 6))


def found_again(line: float, s: float, tracked: int = 1, position: np.ndarray = AT_ONE_PLACE) -> Contacts:
    """Contact found at piece 2 where, if ``tracked``, one was on piece 1 at ``s``."""
    old, new = Spinning().contacts, Spinning().contacts
    old.parameter[0, 0], old.twist[0], old.line[0] = s, 0.07, line
    nodes = 6
    pairs, places = np.zeros((1, 1, 2), np.int64), np.zeros((1, 1, 6))
    pairs[0, 0], places[0, 0] = (2, 4), (s - 1.0, old.parameter[1, 0], 0.0, 0.0, 0.9, line)
    chain, part = np.array([0, 0, 0, 1, 1, 1]), np.array([0, 0, 0, 2, 2, 2])
    one, none = np.ones(nodes), np.full((nodes, MOST), -1)
    pieces = Pieces(one, one, np.ones(nodes, np.int64), chain, one < 0.0, np.arange(nodes), none)
    levers = np.arange(18.0).reshape(2, 3, 3)
    still, radius = np.zeros(nodes, np.bool_), np.full(nodes, 0.5)
    count = plain(find_contacts)(
        position, pairs, places, np.array([1]), radius, part, levers, pieces, np.ones(nodes), ~still, 0.1, old, tracked,
        new,
    )  # fmt: skip
    assert count == 1 and new.piece[:, 0].tolist() == [2, 4]
    return new


def test_the_neighbour_piece_inherits_the_twist_and_looks_its_lever_up():
    found = found_again(0.0, 1.6)
    assert [found.twist[0], *found.lever[:, 0]] == pytest.approx([0.07, 2.0, 11.0])


def test_yarns_side_by_side_have_no_lever():
    assert found_again(1.0, 1.6).lever[1, 0] == 0.0


def test_a_contact_found_anew_looks_back_on_its_present_tangents():
    position = np.random.default_rng(1).standard_normal((3, 6))
    found = found_again(0.0, 1.6, 0, position)
    for tangents, side in ((found.tangent, 0), (found.other_tangent, 1)):
        i, s = found.piece[side, 0], found.parameter[side, 0]
        assert tangents[:, 0] == pytest.approx(np.diff(position[:, i - 1 : i + 2]) @ [1.0 - s, s])


def turn_both(crossing: Spinning, axis: np.ndarray, angle: float) -> None:
    """Turn both yarns rigidly about the contact by the small ``angle`` [rad] about ``axis``, spins with them."""
    x = crossing.nodes.position[:, :6]
    x += np.sin(angle) * np.cross(axis, x.T).T + (1.0 - np.cos(angle)) * np.cross(axis, np.cross(axis, x.T)).T
    crossing.nodes.spin[:, :6] = angle / DT * axis[:, None]


def test_the_loss_of_slip_is_that_of_the_force_turned_with_the_yarns():
    """A slide, then a turn of both with a slide across the force that was: mean force times slide, less the spring."""
    crossing, angle, slide = Spinning(), 0.1, 0.01
    for _ in range(40):
        crossing.move(0.0, 1e-3)
    old = crossing.contacts.spring[:, 0].copy()
    turn_both(crossing, crossing.normal, angle)
    across = np.cross(crossing.normal, crossing.along)
    way = slide * (np.cos(angle) * across - np.sin(angle) * crossing.along)
    crossing.nodes.position[:, :3] += way[:, None]
    lost, _, _ = crossing.step()
    new, turned = crossing.contacts.spring[:, 0], old + angle * np.cross(crossing.normal, old)
    slid = way - 0.5 * angle * np.cross(crossing.normal, way)  # as seen from yarns half turned
    expected = 0.5 * LAW.tangential * float((turned + new) @ slid + turned @ turned - new @ new)
    assert lost == pytest.approx(expected, rel=0.015) and np.linalg.norm(old) > 0.01


@pytest.mark.parametrize("way", [0.0, 0.5 * np.pi, 2.0])
def test_a_slide_of_yarns_that_turn_is_seen_from_halfway(way):
    """Contacts run along both yarns; where they were and where they are, seen on average, are half a turn apart."""
    crossing, angle, slide = Spinning(), 0.1, 0.01
    way = slide * (np.cos(way) * crossing.along + np.sin(way) * np.cross(crossing.normal, crossing.along))
    turn_both(crossing, crossing.normal, angle)
    crossing.nodes.position[:, :3] += way[:, None]
    crossing.step(LAW._replace(static=1e3, torsional=0.0))
    halfway = way - 0.5 * angle * np.cross(crossing.normal, way)
    assert crossing.contacts.spring[:, 0] == pytest.approx(halfway, abs=0.01 * slide)
