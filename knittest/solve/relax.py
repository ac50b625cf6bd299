"""Static states by dynamic relaxation, damped critically for the slowest mode that still moves.

Underwood (1983), Dynamic relaxation, in: Computational Methods for Transient Analysis. The frequency of that mode is
the Rayleigh quotient of the movement over a chunk of steps: work of the change of force over the movement's inertia.
Turns count as movements of the nodes' radius of gyration, and moments as forces at it. Tools that are free to move come
to rest with the nodes.
"""

from dataclasses import dataclass, field
from math import ceil

import numpy as np
from numba import get_num_threads
from numpy.typing import NDArray

from knittest.base.errors import NumericalError
from knittest.kernels.drive_state import ALONG, Drive
from knittest.kernels.explicit import SCRATCH
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Tally
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.loose_tools import LooseTools, applied_to_tools
from knittest.solve.pace import Pace

Array = NDArray[np.float64]

#: steps between estimates of the slowest frequency
CHUNK = 50
#: time [ms] at which tables are read: their last value
AT_THE_END = 1e12
#: lowest circular frequency a step that damping follows down to
SLOWEST = 1e-6
#: speed [mm/ms] that no yarn and no sheet coming to rest can have
TOO_FAST = 1e5
#: sum of forces over that of m x / dt^2, which rounding causes: stiffnesses are at most 4 m / dt^2
ROUNDING = 4.0 * float(np.finfo(float).eps)
#: fewest and most steps, else a period of the slowest mode, in which the residual no longer falls by a tenth, and
#: residual up to which such a state is one of rest
STALLED, LOST = (2000, 20000), 0.01
#: residual and most steps of a prestressed model that comes to rest before its test
SETTLED, SETTLING = 0.01, 4000
#: the same where yarns press each other from the start, and overlap [mm] that comes to bear there in a chunk
SETTLING_PRESSED, PRESSED = 8000, 1e-3
#: times that overlap is made to bear again which closest points hid while the yarns came to rest
AGAIN = 2


@dataclass
class Relaxation:
    """Account of how a static state was reached.

    ``residual``: sum of out-of-balance forces (and moments over radii of gyration) over that of loads, of reactions
    where there are none, or of contacts where a model settles. ``history`` holds, a chunk, (steps,
    residual, largest move [mm], circular frequency of the slowest mode a step). ``last_chunk``: steps whose reactions
    and forces on tools the tally holds at the end.
    """

    steps: int = 0
    last_chunk: int = 0
    converged: bool = False
    residual: float = np.inf
    history: list[tuple[int, float, float, float]] = field(default_factory=list)


def settle(model: ExplicitModel, drive: Drive, tally: Tally, dt: float) -> Relaxation:
    """Let a prestressed model come to rest under the first values of all tables; the tally is left empty.

    Loose yarns at cut edges may creep on: after :data:`SETTLING` steps (:data:`SETTLING_PRESSED` where yarns are to
    press each other from the start) the rest is left to the damping of the test.
    """
    most = SETTLING_PRESSED if model.pressed else SETTLING
    found = relax(model, drive, tally, dt, SETTLED, most, at=0.0)
    for _ in range(AGAIN):
        if model.press(0.0) <= PRESSED:
            break
        found = relax(model, drive, tally, dt, SETTLED, most, at=0.0)
    for sums in tally:
        sums[:] = 0.0
    return found


def relax(
    model: ExplicitModel,
    drive: Drive,
    tally: Tally,
    dt: float,
    tolerance: float = 1e-4,
    most_steps: float = 2e6,
    at: float = AT_THE_END,
    unloaded: Array | None = None,
) -> Relaxation:
    """Relax ``model`` under the values of all tables ``at`` a time [ms], the last by default; ``dt`` [ms] is stable.

    Converged when the residual is below ``tolerance`` and the move in a period of the slowest mode below ``tolerance``
    of the largest displacement so far from ``unloaded`` (n_nodes, 3), by default from where it begins; or when forces
    are no more than the rounding of positions gives (:data:`ROUNDING`) and nothing acts or the residual has come to its
    least. Raises :class:`NumericalError` when the state is no longer finite.
    """
    nodes, n = model.nodes, model.n_nodes
    found, free, arm = Relaxation(), _free(model, drive), _gyration(model)
    start = model.position() if unloaded is None else unloaded
    rounding = _Rounding(_noise(model.mass, free * arm, float(np.abs(start).max()), dt))
    scratch, frequency, pace = np.zeros((PARTITIONS, SCRATCH)), 0.05, Pace(get_num_threads())
    model.halt()
    own_damping = nodes.damping_factor.copy()
    tools, mass = LooseTools(drive, dt, count=at > 0.0), np.append(model.mass, drive.tools.mass)
    last: Array | None = None
    bearing = ceil(model.press(0.0) / PRESSED)
    while found.steps < most_steps and not found.converged:
        if bearing > 0:
            model.press(PRESSED)
            bearing -= 1
        nodes.damping_factor[:] = kept = np.exp(-2.0 * frequency)
        tools.damp(frequency)
        before, facing = model.position(), nodes.rotation[:, :n].copy()
        chunk = min(model.safe_steps(dt, CHUNK), CHUNK)
        tally.reaction[:], tally.tool_sum[:], tally.support[:] = 0.0, 0.0, 0.0
        pace.advance(lambda steps: model.advance(steps, at, dt, drive, tally, scratch), chunk - 1)
        spin = nodes.spin[:, :n].copy()
        tools.look()
        model.advance(1, at, dt, drive, tally, scratch)
        found.steps, found.last_chunk = found.steps + chunk, chunk
        _refuse_runaway(model, found.steps)
        # no sum of a node has all of its moments; one held about axes of one's own does not spin about them
        moment = (nodes.spin[:, :n] - kept * spin).T * model.inertia[:, None] / dt
        force = np.vstack([np.hstack([nodes.force[:, :n].T, moment]) / arm * free, tools.forces()])
        move = np.hstack([model.position() - before, _turn(facing, nodes.rotation[:, :n])]) * arm * free
        move = np.vstack([move, tools.moves()])
        if last is not None:
            frequency = _slowest(move, force - last, mass, dt, frequency)
        last = force
        reaction = np.abs(tally.reaction.sum(axis=0)).sum() / chunk
        loads = _applied(drive) if at > 0.0 else 0.0
        applied = (loads or reaction) if at > 0.0 else model.pressing()
        found.residual = float(np.abs(force).sum() / max(applied, 1e-12))
        moved = float(np.abs(move).max())
        found.history.append((found.steps, found.residual, moved, frequency))
        reach = max(float(np.abs(model.position() - start).max()), 1e-6)
        drift = moved * 2.0 * np.pi / (frequency * chunk)
        found.converged = (
            bearing == 0 and found.steps > 4 * CHUNK and found.residual < tolerance and drift < tolerance * reach
        )
        found.converged |= rounding.alone(found, float(np.abs(force).sum()), loads > 0.0 or applied > rounding.noise)
    model.halt()
    tools.halt()
    nodes.damping_factor[:] = own_damping
    return found


