"""Sums over all nodes that are made side by side: those of numpy at any number of nodes, also of the last few."""

import numpy as np
import pytest

from knittest.kernels import monitor, search
from knittest.kernels.loads import SCRATCH, apply_loads, book_loads
from knittest.kernels.state import Loads, Nodes, Tables, Tally
from knittest.kernels.vec import LANE_SUMS, PARTITIONS

SIZES = (1, LANE_SUMS - 1, LANE_SUMS, 2 * LANE_SUMS + 5)
DT, BEFORE, NOW = 0.5, 1.0, 3.0


def random_nodes(n: int) -> Nodes:
    rng = np.random.default_rng(n)
    shapes = {"rotation": (4, n + 1), "inv_mass": (n + 1,), "inv_inertia": (n + 1,), "damping_factor": (n + 1,)}
    return Nodes(*(rng.uniform(0.5, 1.0, shapes.get(name, (3, n + 1))) for name in Nodes._fields))


def tally() -> Tally:
    return Tally(
        np.zeros((PARTITIONS, 1)), np.zeros((PARTITIONS, 9)), np.zeros((PARTITIONS, 0, 3)), np.zeros((0, 3)),
        np.zeros((PARTITIONS, 1)), np.zeros(1),
    )  # fmt: skip


def one_load(n: int, guides: int) -> tuple[Loads, Tables]:
    start = np.ones(PARTITIONS + 1, np.int64)
    start[0] = 0
    one = np.ones(1, np.int64)
    loads = Loads(start, 0 * one, n * one, 0 * one, one, 0 * one, guides * one, np.linspace(-1.0, 2.0, n))
    return loads, Tables(one, np.zeros((1, 1)), np.zeros((1, 1)), np.array([[BEFORE], [NOW]]))


@pytest.mark.parametrize("n", SIZES)
def test_kinetic_energy_and_what_damping_takes(n):
    nodes, mass, inertia = random_nodes(n), np.linspace(1.0, 2.0, n), np.linspace(0.1, 0.2, n)
    found = monitor.kinetic_energy(nodes, mass, inertia, DT)
    v, f, spin, chi = (a[..., :n] for a in (nodes.velocity, nodes.force, nodes.spin, nodes.damping_factor))
    moving = mass * v * (v - DT * nodes.inv_mass[:n] * f) / chi + inertia * spin**2
    assert found == pytest.approx((0.5 * moving.sum(), 0.5 * ((1.0 - chi**2) * moving).sum()), rel=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_nodes_that_moved_and_the_fastest_of_all(n):
    nodes, moved = random_nodes(n), np.zeros(n, np.bool_)
    nodes.velocity[:, n - 1] = 4.0  # the last node is in the last, shorter block
    since = nodes.position[:, :n] - 0.3 * np.linspace(0.0, 1.0, n)
    count, fastest = search.flag_moved(nodes, since, 0.1, 0.5, moved)
    speed = np.linalg.norm(nodes.velocity[:, :n], axis=0)
    reached = np.linalg.norm(nodes.position[:, :n] - since, axis=0) + 0.1 * speed
    assert fastest == pytest.approx(4.0 * np.sqrt(3.0), rel=1e-15)
    assert count == np.count_nonzero(reached >= 0.5)
    np.testing.assert_array_equal(moved, reached >= 0.5 * search.SOON)


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("guides", [0, 1])
def test_work_of_loads_and_of_damping_towards_a_guide(n, guides):
    """Half of it before the step, half after; a guide does m du/dt and m (1 - f) u / dt."""
    nodes, (loads, tables), book, w = random_nodes(n), one_load(n, guides), tally(), np.zeros(SCRATCH)
    rate, force = nodes.velocity[1, :n].copy(), nodes.force[1, :n].copy()
    factor, gain, damped = 0.5 * (BEFORE + NOW), (NOW - BEFORE) / DT, 1.0 - nodes.damping_factor[:n]
    apply_loads(0, DT, nodes, loads, tables, book, w)
    added = loads.value * (factor * damped / DT + gain if guides else factor)
    assert nodes.force[1, :n] - force == pytest.approx(added, rel=1e-12)
    nodes.velocity[1, :n] *= 3.0
    book_loads(0, DT, nodes, loads, tables, book, w)
    work = 4.0 * 0.5 * DT * ((gain if guides else factor) * loads.value @ rate)
    given = 4.0 * 0.5 * factor * (loads.value * damped) @ rate if guides else 0.0
    assert book.energy[0, 0] == pytest.approx(work, rel=1e-12)
    assert book.energy[0, 8] == pytest.approx(given, rel=1e-12)
