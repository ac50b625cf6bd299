"""Cantilever: a strip bends over an edge under its own weight; found at rest by dynamic relaxation.

Loads of gravity are small against the membrane stiffness, which only limits the step: a share of it is kept. The strip
starts flat, from its root on. Heavy elastica: w L^3 / B = 8.0042 at a chord angle of 41.5 deg, so that Eq. 2 of Pham
et al. (2019), B = w (L / 2)^3, holds within 0.05 %.
"""

import time as clock
from dataclasses import dataclass
from math import atan2, degrees

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import CantileverRun
from knittest.errors import InputError
from knittest.experiment.tables import published
from knittest.history import Frame, History, Quality
from knittest.kernels.shell_state import Laminate
from knittest.laboratory.base import Phase, Prepared, Update, fabric_laminate
from knittest.models.boundary import Boundary, Readings, new_tally
from knittest.models.explicit_model import ExplicitModel
from knittest.models.macro import build_rectangle
from knittest.relaxation import Relaxation, relax
from knittest.resources import data_dir
from knittest.simulation import Keeper, SimulationCost

Array = NDArray[np.float64]

#: width to which bending stiffnesses of a strip refer [mm]
STRIP_WIDTH = 50.0
#: chord angle error at which the laboratory's mode has found its overhang [deg], and most relaxations it may take
ANGLE_TOLERANCE, MOST_TRIALS = 0.05, 8
#: largest deviation between the root's moment and that of gravity
MOMENT_TOLERANCE = 0.01


@dataclass
class Rest:
    """A strip at rest: chord angle [deg], moment of the root about the edge and that of the weight [N mm], curvature at
    the root [1/mm], and how it came to rest.
    """

    overhang: float
    angle: float
    root_moment: float
    weight_moment: float
    curvature: float
    relaxation: Relaxation
    frames: tuple[Frame, Frame]


class Mounting:
    """A strip along y, held behind its edge at 0; ``weight`` [N] of each node."""

    coordinate, force = "chord_angle_deg", "root_moment_nmm"
    marks: tuple[float, ...] = ()
    duration = 0.0

    def __init__(self, weight: Array) -> None:
        self.weight = weight

    def constrain(self, boundary: Boundary) -> None:
        """Hold the root; the groups of reactions add up to its moment about the edge (scales are lever arms)."""
        position = boundary.model.position()
        along, height = position[:, 1], position[:, 2]
        held = np.flatnonzero(along <= 1e-6)
        boundary.move(held, "z", scale=along[held])
        boundary.move(held, "y", scale=-height[held])
        boundary.move(held, ["rx"])
        boundary.move(held, ["x", "ry", "rz"])
        boundary.gravity(self.weight)

    def ring_time(self, wave_speed: float) -> float:
        """Nothing rings at rest."""
        return 1.0

    def channels(self, time: float, readings: Readings) -> dict[str, float]:
        """There is no time at rest."""
        return {}

    def finished(self, force: float, peak: float, broken: bool) -> bool:
        """There is no time at rest."""
        return True


