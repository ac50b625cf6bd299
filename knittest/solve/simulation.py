"""Simulation of a test in chunks of steps: contacts, energies, checks, frames, progress, checkpoints."""

import time as clock
from collections.abc import Callable
from dataclasses import replace
from math import ceil

import numpy as np
from numba import get_num_threads

from knittest.base.arrays import Array
from knittest.base.errors import NumericalError
from knittest.base.history import Frame, History
from knittest.base.kinds import check_method_names
from knittest.config.run import Output, Solver
from knittest.kernels.threading import limit_threads
from knittest.kernels.tool_contact import tool_energies
from knittest.models.boundary import Boundary, Readings, new_tally, take_readings
from knittest.models.crossings import initial_equilibrium
from knittest.models.explicit_model import ExplicitModel, StoredEnergies
from knittest.solve.guards import check_balance, check_entities, check_motion, fit_step
from knittest.solve.relaxation import Relaxation, relax, relax_held, settle
from knittest.solve.state import LOCKED, SILENT, TESTING, EarlierFrame, Observer, Rig, Simulation, SimulationCost

#: share by which the force must have grown for a new frame of the peak
NEAR_PEAK = 0.001
#: residual of a specimen at rest after its mounting, and most steps until then, also of soft yarns
MOUNTED, MOUNTING, MOUNTING_SOFT = 0.002, 20000, 80000
#: residual of a specimen that is relaxed at the end of a row, and most steps until then
RELAXED_ROW, RELAXING_ROW = 0.002, 60000
#: rows of the start that do not count where yarns lock
START_ROWS = 40
#: steps between looks at the stable time step
STEP_LOOKS = 80
#: multiples of the time a wave needs along the specimen during which a fresh break is damped
RINGING = 4.0


def simulate(
    model: ExplicitModel,
    rig: Rig,
    solver: Solver,
    output: Output,
    observer: Observer = SILENT,
    check_speed: Callable[[Simulation], None] | None = None,
) -> tuple[History, SimulationCost]:
    """Run ``rig`` on ``model`` to its end, or from the state that ``observer`` resumes from.

    ``check_speed`` sees the simulation after each row and may raise :class:`TooFastError`. Raises
    :class:`NumericalError` when the state is no longer finite, blows up or is ill otherwise
    (:mod:`knittest.solve.guards`); its ``partial`` holds the history until then.
    """
    with limit_threads(get_num_threads()):
        run = _begin(model, rig, solver, observer)
        try:
            _run_rows(run, output, observer, check_speed)
        except NumericalError as error:
            observer.visit_failure(run.snapshot)
            if run.rows:
                error.partial = _history(run), run.cost
            raise
    run.cost.threads = run.pace.usual_threads
    return _history(run), run.cost


def _begin(model: ExplicitModel, rig: Rig, solver: Solver, observer: Observer) -> Simulation:
    """State at the start, or the state to resume from."""
    dt = solver.safety * model.critical_step  # as in Simulation.first_step
    check_method_names(type(rig), {"finished": "is_finished"})
    boundary = Boundary(model, dt)
    rig.constrain(boundary)
    run = Simulation(model, boundary.drive(), new_tally(boundary), dt, rig=rig, solver=solver)
    run.kinetic_scale = 0.5 * float(model.mass.sum()) * solver.speed_mm_per_ms**2
    model.nodes.damping_factor[:] = run.rest_damping_factor
    run.cost.time_step = run.dt
    run.overlaps, run.tool_force = model.prepare(), np.zeros_like(run.drive.touch.pressure)
    observer.overlaps(run.overlaps)
    snapshot = observer.resume_from()
    run.start_energy = _elastic_energies(_stored_energies(run))
    if snapshot is None:
        residual = np.nan
        if model.prestressed:
            observer.phase("relaxing the specimen before the test")
            residual = settle(model, run.drive, run.tally, dt, _relaxation_progress(observer)).residual
            run.start_energy = _elastic_energies(_stored_energies(run))
        run.rest = initial_equilibrium(model, residual)
        run.frames.append(_frame(run, {run.rig.coordinate: 0.0, run.rig.force: 0.0}))
        return run
    run.restore(snapshot)
    run.cost.time_step = run.dt
    observer.report_resume(min(run.rig.share_done(run.time), 1.0), run.time)  # the last chunk may end a little later
    before = float(snapshot.state["run/rest_damping_factor"])
    if before != run.rest_damping_factor:  # a forced restart with another step or damping
        _damp_recoil(run)
    return run


