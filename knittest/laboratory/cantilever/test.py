"""Cantilever: a strip bends over an edge under its own weight; its equilibrium by dynamic relaxation.

Loads of gravity are small against the membrane stiffness, which only limits the step: a share of it is kept. Heavy
elastica: w L^3 / B = 8.0042 at a chord angle of 41.5 deg, so that Eq. 2 of Pham et al. (2019), B = w (L / 2)^3, holds
within 0.05 %.
"""

import time as clock
from operator import attrgetter

import numpy as np

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.history import History, Quality
from knittest.config.quality_checks import HOURGLASS
from knittest.experiment.tables import published_rows
from knittest.laboratory.base import PreparedSpecimen, Test
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cantilever.corrections import EQ2, FLATTEST, STEEPEST
from knittest.laboratory.cantilever.macro_strip import Equilibrium, mount_shells, relax_shells
from knittest.laboratory.cantilever.meso_strip import mount_yarns, relax_yarns
from knittest.laboratory.quality_checks import evaluate_check
from knittest.materials.heavy_elastica import STANDARD_ANGLE, bending_stiffness, overhang_ratio
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.state import SILENT, Observer, SimulationCost

#: chord angle error at which the laboratory's mode has found its overhang [deg], and most relaxations it may take
ANGLE_TOLERANCE, MOST_TRIALS = {"macro": 0.05, "meso": 0.25}, 8
#: largest error of the root moment, and change of the chord angle [deg] by the last turn of the sections of yarns
MOMENT_TOLERANCE, DRIFT_TOLERANCE = 0.01, 0.5
#: warning of a strip whose yarns slip for too long
FRICTION_NOTE = (
    "without yarn friction the strip found no equilibrium. So the yarns slip freely at first, and later with "
    "fabric.contact.friction_coefficient"
)


