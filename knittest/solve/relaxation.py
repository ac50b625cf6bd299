"""Static states by dynamic relaxation: chunks of damped steps until forces and moves have vanished.

Underwood (1983), Dynamic relaxation, in: Computational Methods for Transient Analysis. Tools that are free to move
relax with the nodes.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import ceil

import numpy as np

from knittest.base.arrays import Array
from knittest.kernels.state import Drive, Tally
from knittest.kernels.tool_contact import FREE
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.damped_model import CHUNK, Chunk, DampedModel

#: called with the steps done and the most that there may be
Look = Callable[[int, float], None]

#: time [ms] at which tables are read: their last value
AT_THE_END = 1e12
#: sum of forces over that of m x / dt^2, which rounding causes: stiffnesses are at most 4 m / dt^2
ROUNDING = 4.0 * float(np.finfo(float).eps)
#: fewest and most steps, else a period of the slowest mode, in which the residual no longer falls by a tenth, and
#: residual up to which such a state is an equilibrium
STALLED, LOST = (2000, 20000), 0.01
#: residual over the tolerance at which a row is at rest although the last small moves go on
NEGLIGIBLE = 0.1
#: residual and most steps of the relaxation of a prestressed model before its test
SETTLED, SETTLING = 0.01, 4000
#: most steps where yarns press each other from the start, where they are soft, and overlap [mm] that starts to bear in
#: each chunk
SETTLING_PRESSED, SETTLING_SOFT, PRESSED = 8000, 40000, 1e-3
#: relaxations of a cell with a free lattice until both it and the cell are at rest, at most
ROUNDS = 20
#: times that overlap is made to bear again which closest points hid while the yarns relaxed
AGAIN = 2


@dataclass
class Relaxation:
    """Account of how a static state was reached.

    ``residual``: sum of residual forces (and moments over radii of gyration) over that of loads; where there are
    none over that of reactions, the largest force inside or what rounding makes over the tolerance, whichever is most;
    over that of contacts where a model settles. ``history`` holds, a chunk, (steps,
    residual, largest move [mm], circular frequency of the slowest mode a step). ``last_chunk``: steps whose reactions
    and forces on tools the tally holds at the end.
    """

    steps: int = 0
    last_chunk: int = 0
    converged: bool = False
    residual: float = np.inf
    history: list[tuple[int, float, float, float]] = field(default_factory=list)

    def add(self, chunk: Chunk, applied: float) -> None:
        """Add a chunk; its residual is over the forces ``applied`` [N]."""
        self.steps, self.last_chunk = self.steps + chunk.steps, chunk.steps
        self.residual = float(chunk.force / max(applied, 1e-12))
        self.history.append((self.steps, self.residual, chunk.moved, chunk.frequency))


def settle(model: ExplicitModel, drive: Drive, tally: Tally, dt: float, look: Look | None = None) -> Relaxation:
    """Relax a prestressed model under the first values of all tables; the tally is left empty.

    Loose yarns at cut edges may creep on: after :data:`SETTLING` steps (:data:`SETTLING_PRESSED` where yarns are to
    press each other from the start, :data:`SETTLING_SOFT` of soft ones) the rest is left to the damping of the test.
    """
    most = SETTLING_SOFT if model.compliant else SETTLING_PRESSED if model.pressed else SETTLING
    found = relax(model, drive, tally, dt, SETTLED, most, at=0.0, look=look)
    for _ in range(AGAIN):
        if model.press(0.0) <= PRESSED:
            break
        found = relax(model, drive, tally, dt, SETTLED, most, at=0.0, look=look)
    for sums in tally:
        sums[:] = 0.0
    return found


def relax_held(
    model: ExplicitModel, drive: Drive, tally: Tally, dt: float, tolerance: float, most_steps: int, least: float = 0.0
) -> Relaxation:
    """Relax ``model`` where it is, under the first values of all tables, which should be 0; forces on free numbers of a
    lattice vanish too.

    Converged when the residual forces, and those on the free lattice, are below ``tolerance`` of the sum of contact
    forces, or of the force ``least`` [N] where these vanish.
    """
    steps = 0
    for _ in range(ROUNDS):
        found = relax(model, drive, tally, dt, tolerance, most_steps - steps, at=0.0, least=least)
        steps += found.steps
        pulled = model.lattice_force() / max(model.contact_force_sum(), least, 1e-12)
        if pulled < tolerance or steps >= most_steps:
            break
    found.steps, found.residual = steps, max(found.residual, pulled)
    found.converged = found.converged and pulled < tolerance
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
    look: Look | None = None,
    least: float = 0.0,
) -> Relaxation:
    """Relax ``model`` under the values of all tables ``at`` a time [ms], the last by default; ``dt`` [ms] is stable.

    Converged when the residual is below ``tolerance`` and the move in a period of the slowest mode below ``tolerance``
    of the largest displacement so far from ``unloaded`` (n_nodes, 3), by default from where it begins; or when forces
    are no more than the rounding of positions gives (:data:`ROUNDING`) and nothing acts or the residual has come to its
    least. Residual forces are compared with the force ``least`` [N] at least; where it is given, a residual far below
    the tolerance (:data:`NEGLIGIBLE`) suffices. ``look`` is called after every chunk of steps. Raises
    :class:`NumericalError` when the state is no longer finite.
    """
    start = model.position() if unloaded is None else unloaded
    damped = DampedModel(model, drive, tally, dt, at)
    # forces that rounding causes: of positions about the start and of quaternions, whose size is 1
    arm, size = damped.free * damped.arm, float(np.abs(start).max())
    noise = ROUNDING * float((model.mass @ arm) @ np.repeat([size, 1.0], 3)) / dt**2
    found, rounding = Relaxation(), _Rounding(noise)
    bearing = ceil(model.press(0.0) / PRESSED)
    while found.steps < most_steps and not found.converged:
        if bearing > 0:
            model.press(PRESSED)
            bearing -= 1
        chunk = damped.advance()
        outside, applied = _acting_forces(model, drive, tally, chunk.steps, at, rounding.noise / tolerance)
        found.add(chunk, max(applied, least))
        if look is not None:
            look(found.steps, most_steps)
        reach = max(float(np.abs(model.position() - start).max()), 1e-6)
        found.converged = (
            bearing == 0 and found.steps > 4 * CHUNK and found.residual < tolerance and chunk.drift < tolerance * reach
        )
        found.converged |= least > 0.0 and bearing == 0 and found.residual < NEGLIGIBLE * tolerance
        found.converged |= rounding.is_only_rounding(found, chunk.force, outside > rounding.noise)
    damped.release()
    return found


@dataclass
class _Rounding:
    """Detects when the residual is only ``noise`` [N], an upper bound of rounding.

    Where something acts the forces fall far below the bound before they are rounding: a plate under a light load was
    accepted at a residual of 2 to 23 %, with 3 to 35 % of its sag missing.
    """

    noise: float
    best: float = np.inf
    since: int = 0

    def is_only_rounding(self, found: Relaxation, force: float, acts: bool) -> bool:
        """Return whether it is, by the residual ``force`` [N], the history and whether a load ``acts``."""
        quiet = force < self.noise
        if quiet and found.residual < 0.9 * self.best:
            self.best, self.since = found.residual, found.steps
        wait = np.clip(2.0 * np.pi / found.history[-1][3], *STALLED)
        stalled = self.since > 0 and found.steps - self.since >= wait and found.residual < LOST
        return bool(stalled) or (quiet and not acts)


def _acting_forces(
    model: ExplicitModel, drive: Drive, tally: Tally, steps: int, at: float, least: float
) -> tuple[float, float]:
    """Force [N] that acts from outside, and the one that residual forces are compared with: contacts where the model
    settles, loads, or without them reactions in ``steps``, the largest force inside, and at ``least`` a force [N].

    A body that is released has reactions that vanish with the residual forces. What is left inside it is then
    the scale, of yarns that hold each other; and of a body that nothing is left in, rounding.
    """
    if at <= 0.0:
        return model.contact_force_sum(), model.contact_force_sum()
    if (loads := _applied_force(drive)) > 0.0:
        return np.inf, loads
    reactions = float(np.abs(tally.reaction.sum(axis=0)).sum()) / steps
    return reactions, max(reactions, model.largest_force(), least)


def _applied_force(drive: Drive) -> float:
    """Sum of all forces applied to nodes and free tools at the end of the tables [N]."""
    tables, loads, tools = drive.tables, drive.loads, drive.tools
    last = tables.value[np.arange(len(tables.knots)), tables.knots - 1]
    factor = np.where((loads.dof < 3) & (loads.guides == 0), last[loads.table], 0.0)
    on_tools = last[tools.load[(tools.motion == FREE) & (tools.load >= 0)]]
    return float(np.abs(loads.value * np.repeat(factor, loads.length)).sum()) + float(np.abs(on_tools).sum())