def _run_rows(
    run: Simulation, output: Output, observer: Observer, check_speed: Callable[[Simulation], None] | None
) -> None:
    """Advance row by row to the end of the test, once the specimen is mounted."""
    _mount(run, observer)
    observer.phase(TESTING)
    row_steps = max(run.model.chunk, round(run.rig.duration / run.first_step / output.samples))
    if run.rig.relaxed_rows:  # few long rows: the last one ends where the motion does
        row_steps = max(run.model.chunk, ceil(run.rig.duration / run.first_step / run.rig.relaxed_rows))
    # the first frame is the start; one row takes one frame at most
    even = np.linspace(0.0, 1.0, output.frames + 1)
    marks = [*sorted({*even.tolist(), *run.rig.marks}), np.inf]
    while run.time < run.rig.duration or run.row_steps > 0:  # a row once begun is finished, also after a restart
        steps = row_steps
        if run.rig.relaxed_rows:  # also after the time step was shortened
            steps = max(min(row_steps, ceil((run.rig.duration - run.time) / run.dt)), 2)
        stored = _advance_row(run, steps, observer)
        relaxed = _relax_row(run, stored) if run.rig.relaxed_rows else None
        row = _record(run, stored if relaxed is None else _stored_energies(run), relaxed)
        if check_speed is not None:
            check_speed(run)
        run.rig.adjust(run)
        fraction = run.rig.share_done(run.time)
        if fraction >= marks[len(run.frames)]:
            run.frames.append(_frame(run, row))
        force = row[run.rig.force]
        run.peak = max(run.peak, force)
        observer.progress(fraction, run.time, 1e3 * run.dt, run.energy_rows[-1]["kinetic_ratio"])
        if run.rig.is_finished(force, run.peak, run.eroded > 0.0) or (
            run.rig.locks and is_locked(run.energy_rows, run.rig.locked_share)
        ):
            break
        observer.visit(run.snapshot)


def _mount(run: Simulation, observer: Observer) -> None:
    """Mount the specimen and relax it; energies count from there on.

    Slack that a frame takes up makes yarns buckle, which takes longer than the motion of the frame. Without the rest
    they would swing through the test.
    """
    if run.time >= run.rig.mounted_at:
        return
    observer.phase("mounting the specimen")
    while run.time < run.rig.mounted_at:
        steps = min(run.model.safe_steps(run.dt, run.model.chunk), ceil((run.rig.mounted_at - run.time) / run.dt))
        run.step(steps)
        run.cost.steps += steps
        check_motion(run, run.work()[0], lambda: _released_energy(run))
        if run.time < run.rig.mounted_at:  # a run resumed at its end would not relax
            observer.visit(run.snapshot)
    relax(
        run.model,
        run.drive,
        run.tally,
        run.dt,
        MOUNTED,
        MOUNTING_SOFT if run.model.compliant else MOUNTING,
        at=run.rig.mounted_at,
        look=_relaxation_progress(observer),
    )
    for sums in run.tally:
        sums[:] = 0.0
    run.kinetic, run.loss_rate, run.damping_loss = 0.0, 0.0, 0.0
    run.start_energy = _elastic_energies(_stored_energies(run))
    run.frames[:] = [_frame(run, {run.rig.coordinate: 0.0, run.rig.force: 0.0})]


