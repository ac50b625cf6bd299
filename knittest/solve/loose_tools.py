"""Tools that are free to move, while a model comes to rest: damped and judged as its nodes are."""

import numpy as np
from numpy.typing import NDArray

from knittest.kernels.drive_state import Drive
from knittest.kernels.tool_contact import FREE

Array = NDArray[np.float64]


class LooseTools:
    """Free tools of ``drive`` in steps of ``dt`` [ms]; none where they do not ``count``."""

    def __init__(self, drive: Drive, dt: float, count: bool = True) -> None:
        self.tools, self.dt = drive.tools, dt
        self.free = (drive.tools.motion == FREE) & count
        self._own_drag = drive.tools.drag.copy()
        self.halt()

    def halt(self) -> None:
        """Stop them and give them their own drag."""
        self.tools.velocity[self.free] = 0.0
        self.tools.drag[:] = self._own_drag

    def damp(self, frequency: float) -> None:
        """Damp them by exp(-2 ``frequency``) a step, and keep where they are."""
        self.tools.drag[self.free.any(axis=1)] = 2.0 * np.tanh(frequency) / self.dt
        self._there = self.tools.position.copy()

    def look(self) -> None:
        """Keep their velocities before a step."""
        self._before = self.tools.velocity.copy()

    def forces(self) -> Array:
        """Forces [N] on them in the step after :meth:`look` but those of their drag, and no moments, (n_tools, 6)."""
        slowed = 0.5 * self.tools.drag[:, None] * self.dt
        change = (1.0 + slowed) * self.tools.velocity - (1.0 - slowed) * self._before
        return self._six(self.tools.mass[:, None] * change / self.dt)

    def moves(self) -> Array:
        """Ways [mm] since :meth:`damp`, and no turns, (n_tools, 6)."""
        return self._six(self.tools.position - self._there)

    def _six(self, rows: Array) -> Array:
        free = rows * self.free
        return np.hstack([free, np.zeros_like(free)])


def applied_to_tools(drive: Drive, last: Array) -> float:
    """Sum of the forces [N] on free tools by the ``last`` values of the tables."""
    tools = drive.tools
    acts = (tools.motion == FREE) & (tools.load >= 0)
    return float(np.abs(last[tools.load[acts]]).sum())
