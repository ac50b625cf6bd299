"""Loads on single nodes in runs of neighbours: every load acts once, on its node, with its table, in its partition."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.kernels.loads import SCRATCH, apply_loads, book_loads
from knittest.kernels.vec import PARTITIONS, read_tables
from knittest.laboratory.base import fabric_laminate
from knittest.models.boundary import Boundary, new_tally
from knittest.models.macro import build_sheet, rectangle
from knittest.models.tool import constant


def test_loads_in_runs_are_the_loads_given():
    laminate = fabric_laminate(resolve(variant="1", scale="macro", test="forming", preset="quick"))
    points, cells = rectangle(np.linspace(0.0, 60.0, 11), 60.0, 6.0)
    model = build_sheet(points, cells, laminate, 1e-3, 2.0)
    boundary, rng = Boundary(model, 1e-3), np.random.default_rng(4)
    n = model.n_nodes
    expected = np.zeros((6, n))
    for dof, name in enumerate(("x", "y", "z", "rx", "ry", "rz")):
        for factor, nodes in ((2.0, np.arange(n)), (-0.5, rng.choice(n, 40, replace=False)), (3.0, np.array([7, 7]))):
            value = rng.normal(size=len(nodes))
            boundary.load(nodes, name, value, constant(factor))
            np.add.at(expected[dof], nodes, factor * value)
    drive, tally = boundary.drive(), new_tally(boundary)
    read_tables(drive.tables, 0.0, 1.0)
    model.nodes.velocity[:], model.nodes.spin[:], model.nodes.damping_factor[:] = 1.0, 0.0, 0.8
    for p in range(PARTITIONS):
        apply_loads(p, 1.0, model.nodes, drive.loads, drive.tables, tally, np.zeros(SCRATCH))
    moment = 0.8 * model.nodes.spin[:, :n] / model.nodes.inv_inertia[:n]
    np.testing.assert_allclose(model.nodes.force[:, :n], expected[:3], atol=1e-12)
    np.testing.assert_allclose(moment, expected[3:], atol=1e-12)
    assert len(drive.loads.node) < len(drive.loads.value)


@pytest.mark.parametrize("split", [40, 47])
def test_a_run_ends_with_its_table_and_with_its_partition(split):
    """All nodes along one axis: each half has a table of its own, and neighbours are in different partitions."""
    laminate = fabric_laminate(resolve(variant="1", scale="macro", test="forming", preset="quick"))
    points, cells = rectangle(np.linspace(0.0, 60.0, 11), 60.0, 6.0)
    model = build_sheet(points, cells, laminate, 1e-3, 2.0)
    boundary, n = Boundary(model, 1e-3), model.n_nodes
    boundary.load(np.arange(split), "z", np.ones(split), constant(2.0))
    boundary.load(np.arange(split, n), "z", np.ones(n - split), constant(-3.0))
    drive, tally = boundary.drive(), new_tally(boundary)
    read_tables(drive.tables, 0.0, 1.0)
    model.nodes.velocity[2] = 1.0
    for p in range(PARTITIONS):
        before = model.nodes.force[2, :n].copy()
        apply_loads(p, 1.0, model.nodes, drive.loads, drive.tables, tally, np.zeros(SCRATCH))
        loaded = np.flatnonzero(model.nodes.force[2, :n] != before)
        assert loaded.tolist() == list(range(model.parts.node[p], model.parts.node[p + 1]))
    given = np.where(np.arange(n) < split, 2.0, -3.0)
    assert model.nodes.force[2, :n] == pytest.approx(given)
    assert tally.energy[:, 0].sum() == pytest.approx(0.5 * given.sum()), "half of the work before the step"
    model.nodes.velocity[2] = 3.0
    for p in range(PARTITIONS):
        book_loads(p, 1.0, model.nodes, drive.loads, drive.tables, tally, np.zeros(SCRATCH))
    assert tally.energy[:, 0].sum() == pytest.approx(2.0 * given.sum()), "and half after it"
