"""A strip held behind an edge, the loads on it and what is read from it at rest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame
from knittest.laboratory.base import Holder
from knittest.models.boundary import Boundary
from knittest.solve.relax import Relaxation

Array = NDArray[np.float64]

#: nodes up to here [mm] are held
EDGE = 1e-6
#: share of the overhang from which the curvature of the root is read, and the terms that it is read by
NEAR, TERMS = 0.25, 3


@dataclass
class Rest:
    """A strip at rest: chord angle [deg], moment of the root about the edge (without that of the curl) and that of the
    weight [N mm], curvature at the root [1/mm], and how it came to rest.
    """

    overhang: float
    angle: float
    root_moment: float
    weight_moment: float
    curvature: float
    relaxation: Relaxation
    frames: tuple[Frame, Frame]
    converged: bool
    #: moment [N mm] that holds the strip flat when it weighs nothing, and how far the angle still moved [deg]
    curl: float = 0.0
    drift: float = 0.0
    #: energy of the hourglass control of shells over the internal one [-]
    hourglass: float = 0.0
    #: whether yarns got their friction on the way, without which they slipped on
    rubs: bool = False


class Mounting(Holder):
    """A strip along y, held behind its edge at 0; ``flat`` positions [mm], (n, 3), and ``weight`` [N] of its nodes."""

    def __init__(self, flat: Array, weight: Array) -> None:
        self.flat, self.weight = flat, weight

    def constrain(self, boundary: Boundary) -> None:
        """Hold the root; the groups of reactions add up to its moment about the edge (scales are lever arms)."""
        along, height = self.flat[:, 1], self.flat[:, 2]
        held = np.flatnonzero(along <= EDGE)
        boundary.move(held, "z", scale=along[held])
        boundary.move(held, "y", scale=-height[held])
        boundary.move(held, ["rx"])
        boundary.move(held, ["x", "ry", "rz"])

    def moment(self, now: Array) -> float:
        """Moment of the weight about the edge [N mm] at positions ``now`` (n, 3)."""
        free = self.flat[:, 1] > EDGE
        return float(np.sum(self.weight[free] * now[free, 1]))

    def root(self, reaction: Array, steps: int) -> float:
        """Moment of the strip at the edge [N mm] from reactions (PARTITIONS, n_groups) summed over ``steps``.

        The reactions also bear what is held behind the edge.
        """
        held = self.flat[:, 1] <= EDGE
        return float(reaction[:, :3].sum()) / steps - float(self.weight[held] @ self.flat[held, 1])

    def curvature(self, now: Array) -> float:
        """Curvature at the edge [1/mm] of the mean deflection, by terms of the elastica from as many rows at least."""
        along, drop = self.flat[:, 1], self.flat[:, 2] - now[:, 2]
        rows = np.unique(np.round(along[along > EDGE], 6))
        near = (along > EDGE) & ((along < NEAR * along.max()) | (along < rows[:TERMS][-1] + EDGE))
        s = along[near]
        basis = np.column_stack([0.5 * s**2, s**3, s**4])
        return float(np.linalg.lstsq(basis, drop[near], rcond=None)[0][0])