class Cantilever:
    """See :class:`knittest.laboratory.base.Test`."""

    quantities = ("overhang_mm",)

    def prepare(self, run: CantileverRun, specimen: int = 0, phase: Phase | None = None) -> Prepared:
        """The strip flat over the edge, at the given or measured overhang."""
        if run.model.scale == "meso":
            raise InputError(
                "model.scale = meso: not offered for the cantilever yet: the loops of the relaxed cell carry no "
                "tension and slide off the free end; use --scale macro"
            )
        overhang = given_overhang(run)
        if overhang >= run.rig.length:
            raise InputError(
                f"rig.overhang = {overhang:g} mm: longer than the strip, expected less than rig.length = "
                f"{run.rig.length:g} mm"
            )
        return mount(run, overhang)

    def solve(
        self, prepared: Prepared, run: CantileverRun, update: Update | None, keeper: Keeper | None
    ) -> tuple[History, SimulationCost]:
        """Come to rest; in the laboratory's mode, at overhangs that lead to the angle of the plane."""
        cost, start = SimulationCost(), clock.perf_counter()
        rests = [come_to_rest(prepared, run, cost)]
        while run.rig.mode == "overhang" and abs(rests[-1].angle - run.rig.plane_angle) > ANGLE_TOLERANCE:
            if len(rests) == MOST_TRIALS:
                break
            longer = _next_overhang(rests, run.rig.plane_angle)
            if longer >= run.rig.length:
                raise InputError(
                    f"rig.length = {run.rig.length:g} mm: the strip does not reach the plane at "
                    f"{run.rig.plane_angle:g} deg; expected a longer or a softer one"
                )
            rests.append(come_to_rest(mount(run, longer), run, cost))
            if update is not None:
                update(len(rests) / MOST_TRIALS, 0.0, 1e3 * cost.time_step, 0.0)
        cost.advance_s = clock.perf_counter() - start
        return _history(prepared.model, rests), cost

    def results(self, run: CantileverRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Chord angle, overhang and both measures of the bending stiffness."""
        last = {name: float(values[-1]) for name, values in history.energies.items()}
        overhang = last["overhang_mm"]
        return {
            "chord_angle_deg": last["chord_angle_deg"],
            "overhang_mm": overhang,
            "bending_stiffness_mncm2": strip_stiffness(run, overhang) * 10.0,
            "bending_stiffness_n_mm_per_width": last["root_moment_nmm"] / last["root_curvature_per_mm"] / width(run),
            "moment_error_pct": 100.0 * abs(last["root_moment_nmm"] / last["weight_moment_nmm"] - 1.0),
            "residual": last["residual"],
        }

    def assess(self, run: CantileverRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """Rest: residual and drift below the tolerance, and the root carries the moment of the weight."""
        last = {name: float(values[-1]) for name, values in history.energies.items()}
        moment = abs(last["root_moment_nmm"] / last["weight_moment_nmm"] - 1.0)
        failures = []
        if not last["converged"]:
            failures.append(f"not at rest after {last['steps']:.0f} steps: residual {last['residual']:.2g}")
        if moment > MOMENT_TOLERANCE:
            failures.append(f"the root's moment is off that of the weight by {100.0 * moment:.1f} %")
        return Quality(0.0, moment, 0.0, 0.0, 0.0, not failures, tuple(failures))


def width(run: CantileverRun) -> float:
    """Width of the strip [mm]."""
    return run.rig.kernel("width")


def given_overhang(run: CantileverRun) -> float:
    """Overhang of the run, else the mean measured one [mm]."""
    if run.rig.overhang is not None:
        return run.rig.kernel("overhang")
    fabric = run.fabric
    if fabric.experiment is not None and fabric.experiment_variant is not None:
        folder = data_dir() / fabric.experiment
        rows = published(folder, fabric.experiment_variant, run.rig.direction, ("overhang_mm",))
        if rows:
            return rows[0].mean
    raise InputError("rig.overhang: missing, and the fabric names no experiment with a measured overhang; set it in mm")


def strip_stiffness(run: CantileverRun, overhang: float) -> float:
    """B = w (L / 2)^3 of a strip 50 mm wide [N mm^2] (Eq. 2): 1 N mm^2 is 10 mN cm^2."""
    return run.fabric.kernel("area_mass") * run.rig.kernel("gravity") * STRIP_WIDTH * (0.5 * overhang) ** 3


def _weights(run: CantileverRun, model: ExplicitModel, area: float) -> Array:
    """Weight of each node [N]: the measured area mass, spread as the model's mass."""
    given = run.fabric.kernel("area_mass") * area
    return model.mass * (given / model.mass.sum()) * run.rig.kernel("gravity")


def mount(run: CantileverRun, overhang: float) -> Prepared:
    """The strip flat, its edge at 0."""
    size = run.model.macro.kernel("element_size")
    rows = max(round(overhang / size), 4)
    step = overhang / rows
    y = np.concatenate([[-step], step * np.arange(rows + 1)])
    soft = _softened(fabric_laminate(run), run.rig.membrane_share)
    model = build_rectangle(run.fabric, soft, run.rig.direction, y, width(run), size)
    area = width(run) * (overhang + step)
    test = Mounting(_weights(run, model, area))
    return Prepared(model, test, facts={"overhang_mm": overhang, "area_mm2": area})


def _softened(card: Laminate, share: float) -> Laminate:
    """A share of the membrane stiffness, with the same bending; the outer layers' part cannot be less than itself."""
    slope = card.slope * share
    slope[:, 0] -= 2.0 * card.outer * (1.0 - share)
    total = 2.0 * card.outer + np.cumsum(slope, axis=1).min(axis=1)
    if (total <= 2.0 * card.outer).any():
        raise InputError(
            f"rig.membrane_share = {share:g}: leaves less membrane stiffness than bending needs; expected more"
        )
    return card._replace(slope=slope, compression=np.maximum(slope[:, 0], 0.0))


def come_to_rest(prepared: Prepared, run: CantileverRun, cost: SimulationCost) -> Rest:
    """Relax under gravity and read the shape."""
    model, mounting = prepared.model, prepared.rig
    assert isinstance(mounting, Mounting)
    dt = run.solver.safety * model.critical_step
    boundary = Boundary(model, dt)
    mounting.constrain(boundary)
    cost.overlap_at_start = max(cost.overlap_at_start, model.prepare())
    drive, tally = boundary.drive(), new_tally(boundary)
    first = model.position()
    relaxation = relax(model, drive, tally, dt, run.rig.tolerance)
    cost.steps, cost.time_step = cost.steps + relaxation.steps, dt
    now = model.position()
    tip = first[:, 1] >= first[:, 1].max() - 1e-6
    drop, reach = -(now[tip, 2] - first[tip, 2]).mean(), now[tip, 1].mean()
    free = first[:, 1] > 1e-6
    angle = degrees(atan2(drop, reach))
    moment = float(np.sum(mounting.weight[free] * now[free, 1]))
    frames = (Frame(0.0, 0.0, 0.0, first, {}), Frame(1.0, angle, moment, now, model.fields()))
    root = float(tally.reaction[:, :3].sum()) / relaxation.last_chunk
    curvature = _root_curvature(first[:, 1], first[:, 2] - now[:, 2])
    return Rest(prepared.facts["overhang_mm"], angle, root, moment, curvature, relaxation, frames)


def _root_curvature(along: Array, drop: Array) -> float:
    """Curvature at the edge [1/mm] of the mean deflection, by the elastica's first terms k s^2/2 + c s^3 + d s^4."""
    near = (along > 1e-6) & (along < 0.25 * along.max())
    s = along[near]
    basis = np.column_stack([0.5 * s**2, s**3, s**4])
    return float(np.linalg.lstsq(basis, drop[near], rcond=None)[0][0])


def _next_overhang(rests: list[Rest], angle: float) -> float:
    """Secant in the overhang; from the first trial by Bickley's scale, the tangent of the angle growing as L^3."""
    last = rests[-1]
    if len(rests) == 1:
        share = np.tan(np.deg2rad(angle)) / np.tan(np.deg2rad(last.angle))
        return last.overhang * float(np.cbrt(share))
    before = rests[-2]
    slope = (last.angle - before.angle) / (last.overhang - before.overhang)
    return last.overhang + float(np.clip((angle - last.angle) / slope, -0.3 * last.overhang, 0.3 * last.overhang))


def _history(model: ExplicitModel, rests: list[Rest]) -> History:
    """Course of the last relaxation as the curve, the trials as rows of the energies' table."""
    rows = rests[-1].relaxation.history
    curve = {
        "steps": np.array([float(r[0]) for r in rows]),
        "residual": np.array([r[1] for r in rows]),
        "largest_move_mm": np.array([r[2] for r in rows]),
        "frequency_per_step": np.array([r[3] for r in rows]),
    }
    trials = {
        "overhang_mm": [r.overhang for r in rests],
        "chord_angle_deg": [r.angle for r in rests],
        "root_moment_nmm": [r.root_moment for r in rests],
        "weight_moment_nmm": [r.weight_moment for r in rests],
        "root_curvature_per_mm": [r.curvature for r in rests],
        "residual": [r.relaxation.residual for r in rests],
        "steps": [float(r.relaxation.steps) for r in rests],
        "converged": [float(r.relaxation.converged) for r in rests],
    }
    return History(model.mesh, curve, {k: np.array(v) for k, v in trials.items()}, list(rests[-1].frames))