def _relax_row(run: Simulation, stored: StoredEnergies) -> Relaxation:
    """Relax the model at the end of a row while all motions are held.

    The row records this state of equilibrium only. Neither inertia nor damping bears any force in it. ``stored`` are
    the energies before. The energy that the relaxation takes, with the kinetic energy before it, is recorded apart from
    damping.
    """
    before = _balance(run, stored)["balance_error_mj"]
    damped = run.tally.energy[:, 3].copy()
    run.moving_energy = run.kinetic
    found = relax_held(run.model, run.drive, run.tally, run.dt, RELAXED_ROW, RELAXING_ROW, run.rig.rest_force)
    run.cost.steps += found.steps
    run.tally.energy[:, 3] = damped
    run.kinetic, run.loss_rate = 0.0, 0.0
    run.relaxation_loss += max(_balance(run, _stored_energies(run))["balance_error_mj"] - before, 0.0)
    run.samples[len(run.rows) :] = [(run.time, take_readings(run.tally, run.drive, found.last_chunk))]
    _keep_peak(run)
    return found


def _relaxation_progress(observer: Observer) -> Callable[[int, float], None]:
    """Callback that reports the share of the relaxation steps to ``observer``."""
    return lambda steps, most: observer.relaxation_progress(steps / most)


def _advance_row(run: Simulation, steps: int, observer: Observer) -> StoredEnergies:
    """Advance to the next sample; returns the elastic energies one step before, where the kinetic energy is taken."""
    while run.row_steps < steps - 1:
        chunk = min(run.model.safe_steps(run.dt, run.model.chunk), steps - 1 - run.row_steps)
        _advance_chunk(run, chunk)
        run.row_steps += chunk
        if run.row_steps < steps - 1:
            observer.visit(run.snapshot)
    stored = _stored_energies(run)
    _advance_chunk(run, 1)
    run.row_steps = 0
    return stored


def _stored_energies(run: Simulation) -> StoredEnergies:
    """Elastic energies of the model and of its contacts with tools."""
    drive = run.drive
    elastic, kinetic, deepest = tool_energies(run.model.nodes, drive.tools, drive.touch, run.model.n_nodes)
    return replace(run.model.stored_energies(), tools=elastic, tool_kinetic=kinetic, tool_depth=deepest)


def _elastic_energies(stored: StoredEnergies) -> Array:
    """Elastic energies [mJ]: of parts, of contacts, those with tools, of hourglass control, of mechanisms by part."""
    others = np.array([stored.contact + stored.tools, stored.tools, stored.hourglass])
    return np.concatenate([stored.internal, others, *stored.mechanisms.values()])


def _released_energy(run: Simulation) -> float:
    """Elastic energy [mJ] that parts and contacts have lost since the start."""
    parts = len(run.model.mesh.part_names)
    return float((run.start_energy - _elastic_energies(_stored_energies(run)))[: parts + 1].sum())


def _advance_chunk(run: Simulation, steps: int) -> None:
    start = clock.perf_counter()
    run.step(steps)
    run.cost.steps += steps
    work, _, eroded, _ = run.work()
    if eroded > run.eroded:
        run.eroded = eroded
        _damp_recoil(run)
    run.samples.append((run.time - 0.5 * steps * run.dt, take_readings(run.tally, run.drive, steps)))
    if not run.rig.relaxed_rows:
        _keep_peak(run)
    run.cost.advance_s += clock.perf_counter() - start
    check_motion(run, work, lambda: _released_energy(run))
    if steps > 1:  # the single step of a sample follows a look at all entities
        check_entities(run)
    if run.cost.steps % STEP_LOOKS < steps:
        fit_step(run)


def _keep_peak(run: Simulation) -> None:
    """Keep the state as that of the largest force if it has grown.

    Clamps feel a break when its wave arrives, so that a strip torn in its middle still pulls with its largest force:
    what follows a break counts from the next row on.
    """
    channels = _channels(run, *run.samples[-1])
    if not is_new_peak(channels[run.rig.force], 0.0 if run.at_peak is None else run.at_peak.force):
        return
    before = sum(v for name, v in run.rows[-1].items() if name.startswith("failed_")) if run.rows else 0.0
    if run.model.count_failed().sum() <= before:
        coordinate, force = channels[run.rig.coordinate], channels[run.rig.force]
        run.at_peak = EarlierFrame(run.time, coordinate, force, run.model.nodes.position.copy())


