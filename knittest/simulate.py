"""Runs a rig on a model in chunks: contacts kept current, energies booked, guards, frames, progress."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import Output, Solver
from knittest.errors import NumericalError
from knittest.history import Frame, History
from knittest.kernels import monitor
from knittest.kernels.beam_blocks import SCRATCH
from knittest.kernels.explicit import advance
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import ContactLaw, Motions, Tally
from knittest.models.contact_tracker import ContactTracker
from knittest.models.explicit_model import ExplicitModel
from knittest.rigs.base import Rig

Array = NDArray[np.float64]
ProgressCall = Callable[[float, float, float, float], None]

#: steps between looks at displacement, kinetic energy and damping loss
CHUNK = 20
#: energy error that stops a run, and the work [mJ] below which the error is not judged
STOP_ENERGY_ERROR = 0.10
NO_CONTACT = ContactLaw(0.0, 0.0, 0.0, 0.0)


@dataclass
class SimulationCost:
    """Time spent [s] by the compiled steps and by the contact lists; steps and time step [ms]."""

    steps: int = 0
    time_step: float = 0.0
    advance_s: float = 0.0
    search_s: float = 0.0
    penetration_max: float = 0.0
    penetration_mean: float = 0.0


@dataclass
class Simulation:
    """State of one run between chunks."""

    model: ExplicitModel
    rig: Rig
    solver: Solver
    motions: Motions
    tracker: ContactTracker
    tally: Tally
    dt: float
    time: float = 0.0
    damping_loss: float = 0.0
    kinetic: float = 0.0
    rows: list[dict[str, float]] = field(default_factory=list)
    energy_rows: list[dict[str, float]] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)
    peak_frame: Frame | None = None
    peak: float = 0.0
    cost: SimulationCost = field(default_factory=SimulationCost)


def simulate(
    model: ExplicitModel, rig: Rig, solver: Solver, output: Output, progress: ProgressCall | None = None
) -> tuple[History, SimulationCost]:
    """Run ``rig`` on ``model`` to its end; ``progress(fraction, time_ms, step_us, kinetic_ratio)`` is called per row.

    Raises :class:`NumericalError` when the state is no longer finite or the energy balance is lost.
    """
    motions = rig.constrain(model)
    n_motions = motions.time.shape[0]
    tally = Tally(np.zeros((PARTITIONS, n_motions)), np.zeros((PARTITIONS, 3)))
    dt = solver.safety * model.critical_step
    run = Simulation(model, rig, solver, motions, ContactTracker(model), tally, dt)
    run.cost.time_step = dt
    row_steps = max(CHUNK, round(rig.duration / dt / output.samples))
    frame_strains = iter(np.linspace(0.0, 1.0, output.frames + 1)[1:]) if output.frames else iter(())
    scratch = np.zeros((PARTITIONS, SCRATCH))
    run.frames.append(_frame(run, {"strain_pct": 0.0, "force_n": 0.0}))
    next_frame = next(frame_strains, np.inf)
    while run.time < rig.duration:
        _advance_row(run, row_steps, scratch)
        row = _record(run, row_steps)
        fraction = run.time / rig.duration
        if fraction >= next_frame:
            run.frames.append(_frame(run, row))
            next_frame = next(frame_strains, np.inf)
        if row["force_n"] > run.peak:
            run.peak, run.peak_frame = row["force_n"], _frame(run, row)
        if progress is not None:
            progress(fraction, run.time, 1e3 * dt, run.energy_rows[-1]["kinetic_ratio"])
        if rig.finished(row["strain_pct"] / 100.0, row["force_n"], run.peak):
            break
    return _history(run), run.cost


def _advance_row(run: Simulation, steps: int, scratch: Array) -> None:
    """Advance to the next sample, looking at contacts, energy and finiteness every chunk."""
    model, tracker = run.model, run.tracker
    keep = float(np.exp(-run.solver.damping * run.dt))
    law = model.contact.law if model.contact is not None else NO_CONTACT
    done = 0
    while done < steps:
        chunk = min(CHUNK, steps - done)
        start = clock.perf_counter()
        tracker.update(chunk * run.dt)
        middle = clock.perf_counter()
        advance(
            chunk, run.time, run.dt, keep, model.nodes, model.parts, model.beams, tracker.contacts, tracker.count,
            model.chain, law, run.motions, run.tally, scratch,
        )  # fmt: skip
        run.time += chunk * run.dt
        done += chunk
        run.cost.steps += chunk
        kinetic = monitor.kinetic_energy(model.nodes, model.mass, model.inertia)
        run.damping_loss += run.solver.damping * (run.kinetic + kinetic) * chunk * run.dt
        run.kinetic = kinetic
        run.cost.search_s += middle - start
        run.cost.advance_s += clock.perf_counter() - middle
        if not np.isfinite(kinetic):
            _blame(run)


def _blame(run: Simulation) -> None:
    """Name the first entity whose state is not finite."""
    position = run.model.position()
    bad = np.flatnonzero(~np.isfinite(position).all(axis=1) | ~np.isfinite(run.model.nodes.velocity[0, : len(position)]))
    where = f"node {bad[0]} of yarn {run.model.chain[bad[0]]}" if len(bad) else "a rotation"
    raise NumericalError(f"the state is not finite at {run.time:.5f} ms, first at {where}; reduce solver.safety or speed")


def _record(run: Simulation, steps: int) -> dict[str, float]:
    """Append one row of the curve and of the energies."""
    model, tracker = run.model, run.tracker
    reactions = run.tally.reaction.sum(axis=0) / steps
    run.tally.reaction[:] = 0.0
    row = {"time_ms": run.time, **run.rig.channels(run.time - 0.5 * steps * run.dt, reactions)}
    failed = np.isfinite(model.beams.fail_time)
    part_of = np.full(model.n_nodes, -1)
    part_of[model.element_node] = model.mesh.part
    for k, name in enumerate(model.part_names):
        row[f"failed_{name}"] = float(np.count_nonzero(failed & (part_of == k)))
    law = model.contact.law if model.contact is not None else NO_CONTACT
    radius = model.contact.radius if model.contact is not None else np.ones(model.n_nodes)
    contact, deepest, mean = monitor.contact_statistics(
        tracker.contacts, tracker.count, law.normal, law.tangential, radius
    )
    internal = monitor.section_energies(model.nodes, model.parts, model.beams)
    external, friction, eroded = (float(v) for v in run.tally.energy.sum(axis=0))
    _book(run, internal, contact, friction, eroded, external)
    unbroken = not failed.any()
    if unbroken:
        run.cost.penetration_max = max(run.cost.penetration_max, deepest)
        run.cost.penetration_mean = mean
    run.rows.append(row)
    return row


def _book(
    run: Simulation, internal: Array, contact: float, friction: float, eroded: float, external: float
) -> None:
    stored = float(internal.sum()) + contact
    spent = friction + eroded + run.damping_loss
    error = external - stored - spent - run.kinetic
    largest = max([abs(external)] + [abs(r["external_mj"]) for r in run.energy_rows[-1:]])
    parts = {f"internal_{name}_mj": float(v) for name, v in zip(run.model.part_names, internal, strict=True)}
    work = stored + friction
    run.energy_rows.append(
        {
            "time_ms": run.time,
            "kinetic_mj": run.kinetic,
            **parts,
            "hourglass_mj": 0.0,
            "contact_mj": contact,
            "friction_mj": friction,
            "damping_mj": run.damping_loss,
            "eroded_mj": eroded,
            "external_mj": external,
            "balance_error_mj": error,
            "kinetic_ratio": run.kinetic / max(work, 1e-9),
            "energy_error": abs(error) / max(largest, 1e-9),
        }
    )


def _frame(run: Simulation, row: dict[str, float]) -> Frame:
    model = run.model
    state = monitor.axial_state(model.nodes, model.parts, model.beams)[:, model.element_node]
    fields = {
        "axial_strain": state[0],
        "axial_force": state[1],
        "alive": model.beams.alive[model.element_node].copy(),
    }
    return Frame(run.time, row["strain_pct"] / 100.0, row["force_n"], model.position(), fields)


def _history(run: Simulation) -> History:
    curve = {k: np.array([r[k] for r in run.rows]) for k in run.rows[0]}
    energies = {k: np.array([r[k] for r in run.energy_rows]) for k in run.energy_rows[0]}
    failed = sum(curve[f"failed_{name}"] for name in run.model.part_names)
    broken = np.flatnonzero(failed > 0)
    if run.peak_frame is not None:
        run.frames.append(run.peak_frame)
    run.frames.append(_frame(run, run.rows[-1]))
    run.frames.sort(key=lambda f: f.time)
    return History(run.model.mesh, curve, energies, run.frames, int(broken[0]) if len(broken) else None)
