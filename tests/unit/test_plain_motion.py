"""Motions along and about axes of one's own, in plain Python: what they change, reactions and work. No compiling."""

import numpy as np
import pytest
from plain import plain

from knittest.kernels.beam import quaternion_step
from knittest.kernels.loads import impose_motions
from knittest.kernels.state import ABOUT, ALONG, Motions, Nodes, Tables, Tally
from knittest.kernels.vec import PARTITIONS

AXIS, DT, RATE = np.array([2.0, -1.0, 2.0]) / 3.0, 0.01, 0.7
FREE = np.array([0.3, 0.5, -0.2])


def node(inverse: float) -> Nodes:
    """One node that has moved and turned freely by ``FREE`` in this step, under a force and a moment."""
    still, given = np.zeros((3, 2)), np.column_stack([FREE, FREE])
    rotation = np.tile(np.array([[0.8], [0.0], [0.6], [0.0]]), 2)
    force = np.column_stack([[4.0, 1.0, -2.0]] * 2)
    inverses = np.full(2, inverse)
    return Nodes(
        still + DT * given, rotation, given.copy(), given.copy(), force, force.copy(), inverses, inverses, np.ones(2)
    )


def impose(nodes: Nodes, dof: int, scale: float = 2.0) -> Tally:
    """Drive the node along or about the axis at 2 x 0.35; before it was at 2 x 0.25."""
    one, start = np.zeros(1, np.int64), np.append(0, np.ones(PARTITIONS, np.int64))
    motions = Motions(start, one, np.array([dof]), one, np.array([scale]), one, AXIS[None])
    tables = Tables(np.ones(1, np.int64), np.zeros((1, 1)), np.zeros((1, 1)), np.array([[0.25], [0.35]]))
    sums = np.zeros((PARTITIONS, 1))
    tools = np.zeros((PARTITIONS, 0, 3)), np.zeros((0, 3))
    tally = Tally(sums, np.zeros((PARTITIONS, 9)), *tools, sums.copy(), np.zeros(1))
    plain(impose_motions)(0, DT, nodes, motions, tables, tally)
    return tally


def test_a_node_is_guided_along_its_axis():
    """Only the velocity along the axis changes, by an impulse; work is that of the mean speed."""
    nodes = node(0.5)
    tally = impose(nodes, ALONG)
    velocity = FREE + (RATE - FREE @ AXIS) * AXIS
    reaction = 2.0 * (RATE - FREE @ AXIS) / DT
    assert nodes.velocity[:, 0] == pytest.approx(velocity)
    assert nodes.position[:, 0] == pytest.approx(DT * velocity)
    assert nodes.force[:, 0] == pytest.approx(np.array([4.0, 1.0, -2.0]) + reaction * AXIS)
    assert nodes.spin[:, 0].tolist() == FREE.tolist()
    assert (tally.support[0, 0], tally.reaction[0, 0]) == pytest.approx((reaction, 2.0 * reaction))
    assert tally.energy[0, 0] == pytest.approx(reaction * 0.6 * DT)


def test_a_node_is_turned_about_its_axis():
    """Only the spin about the axis changes, and the turn of this step is done anew with it."""
    nodes = node(0.5)
    half = 0.5 * DT
    before = plain(quaternion_step)(0.8, 0.0, 0.6, 0.0, *(-half * FREE))
    tally = impose(nodes, ABOUT)
    spin = FREE + (RATE - FREE @ AXIS) * AXIS
    assert nodes.spin[:, 0] == pytest.approx(spin)
    assert nodes.rotation[:, 0] == pytest.approx(plain(quaternion_step)(*before, *(half * spin)))
    assert nodes.velocity[:, 0].tolist() == FREE.tolist()
    assert tally.support[0, 0] == pytest.approx(2.0 * (RATE - FREE @ AXIS) / DT)


@pytest.mark.parametrize("dof", [ALONG, ABOUT])
def test_a_clamped_node_bears_what_acts_on_it(dof):
    """Without mass the reaction is that part of the force, or moment, which lies along the axis."""
    tally = impose(node(0.0), dof)
    assert tally.support[0, 0] == pytest.approx(-np.array([4.0, 1.0, -2.0]) @ AXIS)