def is_locked(energies: list[dict[str, float]], share: float = LOCKED) -> bool:
    """Return whether yarns have locked: they press into each other with more than a ``share`` of the work.

    The penalty then bears what compaction of the yarns would, which rigid sections do not have.
    """
    work = max(row["external_mj"] for row in energies)
    return len(energies) > START_ROWS and energies[-1]["contact_mj"] > share * work


def is_new_peak(force: float, kept: float) -> bool:
    """Return whether a state at ``force`` is worth a frame where the last one shows ``kept`` [N]."""
    return force > 0.0 and force > (1.0 + NEAR_PEAK) * kept


def _damp_recoil(run: Simulation) -> None:
    """Damp yarns that broke a moment ago critically, all else as configured.

    A broken yarn, a bar fixed at one end, would ring between its clamp's full pull and push; a load cell and the
    friction among the fibres do not let that be seen. The damping ends before its drag could matter.
    """
    ring = run.rig.ring_time(run.model.wave_speed)
    run.model.nodes.damping_factor[:] = run.rest_damping_factor
    fresh = run.model.broken_nodes(run.time - RINGING * ring)
    if len(fresh):
        run.model.nodes.damping_factor[fresh] = np.exp(-np.pi / ring * run.dt)


def _channels(run: Simulation, time: float, row: Array) -> dict[str, float]:
    return run.rig.channels(time, Readings.of(row, run.drive.tools.kind.size))


def _record(run: Simulation, stored: StoredEnergies, relaxed: Relaxation | None = None) -> dict[str, float]:
    """Append one row of the energies, of the ``relaxed`` state if there is one; returns the newest curve row with the
    counts of failed elements.
    """
    failed = run.model.count_failed()
    if failed.any():
        _damp_recoil(run)
    row = {"time_ms": run.time, **_channels(run, *run.samples[-1])}
    row |= {f"failed_{name}": float(n) for name, n in zip(run.model.mesh.part_names, failed, strict=True)}
    if not failed.any():
        run.cost.penetration_max = max(run.cost.penetration_max, float(stored.penetration.max(initial=0.0)))
        run.cost.penetration_mean = float(stored.penetration.mean()) if len(stored.penetration) else 0.0
    if run.time >= run.rig.averaged_from:
        run.tool_force += run.drive.touch.pressure
        run.tool_rows += 1
    run.contact_rows.append(
        _contacts(run, stored) | ({} if relaxed is None else {"residual_pct": 100.0 * relaxed.residual})
    )
    run.energy_rows.append(_balance(run, stored))
    run.rows.append(row)
    check_balance(run)
    return row


def _contacts(run: Simulation, stored: StoredEnergies) -> dict[str, float]:
    """Penetration of yarns into each other and into tools."""
    share = 100.0 * stored.penetration
    middle = np.percentile(share, (50, 90, 99)) if len(share) else np.zeros(3)
    return {
        "time_ms": run.time,
        "yarn_contacts": float(len(share)),
        "penetration_max_pct": float(share.max(initial=0.0)),
        "penetration_mean_pct": float(share.mean()) if len(share) else 0.0,
        **{f"penetration_p{p}_pct": float(v) for p, v in zip((50, 90, 99), middle, strict=True)},
        "force_free_overlap_max_pct": 100.0 * stored.force_free[0],
        "force_free_at_ends_max_pct": 100.0 * stored.force_free[1],
        "found_late_max_pct": 100.0 * float(run.tally.late[0]),
        "tool_contacts": float(np.count_nonzero(run.drive.touch.pressure)),
        "tool_penetration_max_um": 1e3 * stored.tool_depth,
    }


