"""Cantilever: a strip bends over an edge under its own weight; found at rest by dynamic relaxation.

Loads of gravity are small against the membrane stiffness, which only limits the step: a share of it is kept. Heavy
elastica: w L^3 / B = 8.0042 at a chord angle of 41.5 deg, so that Eq. 2 of Pham
et al. (2019), B = w (L / 2)^3, holds within 0.05 %.
"""

import time as clock

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.history import History, Quality
from knittest.config.gates import HOURGLASS
from knittest.experiment.tables import published
from knittest.laboratory.base import Prepared, Test
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cantilever.corrections import EQ2, FLATTEST, STEEPEST
from knittest.laboratory.cantilever.shells import Rest, mount_shells, shells_to_rest
from knittest.laboratory.cantilever.yarns import mount_yarns, yarns_to_rest
from knittest.laboratory.judging import by_gate
from knittest.materials.heavy_elastica import STANDARD_ANGLE, bending_stiffness, overhang_ratio
from knittest.models.explicit_model import ExplicitModel
from knittest.solve.state import SILENT, Observer, SimulationCost

Array = NDArray[np.float64]

#: chord angle error at which the laboratory's mode has found its overhang [deg], and most relaxations it may take
ANGLE_TOLERANCE, MOST_TRIALS = {"macro": 0.05, "meso": 0.25}, 8
#: largest deviation between the root's moment and that of gravity
MOMENT_TOLERANCE = 0.01
#: largest move of the chord angle [deg] by the last turn of the sections of a strip of yarns
DRIFT_TOLERANCE = 0.5
#: what a strip says whose yarns slipped on for too long
RUBS = (
    "yarns: without friction the strip did not come to rest. So the yarns slip freely at first, and then rub on each "
    "other with fabric.contact.friction_coefficient"
)


