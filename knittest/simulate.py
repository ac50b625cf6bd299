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
from knittest.kernels.explicit import SCRATCH
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Motions, Tally
from knittest.models.explicit_model import ExplicitModel, Stored
from knittest.rigs.base import Rig

Array = NDArray[np.float64]
ProgressCall = Callable[[float, float, float, float], None]

#: steps between looks at displacement, kinetic energy and damping loss
CHUNK = 20
#: multiples of the time a wave needs along the specimen during which a fresh break is damped
RINGING = 4.0
#: energy error before any failure that stops a run, judged once the work is this many times the kinetic energy of the
#: specimen at clamp speed
STOP_ENERGY_ERROR, START_UP_WORK = 0.10, 20.0
#: energy error that stops a run, and the work [mJ] below which the error is not judged
STOP_ENERGY_ERROR = 0.10


@dataclass
class SimulationCost:
    """Steps, time step [ms], time spent advancing [s]; overlap and penetration over radius before failure."""

    steps: int = 0
    time_step: float = 0.0
    advance_s: float = 0.0
    overlap_at_start: float = 0.0
    penetration_max: float = 0.0
    penetration_mean: float = 0.0


@dataclass
class Simulation:
    """State of one run between chunks."""

    model: ExplicitModel
    rig: Rig
    solver: Solver
    motions: Motions
    tally: Tally
    dt: float
    time: float = 0.0
    damping_loss: float = 0.0
    kinetic: float = 0.0
    kinetic_scale: float = 0.0  # of the specimen at clamp speed [mJ]
    loss_rate: float = 0.0  # energy that damping takes in one step [mJ]
    eroded: float = 0.0
    fine: list[tuple[float, Array]] = field(default_factory=list)
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
    run = Simulation(model, rig, solver, motions, tally, dt)
    run.kinetic_scale = 0.5 * float(model.mass.sum()) * solver.kernel("speed") ** 2
    model.nodes.keep[:] = np.exp(-solver.damping * dt)
    run.cost.time_step = dt
    run.cost.overlap_at_start = model.prepare()
    row_steps = max(CHUNK, round(rig.duration / dt / output.samples))
    frame_strains = iter(np.linspace(0.0, 1.0, output.frames + 1)[1:]) if output.frames else iter(())
    scratch = np.zeros((PARTITIONS, SCRATCH))
    run.frames.append(_frame(run, {"strain_pct": 0.0, "force_n": 0.0}))
    next_frame = next(frame_strains, np.inf)
    while run.time < rig.duration:
        row = _record(run, _advance_row(run, row_steps, scratch))
        fraction = run.time / rig.duration
        if fraction >= next_frame:
            run.frames.append(_frame(run, row))
            next_frame = next(frame_strains, np.inf)
        if row["force_n"] > run.peak:
            run.peak, run.peak_frame = row["force_n"], _frame(run, row)
        if progress is not None:
            progress(fraction, run.time, 1e3 * dt, run.energy_rows[-1]["kinetic_ratio"])
        if rig.finished(row["force_n"], run.peak, run.eroded > 0.0):
            break
    return _history(run), run.cost


def _advance_row(run: Simulation, steps: int, scratch: Array) -> Stored:
    """Advance to the next sample; returns the elastic energies one step before, where the kinetic energy is taken."""
    done = 0
    while done < steps - 1:
        chunk = min(run.model.safe_steps(run.dt, CHUNK), steps - 1 - done)
        _advance_chunk(run, chunk, scratch)
        done += chunk
    stored = run.model.stored()
    _advance_chunk(run, 1, scratch)
    return stored


def _advance_chunk(run: Simulation, steps: int, scratch: Array) -> None:
    """Advance, book damping and reactions, check that the state is finite."""
    model, dt = run.model, run.dt
    start = clock.perf_counter()
    model.advance(steps, run.time, dt, run.motions, run.tally, scratch)
    run.time += steps * dt
    run.cost.steps += steps
    kinetic, loss = monitor.kinetic_energy(model.nodes, model.mass, model.inertia, dt)
    run.damping_loss += 0.5 * (run.loss_rate + loss) * steps
    run.kinetic, run.loss_rate = kinetic, loss
    eroded = float(run.tally.energy[:, 2].sum())
    if eroded > run.eroded:
        run.eroded = eroded
        _damp_recoil(run)
    run.fine.append((run.time - 0.5 * steps * dt, run.tally.reaction.sum(axis=0) / steps))
    run.tally.reaction[:] = 0.0
    run.cost.advance_s += clock.perf_counter() - start
    if not np.isfinite(kinetic):
        _blame(run)