def _balance(run: Simulation, stored: StoredEnergies) -> dict[str, float]:
    external, friction, eroded, damped = run.work()
    names = run.model.mesh.part_names
    found = _elastic_energies(stored) - run.start_energy
    internal, (contact, tools, hourglass), mechanisms = np.split(found, (len(names), len(names) + 3))
    labels = [f"{mechanism}_{name}_mj" for mechanism in stored.mechanisms for name in names]
    kinetic = run.kinetic + stored.tool_kinetic
    elastic = float(sum(internal)) + float(contact) + float(hourglass)
    damping = run.damping_loss - run.guide_energy
    error = external + run.recovered_energy - elastic - friction - damped - eroded - damping - kinetic
    largest = max([abs(external), *(abs(r["external_mj"]) for r in run.energy_rows[-1:])])
    spent, relaxed = elastic + friction, {}
    if run.rig.relaxed_rows:  # loops that start to move give energy of their own, and little work may be done on them
        error, kinetic = error - run.relaxation_loss, run.moving_energy
        largest = max([abs(external) + max(-elastic, 0.0), *(r["energy_input_mj"] for r in run.energy_rows[-1:])])
        spent, relaxed = largest, {"relaxation_mj": run.relaxation_loss, "energy_input_mj": largest}
    parts = {f"internal_{name}_mj": float(v) for name, v in zip(names, internal, strict=True)}
    return {
        "time_ms": run.time,
        "kinetic_mj": kinetic,
        **parts,
        **{label: float(v) for label, v in zip(labels, mechanisms, strict=True)},
        "hourglass_mj": float(hourglass),
        "contact_mj": float(contact),
        "contact_tools_mj": float(tools),
        "friction_mj": friction,
        **{f"friction_{where}_mj": lost for where, lost in run.friction_losses().items()},
        "contact_damping_mj": damped,
        "contact_recovery_mj": run.recovered_energy,
        "damping_mj": damping,
        "eroded_mj": eroded,
        "external_mj": external,
        **relaxed,
        "balance_error_mj": error,
        "kinetic_ratio": kinetic / max(spent, 1e-9),
        "energy_error": abs(error) / max(largest, 1e-9),
    }


def _frame(run: Simulation, row: dict[str, float]) -> Frame:
    return Frame(run.time, row[run.rig.coordinate], row[run.rig.force], run.model.position(), run.model.fields())


def _peak_frame(run: Simulation) -> Frame | None:
    """The frame of the largest force; none where nothing pulled."""
    kept, n_nodes = run.at_peak, run.model.n_nodes
    if kept is None:
        return None
    place = np.ascontiguousarray(kept.position[:, :n_nodes].T)
    return Frame(kept.time, kept.coordinate, kept.force, place, run.model.fields(kept.position, kept.time))


def _fine_curve(run: Simulation, coarse: dict[str, Array]) -> dict[str, Array]:
    """Curve at chunk resolution, so that sudden drops do not blunt the peak; failure counts from the samples."""
    rows = [_channels(run, *f) for f in run.samples]
    time = np.array([t for t, _ in run.samples])
    curve = {"time_ms": time} | {k: np.array([r[k] for r in rows]) for k in rows[0]}
    last = np.searchsorted(coarse["time_ms"], time).clip(max=len(coarse["time_ms"]) - 1)
    return curve | {k: v[last] for k, v in coarse.items() if k.startswith("failed_")}


def _history(run: Simulation) -> History:
    coarse = {k: np.array([r[k] for r in run.rows]) for k in run.rows[0]}
    curve = _fine_curve(run, coarse)
    energies = {k: np.array([r[k] for r in run.energy_rows]) for k in run.energy_rows[0]}
    broken = np.flatnonzero(sum(coarse[f"failed_{name}"] for name in run.model.mesh.part_names))
    run.frames.append(_frame(run, run.rows[-1]))
    at_peak = _peak_frame(run)
    if at_peak is not None:
        run.frames.append(at_peak)
    run.frames.sort(key=lambda f: f.time)
    peak = next((k for k, frame in enumerate(run.frames) if frame is at_peak), None)
    contacts = {k: np.array([r[k] for r in run.contact_rows]) for k in run.contact_rows[0]}
    return History(
        run.model.mesh, curve, energies, run.frames, int(broken[0]) if len(broken) else None, contacts,
        run.tool_force / run.tool_rows if run.tool_rows else run.drive.touch.pressure.copy(), run.overlaps, peak,
        run.rest,
    )  # fmt: skip
