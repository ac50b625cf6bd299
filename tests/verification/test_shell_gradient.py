"""Shell forces against the energy they come from, and conservation laws. Analytic references only."""

import numpy as np
import pytest
from shell_cases import PATCH, PATCH_CONN, Solid, X, linear_laminate, product, quaternion, wavy

from knittest.kernels.in_plane import no_bends
from knittest.kernels.shell_blocks import gather_shells, shell_forces
from knittest.kernels.shell_output import shell_energies
from knittest.kernels.shell_state import SCRATCH, build_shells
from knittest.models.macro import lump


def curved_laminate():
    """Stiffening tension, softening shear table: every branch of the law is in use."""
    return linear_laminate(
        knee=np.array([[0.0, 0.01, 0.05], [0.0, 0.02, 0.03]]),
        slope=np.array([[300.0, 200.0, 400.0], [100.0, 150.0, 350.0]]), compression=np.array([20.0, 30.0]),
        shear_knee=np.array([0.0, 0.05, 0.2]), shear_slope=np.array([0.5, 1.0, -0.4]),
    )  # fmt: skip


@pytest.mark.parametrize("angle", [0.3, 1.5, 3.0, 6.0])
def test_rigid_rotation_costs_nothing(angle):
    """A finite rotation of a warped mesh causes no force (round-off of 900 N/mm x 5 mm)."""
    position, conn = wavy()
    solid = Solid(position, build_shells(position, conn, X), linear_laminate())
    vector = angle * np.array([0.36, 0.48, 0.8])
    w, xyz = np.cos(0.5 * angle), np.sin(0.5 * angle) * vector / angle
    turned = position + 2.0 * w * np.cross(xyz, position) + 2.0 * np.cross(xyz, np.cross(xyz, position))
    solid.place(turned - position + np.array([3.0, -7.0, 11.0]), np.tile(vector, (solid.n, 1)))
    force, moment = solid.forces()
    assert max(np.abs(force).max(), np.abs(moment).max()) < 1e-9
    assert solid.energy() < 1e-12


def test_free_flight_conserves_energy_and_momentum():
    """Central differences: energy oscillates by O(dt^2), momentum and angular momentum stay to round-off."""
    drift = [free_flight(share)[0] for share in (0.4, 0.2)]
    assert drift[0] < 0.02
    assert drift[0] / drift[1] == pytest.approx(4.0, rel=0.3)
    _, momentum, spin = free_flight(0.4)
    assert momentum < 1e-12
    assert spin < 1e-3  # the leapfrog samples spin and position half a step apart


def free_flight(share: float) -> tuple[float, float, float]:
    """Largest relative energy change and momentum drifts of a patch thrown with random velocities."""
    laminate = linear_laminate()
    solid = Solid(PATCH, build_shells(PATCH, PATCH_CONN, X), laminate)
    mass, inertia, step = lump(laminate, PATCH, PATCH_CONN, solid.shells, 824.2e-6, 2.22, no_bends())
    dt = share * step
    rng = np.random.default_rng(4)
    v, w = rng.normal(0.0, 2.0, PATCH.shape), rng.normal(0.0, 0.2, PATCH.shape)
    x, q = PATCH.copy(), np.tile([1.0, 0.0, 0.0, 0.0], (len(PATCH), 1))
    totals = []
    force, moment = solid.forces()
    for _ in range(int(0.1 / dt)):
        half_v, half_w = v + 0.5 * dt * force / mass[:, None], w + 0.5 * dt * moment / inertia[:, None]
        x = x + dt * half_v
        q = np.array([product(a, b) for a, b in zip(quaternion(dt * half_w), q, strict=True)])
        solid.nodes.position[:, : solid.n], solid.nodes.rotation[:, : solid.n] = x.T, q.T
        force, moment = solid.forces()
        v, w = half_v + 0.5 * dt * force / mass[:, None], half_w + 0.5 * dt * moment / inertia[:, None]
        kinetic = 0.5 * float(mass @ (v**2).sum(axis=1) + inertia @ (w**2).sum(axis=1))
        spin = (mass[:, None] * np.cross(x, v) + inertia[:, None] * w).sum(axis=0)
        totals.append([kinetic + solid.energy(), *(mass @ v), *spin])
    change = np.abs(np.array(totals) - totals[0]).max(axis=0)
    size = np.abs(totals[0])
    return change[0] / size[0], change[1:4].max() / (mass.sum() * 2.0), change[4:].max() / size[4:].max()


def test_bits_do_not_depend_on_the_split():
    """Blocks one by one in reverse and nodes in pieces give the same bits as in one call."""
    position, conn = wavy()
    conn = np.tile(conn, (20, 1))  # 240 elements on the same nodes: four blocks and long sums
    shells, laminate = build_shells(position, conn, X), linear_laminate()
    solid = Solid(position, shells, laminate)
    solid.place(np.random.default_rng(3).normal(0.0, 0.2, position.shape))
    force, moment = solid.forces()
    solid.nodes.force[:], solid.nodes.moment[:], shells.corner[:] = 0.0, 0.0, 0.0
    for block in reversed(range(solid.blocks)):
        shell_forces(block, block + 1, 0.0, solid.nodes, shells, laminate, np.full(SCRATCH, np.nan))
    for start in range(0, solid.n, 7):
        gather_shells(start, min(start + 7, solid.n), solid.nodes, shells)
    assert np.array_equal(solid.nodes.force[:, : solid.n].T, force)
    assert np.array_equal(solid.nodes.moment[:, : solid.n].T, moment)


def test_dead_shells_carry_nothing_and_their_energy_is_returned():
    """Deletion returns exactly the energy the element held; its copy in the padding never counts."""
    position, conn = wavy()
    laminate = linear_laminate(fail_strain=np.array([0.02, np.inf]))
    solid = Solid(position, build_shells(position, conn, X), laminate)
    stretch = np.zeros_like(position)
    stretch[:, 0] = np.where(position[:, 0] > 12.0, 0.3, 0.0) * (position[:, 0] - 12.0) / 8.0
    solid.place(stretch)
    before = solid.energy()
    force, _ = solid.forces(time=1.25)
    dead = solid.shells.fail_time[: len(conn)] == 1.25
    assert 0 < dead.sum() < len(conn)
    assert before == pytest.approx(solid.eroded + sum(shell_energies(solid.nodes, solid.shells, laminate)), rel=1e-12)
    assert solid.eroded > 0.0
    only_dead = np.setdiff1d(conn[dead], conn[~dead])
    assert only_dead.size and not force[only_dead].any()
    solid.place(np.zeros_like(position))
    solid.forces(time=2.0)
    assert np.array_equal(solid.shells.fail_time[: len(conn)] == 1.25, dead)  # dead stays dead, stamped once
