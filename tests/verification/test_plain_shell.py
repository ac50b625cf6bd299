"""Forces of the shells against their energy, in plain Python: gradients, balance, objectivity. No compiling."""

import numpy as np
import pytest
from plain import plain
from shell_cases import Solid, product, quaternion
from test_shell_gradient import curved_laminate

from knittest.kernels.shell_arrays import build_shells
from knittest.kernels.shell_blocks import gather_shells, shell_forces
from knittest.kernels.shell_output import shell_energies

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
    h = 1e-5
    for i in range(solid.n):
        for axis in range(3):
            found = []
            for step in (h, -h):
                solid.nodes.position[axis, i] += step
                found.append(solid.energy())
                solid.nodes.position[axis, i] -= step
            assert -(found[0] - found[1]) / (2.0 * h) == pytest.approx(force[i, axis], abs=1e-7 * np.abs(force).max())
            before, found = solid.nodes.rotation[:, i].copy(), []
            for step in (h, -h):
                solid.nodes.rotation[:, i] = product(quaternion(step * np.eye(3)[axis : axis + 1])[0], before)
                found.append(solid.energy())
            solid.nodes.rotation[:, i] = before
            assert -(found[0] - found[1]) / (2.0 * h) == pytest.approx(moment[i, axis], abs=1e-6 * np.abs(moment).max())


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
    w, axis = quaternion(vector)[0][0], quaternion(vector)[0][1:]
    x = solid.nodes.position[:, : solid.n].T

    def turned(v: np.ndarray) -> np.ndarray:
        return v + 2.0 * w * np.cross(axis, v) + 2.0 * np.cross(axis, np.cross(axis, v))

    solid.nodes.position[:, : solid.n] = turned(x).T
    for i in range(solid.n):
        solid.nodes.rotation[:, i] = product(quaternion(vector)[0], solid.nodes.rotation[:, i].copy())
    found, couple = solid.forces()
    assert solid.energy() == pytest.approx(energy, rel=1e-12)
    assert found == pytest.approx(turned(force), abs=1e-11 * np.abs(force).max())
    assert couple == pytest.approx(turned(moment), abs=1e-11 * np.abs(moment).max())
