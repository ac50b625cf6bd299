"""Yarn contact against its energy and Coulomb's law, in plain Python: gradients, balance, work. No compiling."""

import numpy as np
import pytest
from contact_cases import contacts_of, derivative, nodes_at
from plain import plain

from knittest.kernels.contact import SCRATCH, contact_force, penalty
from knittest.kernels.contact_blocks import contact_forces, scatter_contacts
from knittest.kernels.contact_gather import move_to_next_piece
from knittest.kernels.state import ContactLaw

REACH, DT = 1.0, 1e-4
WHOLE = np.ones(7)
SMOOTH = ContactLaw(200.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.2, 0.1, 0.3)
ROUGH = ContactLaw(200.0, 150.0, 0.3, 0.2, 0.0)


@pytest.mark.parametrize("depth", [0.01, 0.2, 0.3, 0.45])
def test_penalty_is_the_gradient_of_its_energy(depth):
    """F = dE/dd and k = dF/dd, below the cap and beyond it, where the stiffness stays."""
    law, h = (200.0, 0.5, 0.2, 0.1, 0.3), 1e-6
    force, tangent, _ = plain(penalty)(depth, *law)
    (f1, _, e1), (f0, _, e0) = (plain(penalty)(depth + s, *law) for s in (h, -h))
    assert force == pytest.approx((e1 - e0) / (2.0 * h), rel=1e-8)
    assert tangent == pytest.approx((f1 - f0) / (2.0 * h), rel=1e-4 if depth == 0.3 else 1e-7)


class Crossing:
    """Two curved pieces of three control points each that press on each other, yarn B on nodes 3 to 5."""

    def __init__(self, law: ContactLaw) -> None:
        self.law = law
        a = np.array([[-2.0, 0.1, 0.05], [0.1, 0.0, 0.45], [2.1, -0.1, 0.1]])
        b = np.array([[0.1, -1.9, -0.1], [0.0, 0.05, -0.45], [-0.1, 2.0, -0.15]])
        position = np.hstack([np.vstack([a, b]).T, np.zeros((3, 1))])
        self.nodes = nodes_at(position)
        self.contacts = contacts_of((1, 4), reach=np.full(1, REACH), arm=np.full(1, 0.4))
        for _ in range(20):  # closest points settle, at no friction
            self.step(SMOOTH)
        self.contacts.spring[:], self.contacts.slipping[:] = 0.0, 0.0

    def step(self, law: ContactLaw | None = None, alive: np.ndarray = WHOLE) -> tuple[float, float, float]:
        """Evaluate the contact at the present positions; returns what :func:`contact_forces` does."""
        self.contacts.reach[:] = REACH
        arguments = self.nodes, self.contacts, alive, law or self.law, (law or self.law).spin, None, np.zeros(SCRATCH)
        return plain(contact_forces)((0, 1), DT, *arguments)

    def on_nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Forces [N] and moments [N mm] on the nodes, (6, 3)."""
        self.nodes.force[:], self.nodes.moment[:] = 0.0, 0.0
        plain(scatter_contacts)(0, self.nodes, self.contacts)
        return self.nodes.force[:, :6].T.copy(), self.nodes.moment[:, :6].T.copy()

    def energy(self) -> float:
        """Energy [mJ] of the penalty at the settled closest points."""
        for _ in range(20):
            self.step(SMOOTH)
        depth = REACH - float(np.linalg.norm(self.contacts.offset[:, 0]))
        return plain(penalty)(depth, SMOOTH.normal, SMOOTH.linear, SMOOTH.square, SMOOTH.cubic, SMOOTH.cap)[2]


def test_forces_are_the_gradient_of_the_energy():
    """f = -dE/dx of both yarns' control points, the closest points following: central differences, h^2."""
    crossing, h = Crossing(SMOOTH), 1e-6
    force, _ = crossing.on_nodes()
    assert np.abs(force).max() > 1.0
    for i, axis in np.ndindex(6, 3):
        found = -derivative(crossing.energy, crossing.nodes.position, (axis, i), h)
        assert found == pytest.approx(force[i, axis], abs=1e-6 * np.abs(force).max())


def test_a_rubbing_contact_keeps_momentum_and_angular_momentum():
    """Forces sum to nothing, and so do their moments with the couples of their arms (round-off)."""
    crossing = Crossing(ROUGH)
    crossing.nodes.position[:2, :3] += np.array([[0.004], [0.002]])
    crossing.step()
    assert np.abs(crossing.contacts.spring).max() > 1e-3  # it rubs
    force, moment = crossing.on_nodes()
    total = np.cross(crossing.nodes.position[:, :6].T, force) + moment
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    # material points of the last step against closest points of this one: of the order of the slide
    assert np.abs(total.sum(axis=0)).max() < 1e-9 * np.abs(force).max()


def slide(steps: np.ndarray, slipping: float = 0.0) -> tuple[np.ndarray, np.ndarray, float]:
    """Forces (n, 3) of a contact 0.2 mm deep in x that is slid by ``steps`` (n,) [mm] along y, springs (n,), and loss
    [mJ]; its normal force is 40 N.
    """
    spring, forces, springs, loss = (0.0, 0.0, 0.0), [], [], 0.0
    for step in steps:
        *force, ex, ey, ez, slipping, rubbed, _ = plain(contact_force)(
            0.8, 0.0, 0.0, 0.0, REACH, *spring, 0.0, step, 0.0, slipping, ROUGH, 1.0 / DT
        )
        spring, loss = (ex, ey, ez), loss + rubbed
        forces.append(force)
        springs.append(ey)
    return np.array(forces), np.array(springs), loss


