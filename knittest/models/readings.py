"""Sums of a run over reactions and forces on tools, and its means."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.drive_state import Drive
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Tally
from knittest.models.boundary import Boundary

Array = NDArray[np.float64]


def new_tally(boundary: Boundary) -> Tally:
    """Empty accumulators for ``boundary``."""
    n_tools, groups = len(boundary.tools), (PARTITIONS, max(boundary.groups, 1))
    return Tally(
        np.zeros(groups), np.zeros((PARTITIONS, 9)), np.zeros((PARTITIONS, n_tools, 3)), np.zeros((n_tools, 3)),
        np.zeros(groups), np.zeros(1),
    )  # fmt: skip


@dataclass(frozen=True)
class Readings:
    """Means over a few steps: ``reaction`` (n_groups,) [N or N mm], conjugate to the tables, ``tool_force`` on each
    tool [N], (n_tools, 3), and the tools' ``tool_position`` [mm], (n_tools, 3), at their end.
    """

    reaction: Array
    tool_force: Array
    tool_position: Array

    @classmethod
    def of(cls, row: Array, n_tools: int) -> "Readings":
        """Readings from the flat form that :func:`take_readings` gives."""
        tools = row[len(row) - 6 * n_tools :].reshape(2, n_tools, 3)
        return cls(row[: len(row) - 6 * n_tools], tools[0], tools[1])


def take_readings(tally: Tally, drive: Drive, steps: int) -> Array:
    """Flat means over ``steps`` of what ``tally`` has summed, which is reset."""
    row = np.concatenate(
        [tally.reaction.sum(axis=0) / steps, tally.tool_sum.ravel() / steps, drive.tools.position.ravel()]
    )
    tally.reaction[:], tally.tool_sum[:], tally.support[:] = 0.0, 0.0, 0.0
    return row
