"""A model, with tools that are free to move, damped critically for the slowest mode that still moves.

Underwood (1983), Dynamic relaxation, in: Computational Methods for Transient Analysis. The frequency of that mode is
the Rayleigh quotient of the movement over a chunk of steps: work of the change of force over the movement's inertia.
Turns count as movements of the nodes' radius of gyration, and moments as forces at it.
"""

from dataclasses import dataclass

import numpy as np
from numba import get_num_threads

from knittest.base.arrays import Array
from knittest.base.errors import NumericalError
from knittest.kernels.explicit import SCRATCH
from knittest.kernels.state import ALONG, Drive, Tally
from knittest.kernels.tool_contact import FREE
from knittest.kernels.vec import PARTITIONS
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.pace import Pace


class FreeTools:
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

    def record_velocities(self) -> None:
        """Keep their velocities before a step."""
        self._before = self.tools.velocity.copy()

    def forces(self) -> Array:
        """Forces [N] on them in the step after :meth:`record_velocities` but those of their drag, and no moments,
        (n_tools, 6).
        """
        slowed = 0.5 * self.tools.drag[:, None] * self.dt
        change = (1.0 + slowed) * self.tools.velocity - (1.0 - slowed) * self._before
        return self._six(self.tools.mass[:, None] * change / self.dt)

    def displacements(self) -> Array:
        """Ways [mm] since :meth:`damp`, and no turns, (n_tools, 6)."""
        return self._six(self.tools.position - self._there)

    def _six(self, rows: Array) -> Array:
        free = rows * self.free
        return np.hstack([free, np.zeros_like(free)])


#: steps between estimates of the slowest frequency
CHUNK = 50
#: lowest circular frequency a step that damping follows down to
SLOWEST = 1e-6
#: speed [mm/ms] that no yarn and no sheet can have while it relaxes
TOO_FAST = 1e5


@dataclass(frozen=True)
class Chunk:
    """Steps of a chunk: the residual ``force`` [N] at its end, the largest move [mm] in it, and the
    circular frequency a step of the slowest mode.
    """

    steps: int
    force: float
    moved: float
    frequency: float

    @property
    def drift(self) -> float:
        """Move [mm] in a period of the slowest mode."""
        return self.moved * 2.0 * np.pi / (self.frequency * self.steps)


class DampedModel:
    """``model`` and the free tools of ``drive``, damped, under the values of all tables ``at`` a time [ms].

    ``free`` (n_nodes, 6) is 1 where a degree of freedom may move, ``arm`` the radius of gyration of its turns.
    ``tally`` holds the sums of the last chunk.
    """

    def __init__(self, model: ExplicitModel, drive: Drive, tally: Tally, dt: float, at: float) -> None:
        self.model, self.drive, self.tally, self.dt, self.at = model, drive, tally, dt, at
        self.free = np.repeat(np.column_stack([model.mass > 0.0, model.inertia > 0.0]).astype(float), 3, axis=1)
        fixed = drive.motions.dof < ALONG  # along axes of one's own all stay free: forces hold the reaction
        self.free[drive.motions.node[fixed], drive.motions.dof[fixed]] = 0.0
        turning = (model.mass > 0.0) & (model.inertia > 0.0)
        arm = np.sqrt(np.where(turning, model.inertia, 1.0) / np.where(turning, model.mass, 1.0))
        self.arm = np.repeat(np.column_stack([np.ones(model.n_nodes), arm]), 3, axis=1)
        self.frequency, self.steps = 0.05, 0
        self._scratch, self._pace = np.zeros((PARTITIONS, SCRATCH)), Pace(get_num_threads())
        model.halt()
        self._own_damping = model.nodes.damping_factor.copy()
        self._tools, self._mass = FreeTools(drive, dt, count=at > 0.0), np.append(model.mass, drive.tools.mass)
        self._last: Array | None = None

    def advance(self) -> Chunk:
        """Move by a chunk; raises :class:`NumericalError` when the state is no longer finite."""
        nodes, n = self.model.nodes, self.model.n_nodes
        nodes.damping_factor[:] = kept = np.exp(-2.0 * self.frequency)
        self._tools.damp(self.frequency)
        before, facing = self.model.position(), nodes.rotation[:, :n].copy()
        steps = min(self.model.safe_steps(self.dt, CHUNK), CHUNK)
        self.tally.reaction[:], self.tally.tool_sum[:], self.tally.support[:] = 0.0, 0.0, 0.0
        self._pace.advance(self._step, steps - 1)
        spin = nodes.spin[:, :n].copy()
        self._tools.record_velocities()
        self._step(1)
        self.steps += steps
        _refuse_runaway(self.model, self.steps)
        force = self._residual_forces(kept * spin)
        move = np.hstack([self.model.position() - before, _turn(facing, nodes.rotation[:, :n])]) * self.arm * self.free
        move = np.vstack([move, self._tools.displacements()])
        if self._last is not None:
            self.frequency = _slowest_frequency(move, force - self._last, self._mass, self.dt, self.frequency)
        self._last = force
        return Chunk(steps, float(np.abs(force).sum()), float(np.abs(move).max()), self.frequency)

    def release(self) -> None:
        """Stop all and give it its own damping."""
        self.model.halt()
        self._tools.halt()
        self.model.nodes.damping_factor[:] = self._own_damping

    def _step(self, steps: int) -> None:
        self.model.advance(steps, self.at, self.dt, self.drive, self.tally, self._scratch)

    def _residual_forces(self, spin: Array) -> Array:
        """Forces, and moments over radii of gyration, after a step from the damped ``spin``, (n_nodes + n_tools, 6)."""
        nodes, n = self.model.nodes, self.model.n_nodes
        # no sum of a node has all of its moments; one held about axes of one's own does not spin about them
        moment = (nodes.spin[:, :n] - spin).T * self.model.inertia[:, None] / self.dt
        held = np.hstack([nodes.force[:, :n].T, moment]) / self.arm * self.free
        return np.vstack([held, self._tools.forces()])


def _refuse_runaway(model: ExplicitModel, steps: int) -> None:
    """Raise :class:`NumericalError` before the search for contacts, which would read beyond its cells."""
    nodes = model.nodes
    wrong = ~(np.isfinite(nodes.velocity) & np.isfinite(nodes.position)).all(axis=0)
    wrong |= (np.abs(nodes.velocity) > TOO_FAST).any(axis=0)
    if wrong.any():
        bad = int(np.argmax(wrong))
        raise NumericalError(
            f"dynamic relaxation diverged after {steps} steps, first at node {bad} of "
            f"{model.name_of(bad)}; reduce solver.safety"
        )


def _turn(before: Array, after: Array) -> Array:
    """Rotation vectors (n, 3) [rad] of small turns between unit quaternions (4, n)."""
    v, u = before[1:], after[1:]
    cosine = np.sum(before * after, axis=0)
    return np.asarray(2.0 * np.sign(cosine) * (before[0] * u - after[0] * v - np.cross(v, u, axis=0))).T


def _slowest_frequency(move: Array, change: Array, mass: Array, dt: float, frequency: float) -> float:
    """Circular frequency a step of the mode that moves, between :data:`SLOWEST` and twice the last one."""
    inertia = float((mass[:, None] * move**2).sum())
    quotient = -float((move * change).sum()) / inertia if inertia > 0.0 else 0.0
    return float(np.clip(dt * np.sqrt(max(quotient, 0.0)), max(SLOWEST, 0.5 * frequency), min(2.0 * frequency, 0.5)))