class Cantilever(Test[CantileverRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False

    def completed(self, run: CantileverRun) -> tuple[CantileverRun, str]:
        """Estimate the overhang, in whole mm, where none is given or measured."""
        try:
            given_overhang(run)
        except InputError:
            overhang = round(_estimated_overhang(run))
            rig = run.rig.model_copy(update={"overhang": float(overhang)})
            text = f"rig.overhang is not given and was not measured: {_estimate_source(run)} gives {overhang} mm"
            return run.model_copy(update={"rig": rig}), f"{run.rig.direction}: {text}"
        return run, ""

    def check_run(self, run: CantileverRun) -> None:
        """Raise :class:`InputError` for an overhang that is neither given nor measured, or longer than the strip."""
        overhang = given_overhang(run)
        if overhang >= run.rig.length:
            enough = f"use --set rig.length={round(1.2 * overhang)}"
            raise InputError(
                f"rig.overhang = {overhang:g} mm: rig.length = {run.rig.length:g} mm is too short; {enough}"
            )

    def prepare(self, run: CantileverRun, specimen: int = 0, observer: Observer = SILENT) -> PreparedSpecimen:
        """Make the strip flat over the edge, at the given or measured overhang."""
        self.check_run(run)
        return _mount_strip(run, given_overhang(run), specimen, observer)

    def solve(
        self, prepared: PreparedSpecimen, run: CantileverRun, observer: Observer
    ) -> tuple[History, SimulationCost]:
        """Find the equilibrium; in the mode overhang, at overhangs that lead to the angle of the plane."""
        cost, start = SimulationCost(), clock.perf_counter()
        tolerance = ANGLE_TOLERANCE[run.model.scale] if run.rig.mode == "overhang" else np.inf
        observer.phase("bending under its own weight until at rest")
        to_rest = relax_yarns if _is_meso(run) else relax_shells
        rests, longest = [to_rest(prepared, run, cost, observer)], prepared
        while abs(rests[-1].angle - run.rig.plane_angle) > tolerance and len(rests) < MOST_TRIALS:
            longer = _next_overhang(rests, run.rig.plane_angle)
            if longer >= run.rig.length:
                raise InputError(
                    f"rig.length = {run.rig.length:g} mm: too short to reach the plane at {run.rig.plane_angle:g} deg"
                )
            longest = _mount_strip(run, longer)
            observer.phase(
                f"bending at an overhang of {longer:.0f} mm, trial {len(rests) + 1} of at most {MOST_TRIALS}"
            )
            rests.append(to_rest(longest, run, cost, observer))
        cost.advance_s = clock.perf_counter() - start
        return _history(longest.model, rests), cost

    def results(self, run: CantileverRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Chord angle, overhang and both measures of the bending stiffness."""
        last = _last_row(history)
        overhang, chord, moment = last["overhang_mm"], last["chord_angle_deg"], last["root_moment_nmm"]
        return {
            "chord_angle_deg": chord,
            "overhang_mm": overhang,
            EQ2: stiffness_by_overhang(run, overhang, chord),
            "bending_stiffness_n_mm_per_width": moment / last["root_curvature_per_mm"] / prepared.facts["width_mm"],
            "moment_error_pct": 100.0 * abs(moment / last["weight_moment_nmm"] - 1.0),
            "residual": last["residual"],
        } | ({"curl_moment_nmm": last["curl_nmm"], "drift_deg": last["drift_deg"]} if _is_meso(run) else {})

    def assess(self, run: CantileverRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate residual and drift, the moment of the root against that of the weight, and hourglass energy."""
        last, failures, warnings = _last_row(history), [], []
        moment = abs(last["root_moment_nmm"] / last["weight_moment_nmm"] - 1.0)
        if not last["converged"]:
            failures.append(f"no equilibrium after {last['steps']:.0f} steps: residual {last['residual']:.2g}")
        if abs(last["drift_deg"]) > DRIFT_TOLERANCE:
            failures.append(
                f"the chord angle still changes by {last['drift_deg']:.2f} deg in the last turn of sections (limit "
                f"{DRIFT_TOLERANCE:g} deg)"
            )
        if moment > MOMENT_TOLERANCE:
            failures.append(
                f"the root moment deviates from that of the weight by {100.0 * moment:.1f} % (limit "
                f"{100.0 * MOMENT_TOLERANCE:g} %)"
            )
        kept, usual = prepared.facts.get("membrane_share", 0.0), run.rig.usual["membrane_share"]
        if run.rig.membrane_share is None and kept > usual:
            warnings.append(
                f"rig.membrane_share = {kept:g} instead of the default {usual:g}, as bending needs more here"
            )
        if last.get("rubs"):
            warnings.append(FRICTION_NOTE)
        quality = Quality(
            0.0, moment, 0.0, 0.0, 0.0, not failures, tuple(failures), tuple(warnings),
            hourglass_over_internal_max=last["hourglass_over_internal"],
        )  # fmt: skip
        return evaluate_check(run, quality, HOURGLASS) if HOURGLASS.applies(run) else quality


def _last_row(history: History) -> dict[str, float]:
    return {name: float(values[-1]) for name, values in history.energies.items()}


def _is_meso(run: CantileverRun) -> bool:
    return run.model.scale == "meso"


def _mount_strip(
    run: CantileverRun, overhang: float, specimen: int = 0, observer: Observer = SILENT
) -> PreparedSpecimen:
    return mount_yarns(run, overhang, specimen, observer) if _is_meso(run) else mount_shells(run, overhang)


def given_overhang(run: CantileverRun) -> float:
    """Overhang [mm] of the run, or the mean measured one; raises :class:`InputError` without both."""
    if run.rig.overhang_mm is not None:
        return run.rig.overhang_mm
    fabric = run.fabric
    if fabric.experiment is not None and fabric.experiment_variant is not None:
        folder = data_dir() / fabric.experiment
        rows = published_rows(folder, fabric.experiment_variant, run.rig.direction, ("overhang_mm",))
        if rows:
            return rows[0].mean
    raise InputError(
        f"rig.overhang: missing, and the fabric has no measured overhang of the {run.rig.direction}: give it in mm; "
        f"{_estimate_source(run)} gives --set rig.overhang={_estimated_overhang(run):.0f}"
    )


def _estimated_overhang(run: CantileverRun) -> float:
    """Overhang [mm] of a chord angle of 41.5 deg by Eq. 2 and the input bending stiffness per width [N mm]."""
    fabric, direction = run.fabric, run.rig.direction
    if _is_meso(run) or fabric.macro.bending_stiffness is None:
        stiffness = fabric.yarn_bending_n_mm(direction)
    else:
        stiffness = fabric.macro.bending_stiffness_n_mm.of(direction)
    return float(2.0 * (stiffness / (fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2)) ** (1.0 / 3.0))


def _estimate_source(run: CantileverRun) -> str:
    of = "the bending stiffness of the inlays" if _is_meso(run) else "fabric.macro.bending_stiffness"
    return f"Eq. 2 with {of} and a chord angle of {STANDARD_ANGLE:g} deg"


def stiffness_by_overhang(run: CantileverRun, overhang: float, chord: float) -> float:
    """B = w (L / 2)^3 per width [N mm] (Eq. 2), for ``overhang`` [mm] converted from its angle to 41.5 deg, or NaN."""
    angle = run.rig.plane_angle if run.rig.mode == "overhang" else chord
    if not FLATTEST <= angle <= STEEPEST:
        return float("nan")
    overhang = overhang * overhang_ratio(STANDARD_ANGLE, angle)
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    return bending_stiffness(overhang, weight)


def _next_overhang(rests: list[Equilibrium], angle: float) -> float:
    """Secant in the overhang, after the first trial the heavy elastica of the same stiffness, w L^3 / B."""
    last = rests[-1]
    if len(rests) == 1:
        return last.overhang * overhang_ratio(angle, min(max(last.angle, FLATTEST), STEEPEST))
    before = rests[-2]
    slope = (last.angle - before.angle) / (last.overhang - before.overhang)
    return last.overhang + float(np.clip((angle - last.angle) / slope, -0.3 * last.overhang, 0.3 * last.overhang))


def _history(model: ExplicitModel, rests: list[Equilibrium]) -> History:
    """Course of the last relaxation as the curve, the trials as rows of the energies' table."""
    names = ("steps", "residual", "largest_move_mm", "frequency_per_step")
    rows = np.array(rests[-1].relaxation.history, float).reshape(-1, len(names))
    columns = {
        "overhang_mm": "overhang", "chord_angle_deg": "angle", "root_moment_nmm": "root_moment",
        "weight_moment_nmm": "weight_moment", "root_curvature_per_mm": "curvature", "residual": "relaxation.residual",
        "steps": "relaxation.steps", "converged": "converged", "rubs": "has_friction", "curl_nmm": "curl",
        "drift_deg": "drift", "hourglass_over_internal": "hourglass",
    }  # fmt: skip
    trials = {name: np.array([float(attrgetter(path)(r)) for r in rests]) for name, path in columns.items()}
    return History(model.mesh, dict(zip(names, rows.T, strict=True)), trials, list(rests[-1].frames))


def sheet(run: CantileverRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return given_overhang(run), run.rig.width
