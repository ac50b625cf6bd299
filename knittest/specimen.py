"""One specimen of a tensile test end to end: geometry, model, simulation, results, quality."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, floor

import numpy as np

from knittest.config.fabric import Direction
from knittest.config.run import Run
from knittest.experiment.curves import load_curve
from knittest.fabric.relax import relaxed_cell
from knittest.fabric.strip import strip, wave_elements, wave_scale
from knittest.fabric.variability import YarnDraws, draw
from knittest.history import Cost, History, Quality
from knittest.materials.laminate import laminate
from knittest.measure import assess, tensile_results
from knittest.models.explicit_model import ExplicitModel
from knittest.models.macro import build_strip
from knittest.models.meso import build_meso
from knittest.resources import data_dir
from knittest.rigs.tensile import TensileTest
from knittest.simulate import simulate
from knittest.simulation import Keeper, SimulationCost
from knittest.warmup import warm

Phase = Callable[[str], None]
Update = Callable[[float, float, float, float], None]

#: pitches of the pattern inside each clamp of a meso model: enough to grip every yarn
JAW_PITCHES = 1
AXIS = {"warp": 1, "weft": 0}


@dataclass(frozen=True)
class Specimen:
    """Outcome of one specimen."""

    history: History
    results: dict[str, float]
    quality: Quality
    cost: Cost
    yarns: dict[str, np.ndarray]


@dataclass(frozen=True)
class Prepared:
    """A model with its rig; ``n_yarns`` lie along the strip."""

    model: ExplicitModel
    rig: TensileTest
    n_yarns: int
    geometry_s: float
    yarns: dict[str, np.ndarray]


def yarns_across(run: Run, direction: Direction, specimen: int) -> int:
    """Whole yarns of ``direction`` in the width; a fractional count goes down or up, alternately in an ensemble."""
    exact = run.rig.kernel("width") * run.fabric.kernel(f"{direction}_density")
    if abs(exact - round(exact)) < 0.25:
        return max(round(exact), 1)
    up = (run.rig.yarn_rounding == "up") != (run.variability.specimens > 1 and specimen % 2 == 1)
    return max(ceil(exact) if up else floor(exact), 1)


def prepare(run: Run, specimen: int = 0, phase: Phase | None = None) -> Prepared:
    """Build model and rig of specimen number ``specimen``; ``phase`` is told what takes time."""
    return _prepare_meso(run, specimen, phase) if run.model.scale == "meso" else _prepare_macro(run, specimen)


def _prepare_macro(run: Run, specimen: int) -> Prepared:
    directions: tuple[Direction, Direction] = ("warp", "weft")
    curves = {d: _tension_curve(run, d) for d in directions}
    direction = run.rig.direction
    model = build_strip(
        run.fabric, laminate(run.fabric, curves), direction, run.rig.kernel("gauge_length"), run.rig.kernel("width"),
        run.rig.kernel("jaw_length"), run.model.macro.kernel("element_size"), run.model.macro.kernel("imperfection"),
        run.variability.seed + specimen,
    )  # fmt: skip
    rig = TensileTest(run, axis=1, gauge=run.rig.kernel("gauge_length"))
    return Prepared(model, rig, yarns_across(run, direction, specimen), 0.0, {})


def _tension_curve(run: Run, direction: Direction) -> tuple[np.ndarray, np.ndarray]:
    curve = load_curve(data_dir() / run.fabric.macro.tension[direction])
    return curve.x, curve.mean


def _prepare_meso(run: Run, specimen: int, phase: Phase | None) -> Prepared:
    start = clock.perf_counter()
    if phase is not None:
        phase("relaxing geometry")
    cell = relaxed_cell(run.fabric)
    direction = run.rig.direction
    pitch = run.fabric.course_spacing if direction == "warp" else run.fabric.wale_spacing
    along = max(round(run.rig.kernel("gauge_length") / pitch), 1)
    across = yarns_across(run, direction, specimen)
    n_wales, n_courses = (across, along + 2 * JAW_PITCHES) if direction == "warp" else (along + 2 * JAW_PITCHES, across)
    counts = {"warp": n_wales, "weft": n_courses, "knit": n_courses}
    draws = {s: draw(run.fabric, run.variability, s, n, specimen) for s, n in counts.items()}
    # a yarn's weakest place lies between the clamps
    grip = (JAW_PITCHES + 0.5) / (along + 2 * JAW_PITCHES)
    draws[direction] = replace(draws[direction], weakest=grip + (1.0 - 2.0 * grip) * draws[direction].weakest)
    table = _yarn_table(draws)
    draws |= {s: _slack_as_wave(run, s, draws[s]) for s in AXIS}
    mesh = run.model.meso
    amplitude = {
        s: wave_scale(cell, s, wave_elements(cell, s, mesh.elements_per_wave)) * draws[s].amplitude for s in AXIS
    }
    paths = strip(cell, n_wales, n_courses, mesh.elements_per_loop, mesh.elements_per_wave, amplitude)
    if not run.model.meso.knitting:
        paths = [p for p in paths if p.system != "knit"]
    rig = TensileTest(run, AXIS[direction], gauge=along * pitch)
    model = build_meso(run, paths, draws)
    return Prepared(model, rig, across, clock.perf_counter() - start, table)


def _slack_as_wave(run: Run, system: str, draws: YarnDraws) -> YarnDraws:
    """Add the slack of wavy yarns to their wave, as length that straightens first; straight yarns keep it in their law.

    A law that carries nothing up to the slack makes a yarn a row of loose links, which rattle when they are pulled.
    """
    crimp = run.fabric.reinforcing.kernel("crimp", system)
    if crimp <= 0.0:
        return draws
    wider = np.sqrt(1.0 + draws.slack / crimp)
    return replace(draws, amplitude=draws.amplitude * wider, slack=np.zeros_like(draws.slack))


def _yarn_table(draws: dict[str, YarnDraws]) -> dict[str, np.ndarray]:
    systems = list(draws)
    return {
        "system": np.concatenate([[s] * len(draws[s].slack) for s in systems]),
        "yarn": np.concatenate([np.arange(1, len(draws[s].slack) + 1) for s in systems]),
        "fracture_strain_pct": np.concatenate([100.0 * draws[s].fracture_strain for s in systems]),
        "slack_pct": np.concatenate([100.0 * draws[s].slack for s in systems]),
        "wave_amplitude_relative": np.concatenate([draws[s].amplitude for s in systems]),
    }


def run_specimen(
    run: Run,
    specimen: int = 0,
    phase: Phase | None = None,
    update: Update | None = None,
    keeper: Keeper | None = None,
) -> Specimen:
    """Build, compile, simulate and measure one specimen; ``keeper`` keeps its checkpoints."""
    start, cpu = clock.perf_counter(), clock.process_time()
    prepared = prepare(run, specimen, phase)
    compile_s = warm(run, phase)
    if phase is not None:
        phase(f"pulling {run.rig.direction}")
    history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, update, keeper)
    quality = assess(history, run.solver, cost.penetration_max, cost.penetration_mean, prepared.model.added_mass)
    elements = len(prepared.model.mesh.cells)
    return Specimen(
        history,
        tensile_results(history.curve, prepared.n_yarns),
        quality,
        _cost(cost, elements, clock.perf_counter() - start, clock.process_time() - cpu, compile_s, prepared.geometry_s),
        prepared.yarns,
    )


def _cost(cost: SimulationCost, elements: int, wall: float, cpu: float, compile_s: float, geometry_s: float) -> Cost:
    import numba

    return Cost(
        wall, cpu, compile_s, geometry_s, cost.steps, elements, cost.steps * elements / max(cost.advance_s, 1e-9),
        numba.get_num_threads(), 1e3 * cost.time_step,
    )  # fmt: skip