def _damp_recoil(run: Simulation) -> None:
    """Damp yarns that broke a moment ago critically, all else as configured.

    A broken yarn, a bar fixed at one end, would ring between its clamp's full pull and push; a load cell and the
    friction among the fibres do not let that be seen. The damping ends before its drag could matter.
    """
    ring = run.rig.ring_time(run.model.wave_speed)
    run.model.nodes.keep[:] = np.exp(-run.solver.damping * run.dt)
    fresh = run.model.broken_nodes(run.time - RINGING * ring)
    if len(fresh):
        run.model.nodes.keep[fresh] = np.exp(-np.pi / ring * run.dt)


def _blame(run: Simulation) -> None:
    """Name the first entity whose state is not finite."""
    position = run.model.position()
    bad = np.flatnonzero(
        ~np.isfinite(position).all(axis=1) | ~np.isfinite(run.model.nodes.velocity[0, : len(position)])
    )
    where = f"node {bad[0]} of {run.model.name_of(int(bad[0]))}" if len(bad) else "a rotation"
    raise NumericalError(
        f"the state is not finite at {run.time:.5f} ms, first at {where}; reduce solver.safety or speed"
    )


def _record(run: Simulation, stored: Stored) -> dict[str, float]:
    """Append one row of the energies; returns the newest curve row with the counts of failed elements."""
    failed = run.model.failed()
    if failed.any():
        _damp_recoil(run)
    row = {"time_ms": run.time, **run.rig.channels(*run.fine[-1])}
    row |= {f"failed_{name}": float(n) for name, n in zip(run.model.mesh.part_names, failed, strict=True)}
    if not failed.any():
        run.cost.penetration_max = max(run.cost.penetration_max, stored.deepest)
        run.cost.penetration_mean = stored.mean_depth
    run.energy_rows.append(_balance(run, stored))
    error, work = run.energy_rows[-1]["energy_error"], abs(run.energy_rows[-1]["external_mj"])
    if error > STOP_ENERGY_ERROR and work > START_UP_WORK * run.kinetic_scale and not failed.any():
        raise NumericalError(
            f"the energy balance is off by {100.0 * error:.0f} % at {run.time:.4f} ms, before anything failed; "
            "reduce solver.safety or solver.speed"
        )
    run.rows.append(row)
    return row


def _balance(run: Simulation, stored: Stored) -> dict[str, float]:
    external, friction, eroded = (float(v) for v in run.tally.energy.sum(axis=0))
    elastic = float(stored.internal.sum()) + stored.contact + stored.hourglass
    error = external - elastic - friction - eroded - run.damping_loss - run.kinetic
    largest = max([abs(external), *(abs(r["external_mj"]) for r in run.energy_rows[-1:])])
    parts = {
        f"internal_{name}_mj": float(v) for name, v in zip(run.model.mesh.part_names, stored.internal, strict=True)
    }
    return {
        "time_ms": run.time,
        "kinetic_mj": run.kinetic,
        **parts,
        "hourglass_mj": stored.hourglass,
        "contact_mj": stored.contact,
        "friction_mj": friction,
        "damping_mj": run.damping_loss,
        "eroded_mj": eroded,
        "external_mj": external,
        "balance_error_mj": error,
        "kinetic_ratio": run.kinetic / max(elastic + friction, 1e-9),
        "energy_error": abs(error) / max(largest, 1e-9),
    }


def _frame(run: Simulation, row: dict[str, float]) -> Frame:
    return Frame(run.time, row["strain_pct"] / 100.0, row["force_n"], run.model.position(), run.model.fields())


def _fine_curve(run: Simulation, coarse: dict[str, Array]) -> dict[str, Array]:
    """Curve at chunk resolution, so that sudden drops do not blunt the peak; failure counts from the samples."""
    rows = [run.rig.channels(*f) for f in run.fine]
    time = np.array([t for t, _ in run.fine])
    curve = {"time_ms": time} | {k: np.array([r[k] for r in rows]) for k in rows[0]}
    last = np.searchsorted(coarse["time_ms"], time).clip(max=len(coarse["time_ms"]) - 1)
    return curve | {k: v[last] for k, v in coarse.items() if k.startswith("failed_")}


def _history(run: Simulation) -> History:
    coarse = {k: np.array([r[k] for r in run.rows]) for k in run.rows[0]}
    curve = _fine_curve(run, coarse)
    energies = {k: np.array([r[k] for r in run.energy_rows]) for k in run.energy_rows[0]}
    broken = np.flatnonzero(sum(coarse[f"failed_{name}"] for name in run.model.mesh.part_names))
    if run.peak_frame is not None:
        run.frames.append(run.peak_frame)
    run.frames.append(_frame(run, run.rows[-1]))
    run.frames.sort(key=lambda f: f.time)
    return History(run.model.mesh, curve, energies, run.frames, int(broken[0]) if len(broken) else None)
