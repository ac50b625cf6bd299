"""Forces of the shells against their energy, in plain Python: gradients, balance, objectivity. No compiling."""

import numpy as np
import pytest
from plain import plain
from scipy.spatial.transform import Rotation
from shell_cases import Solid, X, descents, linear_laminate, product, quaternion
from test_shell_gradient import curved_laminate

from knittest.kernels.shell import drill
from knittest.kernels.shell_blocks import gather_shells, shell_forces
from knittest.kernels.shell_output import shell_energies
from knittest.kernels.shell_state import build_shells

POINTS = np.array([[0.0, 0, 0], [4, 0.5, 0.3], [8.5, 0, 0], [0.3, 3.6, 0.2], [4.4, 4, -0.2], [8, 4.4, 0.4]])
CONN = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])


class PlainSolid(Solid):
    """:class:`Solid` on the Python functions of the kernels."""

    def forces(self, time: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Forces [N] and moments [N mm] of the shells on the nodes, (n, 3) each."""
        self.nodes.force[:], self.nodes.moment[:] = 0.0, 0.0
        plain(shell_forces)(0, self.blocks, time, self.nodes, self.shells, self.laminate, self.scratch)
        plain(gather_shells)(0, self.n, self.nodes, self.shells)
        return self.nodes.force[:, : self.n].T.copy(), self.nodes.moment[:, : self.n].T.copy()

    def energy(self) -> float:
        """Elastic energy with that of the hourglass control [mJ]."""
        return sum(plain(shell_energies)(self.nodes, self.shells, self.laminate))


#: without and with Poisson coupling
COUPLINGS = ({}, {"coupling_membrane": 150.0, "coupling_bending": 2.0})


def deformed(**coupling: float) -> tuple[PlainSolid, np.ndarray, np.ndarray]:
    """Two leaning, warped shells: stretched, sheared and folded against each other, with directors of their own."""
    card = curved_laminate()._replace(**coupling)
    solid = PlainSolid(POINTS, build_shells(POINTS, CONN, np.array([0.8, 0.6, 0.1])), card)
    rng = np.random.default_rng(2)
    shift = POINTS @ np.array([[0.05, 0.0, 0.0], [0.2, 0.03, 0.0], [0.1, 0.2, 0.0]]) + rng.normal(0.0, 0.2, (6, 3))
    turn = rng.normal(0.0, 0.3, (6, 3))
    solid.place(shift, turn)
    return solid, shift, turn


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_forces_are_the_gradient_of_the_energy(coupling):
    """f = -dU/dx, m = -dU/d(rotation) by central differences: error of the order h^2."""
    solid, _, _ = deformed(**coupling)
    force, moment = solid.forces()
    expected_force, expected_moment = descents(solid)
    assert force == pytest.approx(expected_force, abs=1e-7 * np.abs(force).max())
    assert moment == pytest.approx(expected_moment, abs=1e-6 * np.abs(moment).max())


def test_a_stretch_does_not_drill():
    """(b . R a0 - a . R b0) / 2 is 0 for F = R U, and -s sin(t) for a corner that stays while fibres of mean stretch s
    turn by t.
    """
    stretch = np.array([[1.1, 0.4, 0.0], [0.4, 0.9, 0.0], [0.0, 0.0, 1.0]])
    turn = Rotation.from_rotvec([0.3, -0.8, 1.9])
    a, b = (tuple(turn.apply(stretch @ e)) for e in np.eye(3)[:2])
    warp, normal = tuple(turn.apply([1.0, 0.0, 0.0])), tuple(turn.apply([0.0, 0.0, 1.0]))
    found, weft = plain(drill)(a, b, warp, normal)
    assert found == pytest.approx(0.0, abs=1e-15)
    assert weft == pytest.approx(turn.apply([0.0, 1.0, 0.0]))
    spun = Rotation.from_rotvec([0.0, 0.0, 0.2])
    a, b = (tuple(spun.apply(stretch @ e)) for e in np.eye(3)[:2])
    found, _ = plain(drill)(a, b, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert found == pytest.approx(-np.sin(0.2))


def test_a_corner_that_spins_is_held():
    """All corners of a square turned by t about its normal: torque beta S A sin t cos t / 4 of each, and their forces
    answer it.
    """
    square, angle = 3.0 * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), 0.1
    spun = np.tile([0.0, 0.0, angle], (4, 1))
    solid = PlainSolid(square, build_shells(square, np.array([[0, 1, 2, 3]]), X), linear_laminate(drilling=0.8))
    solid.place(np.zeros((4, 3)), spun)
    force, moment = solid.forces()
    assert moment == pytest.approx(np.tile([0.0, 0.0, -0.25 * 0.8 * 9.0 * np.sin(angle) * np.cos(angle)], (4, 1)))
    assert np.cross(square, force).sum(axis=0) == pytest.approx(-moment.sum(axis=0))
    *internal, control = plain(shell_energies)(solid.nodes, solid.shells, solid.laminate)
    assert (sum(internal), control) == (0.0, pytest.approx(0.5 * 0.8 * 9.0 * np.sin(angle) ** 2))
    torn = PlainSolid(square, solid.shells, linear_laminate(drilling=0.8, fail_strain=np.full(2, 0.01)))
    torn.place(0.05 * square, spun)
    assert all((v == 0.0).all() for v in torn.forces())  # a deleted shell does not drill


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_forces_balance(coupling):
    """Internal forces add no momentum and no angular momentum (round-off)."""
    solid, shift, _ = deformed(**coupling)
    force, moment = solid.forces()
    total = np.cross(POINTS + shift, force) + moment
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).sum()
    assert np.abs(total.sum(axis=0)).max() < 1e-12 * np.abs(force).sum() * 10.0


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_a_rigid_turn_turns_the_forces(coupling):
    """Forces are objective: they turn with the shells, and the energy stays."""
    solid, _, _ = deformed(**coupling)
    energy, (force, moment) = solid.energy(), solid.forces()
    vector = np.array([[0.9, 1.2, 2.0]])
    turned = Rotation.from_rotvec(vector[0]).apply
    solid.nodes.position[:, : solid.n] = turned(solid.nodes.position[:, : solid.n].T).T
    for i in range(solid.n):
        solid.nodes.rotation[:, i] = product(quaternion(vector)[0], solid.nodes.rotation[:, i].copy())
    found, couple = solid.forces()
    assert solid.energy() == pytest.approx(energy, rel=1e-12)
    assert found == pytest.approx(turned(force), abs=1e-11 * np.abs(force).max())
    assert couple == pytest.approx(turned(moment), abs=1e-11 * np.abs(moment).max())
