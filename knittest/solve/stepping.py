"""Steps of a model, with what damping takes of its energy."""

from dataclasses import dataclass, field

import numpy as np
from numba import get_num_threads
from numpy.typing import NDArray

from knittest.kernels import monitor
from knittest.kernels.drive_state import Drive
from knittest.kernels.explicit import SCRATCH
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Tally
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.pace import Pace

Array = NDArray[np.float64]


def _scratch() -> Array:
    return np.zeros((PARTITIONS, SCRATCH))


@dataclass
class Stepping:
    """A model on its way under ``drive``, in steps of ``dt`` [ms]; ``tally`` sums up what acts on it.

    ``kinetic``: kinetic energy [mJ] after the last steps; ``loss_rate``: energy that damping takes in one step [mJ];
    ``damping_loss``: what it has taken so far [mJ], by the trapezoidal rule over every call of :meth:`step`.
    """

    model: ExplicitModel
    drive: Drive
    tally: Tally
    dt: float
    time: float = 0.0
    kinetic: float = 0.0
    loss_rate: float = 0.0
    damping_loss: float = 0.0
    scratch: Array = field(default_factory=_scratch, repr=False)
    pace: Pace = field(default_factory=lambda: Pace(get_num_threads()), repr=False)

    def step(self, steps: int) -> None:
        """Advance by ``steps`` time steps and book what damping took."""
        self.pace.advance(self._advance, steps)
        self.time += steps * self.dt
        kinetic, loss = monitor.kinetic_energy(self.model.nodes, self.model.mass, self.model.inertia, self.dt)
        self.damping_loss += 0.5 * (self.loss_rate + loss) * steps
        self.kinetic, self.loss_rate = kinetic, loss

    def _advance(self, steps: int) -> None:
        self.model.advance(steps, self.time, self.dt, self.drive, self.tally, self.scratch)

    def work(self) -> tuple[float, float, float, float]:
        """Work from outside, losses of friction, energy of eroded elements, losses of contact damping [mJ]."""
        external, friction, eroded, damped = self.tally.energy[:, :4].sum(axis=0).tolist()
        return external, friction, eroded, damped

    def rubbed(self) -> dict[str, float]:
        """Parts of the losses of friction [mJ]: against spin at crossings of yarns, at tools, in the shear of shells;
        the rest is that of sliding contacts.
        """
        return dict(zip(("spin", "tools", "shear"), self.tally.energy[:, 4:7].sum(axis=0).tolist(), strict=True))

    @property
    def guided(self) -> float:
        """Energy [mJ] that damping relative to guides has given back (:meth:`Boundary.guide`)."""
        return float(self.tally.energy[:, 8].sum())

    @property
    def recovered(self) -> float:
        """Energy [mJ] that contacts found late were given (:meth:`ContactTracker.recover`)."""
        return float(self.tally.energy[:, 7].sum())
