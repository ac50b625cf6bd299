"""Forces of the beam against its energy, in plain Python: gradients, balance, objectivity. No compiling."""

import numpy as np
import pytest
from contact_cases import derivative
from plain import plain

from knittest.kernels import beam
from knittest.kernels.beam import AX, AY, AZ, BX, BY, BZ, FX, FY, FZ, SCRATCH, advance_beams, beam_energy
from knittest.kernels.state import Beams, Nodes

N = 4  # nodes of the chain
STIFFNESS = np.array([[900.0, 300.0, 40.0, 70.0]])  # compressive EA, GA [N], GJ, EI [N mm2]


def rotated(quaternion: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """The rotation ``quaternion`` followed by the rotation vector ``vector`` [rad]."""
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0.0 else vector
    w, v = np.cos(0.5 * angle), np.sin(0.5 * angle) * axis
    qw, q = quaternion[0], quaternion[1:]
    return np.concatenate([[w * qw - v @ q], w * q + qw * v + np.cross(v, q)])


def across(chord: np.ndarray) -> np.ndarray:
    """A unit vector across ``chord``."""
    found = np.cross(chord, [0.3, -0.5, 0.8])
    return found / np.linalg.norm(found)


class Chain:
    """Three beams, bent in space by large turns."""

    def __init__(self, seed: int = 5, excess: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        start = np.cumsum(rng.normal([1.0, 0.2, -0.1], 0.3, (N, 3)), axis=0)
        chord = np.diff(start, axis=0, append=start[-1:] + np.array([[1.0, 0.0, 0.0]]))
        length = np.linalg.norm(chord, axis=1)
        self.beams = Beams(
            tangent=(chord / length[:, None]).T.copy(), inv_length=1.0 / length,
            alive=np.array([1.0, 1.0, 1.0, 0.0]), fail_strain=np.full(N, 10.0),
            slack=np.array([0.01, 0.0, 0.02, 0.0]), fail_time=np.full(N, np.inf), stiffness=STIFFNESS,
            hinge_strain=np.array([[0.0, 0.02]]), hinge_slope=np.array([[500.0, 800.0]]),
            excess=np.array([excess]), normal=np.array([across(c) for c in chord]).T.copy(),
        )  # fmt: skip
        turn = rng.normal(0.0, 0.6, (N, 3))
        rotation = np.array([rotated(np.array([1.0, 0.0, 0.0, 0.0]), t) for t in turn]).T.copy()
        position = (start + rng.normal(0.0, 0.2, (N, 3))).T.copy()
        vectors = [np.zeros((3, N + 1)) for _ in range(4)]
        pad = np.zeros((3, 1)), np.array([[1.0], [0.0], [0.0], [0.0]])
        self.nodes = Nodes(
            np.hstack([position, pad[0]]), np.hstack([rotation, pad[1]]), *vectors,
            np.ones(N + 1), np.ones(N + 1), np.ones(N + 1),
        )  # fmt: skip

    def energy(self) -> float:
        """Elastic energy [mJ] of the living beams."""
        return sum(plain(beam_energy)(i, 0, self.nodes, self.beams) for i in range(N - 1))

    def forces(self) -> tuple[np.ndarray, np.ndarray]:
        """Force [N] and moment [N mm] on each node, (N, 3)."""
        w = np.zeros(SCRATCH)
        plain(beam._more_hinges)(0, N, self.nodes, self.beams, 0, w)
        assert plain(beam._forces)(0, N, self.nodes, self.beams, 0, w) == 0.0
        plain(beam._flat_moments)(0, N, self.nodes, self.beams, self.beams.excess[0], w)
        k = np.arange(N)
        force = [w[int(row) + k + 1] - w[int(row) + k] for row in (FX, FY, FZ)]
        moment = [w[int(a) + k + 1] - w[int(b) + k] for a, b in zip((AX, AY, AZ), (BX, BY, BZ), strict=True)]
        return np.array(force).T, np.array(moment).T


@pytest.mark.parametrize("excess", [0.0, -45.0, 600.0])
def test_forces_are_the_gradient_of_the_energy(excess):
    """f = -dU/dx, m = -dU/d(rotation) by central differences: error of the order h^2. Round sections and flat ones."""
    chain, h = Chain(excess=excess), 1e-5
    force, moment = chain.forces()
    for i in range(N):
        for axis in range(3):
            found = -derivative(chain.energy, chain.nodes.position, (axis, i), h)
            assert found == pytest.approx(force[i, axis], abs=1e-7 * np.abs(force).max())
            before, found = chain.nodes.rotation[:, i].copy(), []
            for step in (h, -h):
                chain.nodes.rotation[:, i] = rotated(before, step * np.eye(3)[axis])
                found.append(chain.energy())
            chain.nodes.rotation[:, i] = before
            assert -(found[0] - found[1]) / (2.0 * h) == pytest.approx(moment[i, axis], abs=1e-7 * np.abs(moment).max())


@pytest.mark.parametrize("excess", [0.0, 600.0])
def test_forces_balance(excess):
    """Action is reaction, and the couples balance the forces' moments (round-off)."""
    chain = Chain(7, excess)
    force, moment = chain.forces()
    position = chain.nodes.position[:, :N].T
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    assert np.abs((np.cross(position, force) + moment).sum(axis=0)).max() < 1e-12 * np.abs(moment).max() * N


@pytest.mark.parametrize(("angle", "excess"), [(0.4, 0.0), (2.5, 0.0), (2.5, 600.0)])
def test_a_rigid_turn_turns_the_forces(angle, excess):
    """Forces are objective: they turn with the chain, and its energy stays."""
    chain = Chain(excess=excess)
    energy, (force, moment) = chain.energy(), chain.forces()
    vector = angle * np.array([0.36, 0.48, 0.8])
    turn = np.array([rotated_vector(vector, e) for e in np.eye(3)]).T
    chain.nodes.position[:, :N] = turn @ chain.nodes.position[:, :N] + np.array([[3.0], [-7.0], [11.0]])
    for i in range(N):
        chain.nodes.rotation[:, i] = rotated(chain.nodes.rotation[:, i], vector)
    found, couple = chain.forces()
    assert chain.energy() == pytest.approx(energy, rel=1e-12)
    assert found == pytest.approx(force @ turn.T, abs=1e-11 * np.abs(force).max())
    assert couple == pytest.approx(moment @ turn.T, abs=1e-11 * np.abs(moment).max())


def rotated_vector(vector: np.ndarray, v: np.ndarray) -> np.ndarray:
    """``v`` turned by the rotation vector ``vector`` (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    k = vector / angle
    return v * np.cos(angle) + np.cross(k, v) * np.sin(angle) + k * (k @ v) * (1.0 - np.cos(angle))


def test_tension_is_the_table():
    """A straight beam pulled by 5 %: EA of two hinges less the slack, and nothing across."""
    chain = Chain()
    chain.nodes.rotation[:] = np.array([[1.0], [0.0], [0.0], [0.0]])
    chord = chain.beams.tangent[:, 0] / chain.beams.inv_length[0]
    chain.nodes.position[:, 1] = chain.nodes.position[:, 0] + 1.05 * chord
    chain.beams.alive[1:] = 0.0
    force, moment = chain.forces()
    assert force[0] == pytest.approx((500.0 * 0.04 + 800.0 * 0.02) * chain.beams.tangent[:, 0], abs=1e-9)
    assert np.abs(moment).max() < 1e-12


def test_a_beam_beyond_its_strain_fails_once_and_pulls_no_more():
    """Stamped with the time, its energy given up; what failed before or is no beam does not fail again."""
    chain = Chain()
    chain.beams.fail_time[3] = np.nan
    energy = plain(beam_energy)(2, 0, chain.nodes, chain.beams)
    chain.beams.fail_strain[2] = -10.0
    step = (0, N, 0, 2.5, 1e-12, chain.nodes, chain.beams, np.zeros(SCRATCH))
    assert plain(advance_beams)(*step) == pytest.approx(energy, rel=1e-9)
    assert list(chain.beams.alive) == [1.0, 1.0, 0.0, 0.0] and chain.beams.fail_time[2] == 2.5
    assert np.isinf(chain.beams.fail_time[:2]).all()
    assert plain(advance_beams)(*step) == 0.0
    assert chain.forces()[0][3] == pytest.approx(np.zeros(3))  # the free end of the chain


@pytest.mark.parametrize(("about", "stiffness"), [("normal", 670.0), ("binormal", 70.0), ("tangent", 40.0)])
def test_a_flat_section_bends_with_the_stiffness_of_each_axis(about, stiffness):
    """Moment EI phi / L about the normal, the other EI about the binormal, GJ about the axis; small turns."""
    chain = Chain(excess=600.0)
    tangent, normal = chain.beams.tangent[:, 0], chain.beams.normal[:, 0]
    axis = {"normal": normal, "binormal": np.cross(tangent, normal), "tangent": tangent}[about]
    chain.nodes.rotation[:] = np.array([[1.0], [0.0], [0.0], [0.0]])
    half = 0.5e-4 * axis
    for node, turn in enumerate((-half, half)):
        chain.nodes.rotation[:, node] = rotated(chain.nodes.rotation[:, node], turn)
    chain.nodes.position[:, 1] = chain.nodes.position[:, 0] + tangent / chain.beams.inv_length[0]
    chain.beams.alive[1:] = 0.0
    _, moment = chain.forces()
    assert moment[0] == pytest.approx(stiffness * 1e-4 * chain.beams.inv_length[0] * axis, abs=1e-8)
    energy = plain(beam_energy)(0, 0, chain.nodes, chain.beams)
    assert energy == pytest.approx(0.5 * stiffness * 1e-8 * chain.beams.inv_length[0], rel=1e-6)