def _refuse_runaway(model: ExplicitModel, steps: int) -> None:
    """Raise :class:`NumericalError` before the search for contacts, which would read beyond its cells."""
    nodes = model.nodes
    wrong = ~(np.isfinite(nodes.velocity) & np.isfinite(nodes.position)).all(axis=0)
    wrong |= (np.abs(nodes.velocity) > TOO_FAST).any(axis=0)
    if wrong.any():
        bad = int(np.argmax(wrong))
        raise NumericalError(
            f"dynamic relaxation is no longer finite after {steps} steps, first at node {bad} of "
            f"{model.name_of(bad)}; reduce solver.safety"
        )


def _free(model: ExplicitModel, drive: Drive) -> Array:
    """1 for degrees of freedom that may move, else 0, (n_nodes, 6).

    Along axes of one's own all are 1: forces hold the reaction.
    """
    free = np.repeat(np.column_stack([model.mass > 0.0, model.inertia > 0.0]).astype(float), 3, axis=1)
    fixed = drive.motions.dof < ALONG
    free[drive.motions.node[fixed], drive.motions.dof[fixed]] = 0.0
    return free


def _gyration(model: ExplicitModel) -> Array:
    """Radius of gyration [mm] of the turns of each node, 1 for its translations, (n_nodes, 6)."""
    turning = (model.mass > 0.0) & (model.inertia > 0.0)
    arm = np.sqrt(np.where(turning, model.inertia, 1.0) / np.where(turning, model.mass, 1.0))
    return np.repeat(np.column_stack([np.ones(model.n_nodes), arm]), 3, axis=1)


@dataclass
class _Rounding:
    """Tells when ``noise`` [N], an upper bound of what rounding makes, is all that is out of balance.

    Where something acts the forces fall far below the bound before they are rounding: a plate under a light load was
    called at rest at a residual of 2 to 23 %, with 3 to 35 % of its sag missing.
    """

    noise: float
    best: float = np.inf
    since: int = 0

    def alone(self, found: Relaxation, force: float, acts: bool) -> bool:
        """Tell it from the sum of ``force`` [N] out of balance, the course so far and whether anything ``acts``."""
        quiet = force < self.noise
        if quiet and found.residual < 0.9 * self.best:
            self.best, self.since = found.residual, found.steps
        wait = np.clip(2.0 * np.pi / found.history[-1][3], *STALLED)
        stalled = self.since > 0 and found.steps - self.since >= wait and found.residual < LOST
        return bool(stalled) or (quiet and not acts)


def _noise(mass: Array, arm: Array, size: float, dt: float) -> float:
    """Sum of forces [N] that rounding causes: of positions of ``size`` [mm] and of quaternions, whose size is 1."""
    return ROUNDING * float((mass @ arm) @ np.repeat([size, 1.0], 3)) / dt**2


def _turn(before: Array, after: Array) -> Array:
    """Rotation vectors (n, 3) [rad] of small turns between unit quaternions (4, n)."""
    v, u = before[1:], after[1:]
    cosine = np.sum(before * after, axis=0)
    return np.asarray(2.0 * np.sign(cosine) * (before[0] * u - after[0] * v - np.cross(v, u, axis=0))).T


def _slowest(move: Array, change: Array, mass: Array, dt: float, frequency: float) -> float:
    """Circular frequency a step of the mode that moves, between :data:`SLOWEST` and twice the last one."""
    inertia = float((mass[:, None] * move**2).sum())
    quotient = -float((move * change).sum()) / inertia if inertia > 0.0 else 0.0
    return float(np.clip(dt * np.sqrt(max(quotient, 0.0)), max(SLOWEST, 0.5 * frequency), min(2.0 * frequency, 0.5)))


def _applied(drive: Drive) -> float:
    """Sum of all forces applied to nodes and free tools at the end of the tables [N]."""
    loads, last = drive.loads, _last(drive)
    factor = np.where(loads.dof < 3, last[loads.table], 0.0)
    return float(np.abs(loads.value * np.repeat(factor, loads.length)).sum()) + applied_to_tools(drive, last)


def _last(drive: Drive) -> Array:
    """Last value of every table, (n_tables,)."""
    tables = drive.tables
    return tables.value[np.arange(len(tables.knots)), tables.knots - 1]