def test_friction_opposes_the_slide():
    """A grows its offset along +y: friction on A points to -y, kt e while it sticks, kinetic mu N once it slips."""
    forces, _, _ = slide(np.full(300, 1e-3))
    assert forces[:, 0] == pytest.approx(40.0)
    assert forces[0, 1] == pytest.approx(-0.15)  # 150 N/mm x 1 um
    assert forces[:, 1].min() == pytest.approx(-0.3 * 40.0, abs=0.15)  # within a step of the static limit
    assert forces[-1, 1] == pytest.approx(-0.2 * 40.0)


def test_work_of_friction_is_spring_and_loss():
    """Minus the work of the mean force on a slide there and back = energy in the spring + loss, to round-off."""
    steps = 1e-3 * np.concatenate([np.full(120, 1.0), np.full(150, -1.0), np.full(7, 1.0)])
    forces, springs, loss = slide(steps)
    mean = 0.5 * (forces[:, 1] + np.concatenate([[0.0], forces[:-1, 1]]))
    stored = 0.5 * ROUGH.tangential * springs[-1] ** 2
    assert loss > 0.5
    assert -float(mean @ steps) == pytest.approx(stored + loss, rel=1e-12)


def test_turning_yarns_rub():
    """A yarn that spins about its own axis slides on the other with the speed of its surface: spin times its arm."""
    crossing = Crossing(ContactLaw(200.0, 150.0, 9.0, 9.0, 0.0))
    crossing.step()
    crossing.contacts.spring[:] = 0.0
    crossing.nodes.spin[0, :3] = 2.0  # yarn A runs along x
    crossing.step()
    arm = crossing.contacts.arm[0] * crossing.contacts.offset[:, 0]
    surface = -DT * np.cross([2.0, 0.0, 0.0], arm)
    assert crossing.contacts.spring[:, 0] == pytest.approx(surface, rel=1e-3, abs=1e-9)


def test_the_spring_is_the_slide_of_the_yarns():
    """Yarn A moved by 3 and -2 um across the normal: the spring has that slide, with its sign."""
    crossing = Crossing(ContactLaw(200.0, 150.0, 9.0, 9.0, 0.0))
    crossing.step()
    crossing.contacts.spring[:] = 0.0
    normal = crossing.contacts.offset[:, 0] / np.linalg.norm(crossing.contacts.offset)
    move = np.array([3e-3, -2e-3, 0.0])
    crossing.nodes.position[:, :3] += move[:, None]
    crossing.step()
    expected = move - (move @ normal) * normal
    assert crossing.contacts.spring[:, 0] == pytest.approx(expected, rel=1e-2, abs=2e-5)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_rigid_turn_rubs_nothing(axis):
    """Both yarns turned as one, with their spins, by 1e-4 rad: no slide but of second order."""
    crossing = Crossing(ContactLaw(200.0, 150.0, 9.0, 9.0, 0.0))
    crossing.step()
    crossing.contacts.spring[:] = 0.0
    spin = np.eye(3)[axis] * 1e-4 / DT
    crossing.nodes.spin[:, :6] = spin[:, None]
    crossing.nodes.position[:, :6] += DT * np.cross(spin, crossing.nodes.position[:, :6].T).T
    crossing.step()
    assert np.abs(crossing.contacts.spring).max() < 1e-7  # a thousandth of the slide of one yarn alone


@pytest.mark.parametrize(
    ("side", "start", "parameter", "broken", "end", "left"),
    [(0, 3, 1.2, (), 4, 0.2), (1, 3, -0.3, (), 2, 0.7), (0, 3, 0.5, (), 3, 0.5), (1, 3, 1.2, (4,), 3, 1.2),
     (0, 3, -0.3, (1,), 3, -0.3), (0, 3, -0.3, (2,), 3, -0.3), (1, 1, -0.3, (), 1, -0.3)],
)  # fmt: skip
def test_a_contact_passes_to_the_next_piece_where_the_yarn_goes_on(side, start, parameter, broken, end, left):
    """Piece i spans elements i - 1 and i: the place on the yarn stays, at a break or an end the contact too."""
    crossing = Crossing(SMOOTH)
    contacts = crossing.contacts
    contacts.piece[side, 0], contacts.parameter[side, 0] = start, parameter
    other = contacts.piece[1 - side, 0], contacts.parameter[1 - side, 0]
    alive = np.ones(7)
    alive[list(broken)] = 0.0
    plain(move_to_next_piece)(0, 1, DT, crossing.nodes, contacts, alive)
    assert contacts.piece[side, 0] == end and contacts.parameter[side, 0] == pytest.approx(left)
    assert (contacts.piece[1 - side, 0], contacts.parameter[1 - side, 0]) == other


@pytest.mark.parametrize(("side", "parameter"), [(0, 1.2), (1, -0.3)])
def test_a_contact_that_passes_on_remembers_how_its_new_piece_lay_one_step_ago(side, parameter):
    """The tangent there of the nodes less what they moved; that of the other yarn is left as it was."""
    crossing = Crossing(SMOOTH)
    contacts, nodes = crossing.contacts, crossing.nodes
    tangents = (contacts.tangent, contacts.other_tangent)
    nodes.velocity[:] = np.random.default_rng(3).standard_normal((3, 7)) * 0.01 / DT
    contacts.piece[side, 0], contacts.parameter[side, 0] = 3, parameter
    kept = tangents[1 - side].copy()
    plain(move_to_next_piece)(0, 1, DT, nodes, contacts, np.ones(7))
    i, s = contacts.piece[side, 0], contacts.parameter[side, 0]
    before = (nodes.position - DT * nodes.velocity)[:, i - 1 : i + 2]
    assert tangents[side][:, 0] == pytest.approx(np.diff(before) @ [1.0 - s, s], abs=1e-12)
    assert np.array_equal(tangents[1 - side], kept)