class Cantilever(Test[CantileverRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False

    def completed(self, run: CantileverRun) -> tuple[CantileverRun, str]:
        """``run`` with an estimated overhang, in whole mm, where none is given or measured."""
        try:
            given_overhang(run)
        except InputError:
            overhang = round(_estimated_overhang(run))
            rig = run.rig.model_copy(update={"overhang": float(overhang)})
            said = f"rig.overhang is not given and was not measured: {_estimated_by(run)} gives {overhang} mm"
            return run.model_copy(update={"rig": rig}), f"{run.rig.direction}: {said}"
        return run, ""

    def refuse(self, run: CantileverRun) -> None:
        """Raise :class:`InputError` for an overhang that is neither given nor measured, or longer than the strip."""
        overhang = given_overhang(run)
        if overhang >= run.rig.length:
            raise InputError(
                f"rig.overhang = {overhang:g} mm: longer than the strip, expected less than rig.length = "
                f"{run.rig.length:g} mm; --set rig.length={round(1.2 * overhang)} holds it"
            )

    def prepare(self, run: CantileverRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The strip flat over the edge, at the given or measured overhang."""
        self.refuse(run)
        return _mount(run, given_overhang(run), specimen, observer)

    def solve(self, prepared: Prepared, run: CantileverRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Come to rest; in the laboratory's mode, at overhangs that lead to the angle of the plane."""
        cost, start = SimulationCost(), clock.perf_counter()
        observer.phase("bending under its own weight until at rest")
        rests, longest = [_come_to_rest(prepared, run, cost, observer)], prepared
        while (
            run.rig.mode == "overhang" and abs(rests[-1].angle - run.rig.plane_angle) > ANGLE_TOLERANCE[run.model.scale]
        ):
            if len(rests) == MOST_TRIALS:
                break
            longer = _next_overhang(rests, run.rig.plane_angle)
            if longer >= run.rig.length:
                raise InputError(
                    f"rig.length = {run.rig.length:g} mm: the strip does not reach the plane at "
                    f"{run.rig.plane_angle:g} deg; expected a longer or a softer one"
                )
            longest = _mount(run, longer)
            observer.phase(
                f"bending at an overhang of {longer:.0f} mm, trial {len(rests) + 1} of {MOST_TRIALS} at most"
            )
            rests.append(_come_to_rest(longest, run, cost, observer))
        cost.advance_s = clock.perf_counter() - start
        return _history(longest.model, rests), cost

    def results(self, run: CantileverRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Chord angle, overhang and both measures of the bending stiffness."""
        last = {name: float(values[-1]) for name, values in history.energies.items()}
        overhang = last["overhang_mm"]
        return {
            "chord_angle_deg": last["chord_angle_deg"],
            "overhang_mm": overhang,
            EQ2: stiffness_by_overhang(run, overhang, last["chord_angle_deg"]),
            "bending_stiffness_n_mm_per_width": last["root_moment_nmm"]
            / last["root_curvature_per_mm"]
            / prepared.facts["width_mm"],
            "moment_error_pct": 100.0 * abs(last["root_moment_nmm"] / last["weight_moment_nmm"] - 1.0),
            "residual": last["residual"],
        } | ({"curl_moment_nmm": last["curl_nmm"], "drift_deg": last["drift_deg"]} if _meso(run) else {})

    def assess(self, run: CantileverRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """Rest: residual and drift below the tolerance, the root carries the moment of the weight, and the hourglass
        control of shells little of the energy.
        """
        last = {name: float(values[-1]) for name, values in history.energies.items()}
        moment = abs(last["root_moment_nmm"] / last["weight_moment_nmm"] - 1.0)
        failures = []
        if not last["converged"]:
            failures.append(f"not at rest after {last['steps']:.0f} steps: residual {last['residual']:.2g}")
        if abs(last["drift_deg"]) > DRIFT_TOLERANCE:
            failures.append(f"the chord still moves by {last['drift_deg']:.2f} deg in the last turn of sections")
        if moment > MOMENT_TOLERANCE:
            failures.append(f"the root's moment is off that of the weight by {100.0 * moment:.1f} %")
        kept, usual = prepared.facts.get("membrane_share", 0.0), run.rig.usual["membrane_share"]
        told = f"rig.membrane_share: {kept:g} is kept: the usual {usual:g} is less than bending needs here"
        warnings = [told] if run.rig.membrane_share is None and kept > usual else []
        if last.get("rubs"):
            warnings.append(RUBS)
        quality = Quality(
            0.0, moment, 0.0, 0.0, 0.0, not failures, tuple(failures), tuple(warnings),
            hourglass_over_internal_max=last["hourglass_over_internal"],
        )  # fmt: skip
        return by_gate(run, quality, HOURGLASS) if HOURGLASS.applies(run) else quality


def _meso(run: CantileverRun) -> bool:
    return run.model.scale == "meso"


def _mount(run: CantileverRun, overhang: float, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
    """The strip, flat, at an overhang [mm]."""
    return mount_yarns(run, overhang, specimen, observer) if _meso(run) else mount_shells(run, overhang)


def _come_to_rest(prepared: Prepared, run: CantileverRun, cost: SimulationCost, observer: Observer = SILENT) -> Rest:
    to_rest = yarns_to_rest if _meso(run) else shells_to_rest
    return to_rest(prepared, run, cost, observer)


def given_overhang(run: CantileverRun) -> float:
    """Overhang of the run, else the mean measured one [mm]; raises :class:`InputError` where there is neither."""
    if run.rig.overhang_mm is not None:
        return run.rig.overhang_mm
    fabric = run.fabric
    if fabric.experiment is not None and fabric.experiment_variant is not None:
        folder = data_dir() / fabric.experiment
        rows = published(folder, fabric.experiment_variant, run.rig.direction, ("overhang_mm",))
        if rows:
            return rows[0].mean
    raise InputError(
        f"rig.overhang: missing, and the fabric names no experiment with an overhang of the {run.rig.direction}: set "
        f"it in mm; {_estimated_by(run)} gives --set rig.overhang={_estimated_overhang(run):.0f}"
    )


def _estimated_overhang(run: CantileverRun) -> float:
    """Overhang [mm] of a chord angle of 41.5 deg by Eq. 2 and the bending stiffness that the model is given."""
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    return float(2.0 * (_stiffness(run) / weight) ** (1.0 / 3.0))


def _estimated_by(run: CantileverRun) -> str:
    of = "the bending stiffness of the inlays" if _meso(run) else "fabric.macro.bending_stiffness"
    return f"Eq. 2 with {of} and a chord angle of {STANDARD_ANGLE:g} deg"


def _stiffness(run: CantileverRun) -> float:
    """Bending stiffness per width [N mm] that the model of ``run`` is given: of shells that of their card, of yarns
    or without a card that of a reinforcing yarn times
    their density.
    """
    fabric, direction = run.fabric, run.rig.direction
    if _meso(run) or fabric.macro.bending_stiffness is None:
        return float(fabric.reinforcing.bending_stiffness_n_mm2.of(direction) * fabric.density_per_mm.of(direction))
    return float(fabric.macro.bending_stiffness_n_mm.of(direction))


def stiffness_by_overhang(run: CantileverRun, overhang: float, chord: float) -> float:
    """B = w (L / 2)^3 per width [N mm] (Eq. 2), with the weight per area w.

    Eq. 2 holds at 41.5 deg: an ``overhang`` [mm] that was looked for at another plane, or given and found at rest at
    another ``chord`` [deg], counts as it would be there; NaN for a chord that is hardly bent or hangs down.
    """
    angle = run.rig.plane_angle if run.rig.mode == "overhang" else chord
    if not FLATTEST <= angle <= STEEPEST:
        return float("nan")
    overhang = overhang * overhang_ratio(STANDARD_ANGLE, angle)
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    return bending_stiffness(overhang, weight)


def _next_overhang(rests: list[Rest], angle: float) -> float:
    """Secant in the overhang; from the first trial by the heavy elastica of the same stiffness, w L^3 / B."""
    last = rests[-1]
    if len(rests) == 1:
        found = min(max(last.angle, FLATTEST), STEEPEST)  # between the loads that it is known for
        return last.overhang * overhang_ratio(angle, found)
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
        "converged": [float(r.converged) for r in rests],
        "rubs": [float(r.rubs) for r in rests],
        "curl_nmm": [r.curl for r in rests],
        "drift_deg": [r.drift for r in rests],
        "hourglass_over_internal": [r.hourglass for r in rests],
    }
    return History(model.mesh, curve, {k: np.array(v) for k, v in trials.items()}, list(rests[-1].frames))


def stated(run: CantileverRun) -> tuple[str, ...]:
    """Size of the strip and what acts on it, in words."""
    return (f"strip {run.rig.width:g} mm wide",)


def sheet(run: CantileverRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return given_overhang(run), run.rig.width
