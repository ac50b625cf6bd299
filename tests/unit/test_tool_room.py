"""Blocks of nodes that a tool cannot reach are passed over, and looked at in time. No compiling."""

import numpy as np
import pytest
from contact_cases import nodes_at
from plain import plain

from knittest.kernels.state import Tally, ToolContactState, Tools
from knittest.kernels.tool_contact import BLOCK, SCRATCH, block_of, n_blocks, touch_tools
from knittest.kernels.vec import PARTITIONS
from knittest.models.tool import plane, tool_arrays

N, DT, RADIUS = 5, 1e-2, 0.4


class Fall:
    """Five nodes that fall at different speeds, times ``speed``, on a plane that comes to meet them."""

    def __init__(self, speed: float = 1.0) -> None:
        self.nodes = nodes_at(np.zeros((3, N + 1)))
        self.nodes.position[:, :N] = np.random.default_rng(3).normal(0.0, 1.0, (3, N))
        self.nodes.position[2, :N] = 1.0 + 0.3 * np.arange(N)
        self.nodes.velocity[0], self.nodes.velocity[2, :N] = 0.7, -0.5 - 0.2 * np.arange(N)
        self.nodes.velocity[:] *= speed
        self.tools: Tools = tool_arrays([plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))])
        self.tools.velocity[0] = (0.0, 0.1, 0.6)
        flat = [np.zeros((1, N)) for _ in range(2)]
        blocks = (1, n_blocks(N))
        self.touch = ToolContactState(
            np.full(N, RADIUS), np.full(N, 10.0), np.zeros(N), np.zeros((1, 3, N)), *flat, np.zeros(blocks),
            np.zeros((1, N), np.int32), np.zeros(blocks, np.int64),
        )  # fmt: skip
        self.tally = Tally(
            np.zeros((PARTITIONS, 1)), np.zeros((PARTITIONS, 9)), np.zeros((PARTITIONS, 1, 3)), np.zeros((1, 3)),
            np.zeros((PARTITIONS, 1)), np.zeros(1),
        )  # fmt: skip

    def step(self) -> np.ndarray:
        """Forces of the plane; then all move on."""
        self.nodes.force[:] = 0.0
        plain(touch_tools)(0, 0, N, DT, self.nodes, self.tools, self.touch, self.tally, np.zeros(SCRATCH))
        self.nodes.position[:] += DT * self.nodes.velocity
        self.tools.position[:] += DT * self.tools.velocity
        return self.nodes.force.copy()


@pytest.mark.parametrize("speed", [1.0, 0.0])
def test_forces_are_those_of_looking_at_every_step(speed):
    patient, restless = Fall(speed), Fall(speed)
    waited, touched, some = 0, 0, 0
    for _ in range(200):
        restless.touch.room[:] = 0.0
        waited += patient.touch.room[0, 0] > 0.0
        force = restless.step()
        assert np.array_equal(patient.step(), force)
        touched += force[2].any()
        some += force[2].any() and patient.touch.room[0, 0] > 0.0 and patient.touch.near_count[0, 0] < N
    assert waited > 20 and touched > 50
    assert some > 10 or speed == 0.0  # not all are looked at where some touch


def test_nodes_that_touch_within_20_steps_are_listed():
    fall = Fall()
    fall.nodes.position[2, :N] = 3.0
    fall.nodes.position[2, 0] = RADIUS + 10.0 * DT * (0.5 + 0.6)  # ten steps off
    fall.step()
    assert fall.touch.near_count[0, 0] == 1 and fall.touch.near[0, 0] == 0 and fall.touch.pressure[0, 0] == 0.0


def test_the_room_is_what_lies_between():
    fall = Fall()
    fall.step()
    assert fall.touch.room[0, 0] == pytest.approx(1.0 - RADIUS, rel=1e-6)


@pytest.mark.parametrize("starts", [[0, 1, 2], [0, BLOCK, 2 * BLOCK + 1], [0, 0, 5 * BLOCK - 1, 7 * BLOCK]])
def test_no_two_blocks_share_a_room(starts):
    last = [*starts[1:], 9 * BLOCK + 3]
    rooms = [
        plain(block_of)(p, first, start)
        for p, (first, stop) in enumerate(zip(starts, last, strict=True))
        for start in range(first, stop, BLOCK)
    ]
    assert len(set(rooms)) == len(rooms) and max(rooms) < n_blocks(last[-1])
