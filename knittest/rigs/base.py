"""What a rig is: boundary motion, stop rule and channels; it owns no time loop."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Motions
from knittest.models.explicit_model import ExplicitModel

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Rig(Protocol):
    """Boundary motion, stop rule and channels of a virtual test."""

    duration: float  # longest time [ms]

    def constrain(self, model: ExplicitModel) -> Motions:
        """Clamp nodes of ``model`` and return the prescribed motions."""

    def ring_time(self, wave_speed: float) -> float:
        """Time [ms] a wave of ``wave_speed`` [mm/ms] needs along the specimen."""

    def channels(self, time: float, reactions: Array) -> dict[str, float]:
        """Curve columns at ``time`` [ms] from the mean reactions [N] of the motions; needs strain_pct and force_n."""

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """Whether the test is over, with the force and its peak [N] and whether anything has failed."""


def clamp(model: ExplicitModel, nodes: Index) -> None:
    """Hold all degrees of freedom of ``nodes``; prescribed motions may still move them."""
    model.nodes.inv_mass[nodes] = 0.0
    model.nodes.inv_inertia[nodes] = 0.0
    model.mass[nodes] = 0.0
    model.inertia[nodes] = 0.0


def make_motions(
    model: ExplicitModel, node: Index, dof: Index, motion: Index, time: list[list[float]], velocity: list[list[float]]
) -> Motions:
    """Prescribed motions sorted by the partition that owns each node; tables as in :class:`Motions`."""
    owner = np.searchsorted(model.parts.node, node, side="right") - 1
    order = np.lexsort((node, owner))
    start = np.searchsorted(owner[order], np.arange(PARTITIONS + 1))
    return Motions(start, node[order], dof[order], motion[order], np.array(time), np.array(velocity))
