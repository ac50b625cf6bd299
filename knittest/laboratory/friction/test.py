"""Friction test: a strip between two plates."""

import time as clock
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import History, Quality
from knittest.laboratory.after_rest import after_rest
from knittest.laboratory.base import Prepared, Test, fabric_laminate
from knittest.laboratory.friction.config import FrictionRun
from knittest.laboratory.friction.lab_files import STICKS_OUT
from knittest.laboratory.friction.rig import KINETIC_SHARE, PRESSED, FrictionTest, pressure_map, pull_axis, shares
from knittest.laboratory.judging import Span, assess
from knittest.laboratory.strips import carrying_width, cut, pitch, yarns_across
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import build_meso
from knittest.solve.simulate import simulate
from knittest.solve.state import SILENT, Observer, SimulationCost

#: largest deviation of the normal force while the strip is pulled
FORCE_TOLERANCE = 0.01
#: penetration of the plates over the largest deformation of an element, the check of Pham et al. (2019), section 4.4
PENETRATION_TOLERANCE = 1.0
#: shells along a strip, one of them in each clamp
LEAST_SHELLS = 3


class Friction(Test[FrictionRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    ends_at_failure = False
    lowers_speed = True

    def refuse(self, run: FrictionRun) -> None:
        """Raise :class:`InputError` for plates that do not cover the strip, or from which it does not stick out."""
        rig = run.rig
        if rig.plate_width < rig.width:
            raise InputError(
                f"rig.plate_width = {rig.plate_width:g} mm: smaller than the strip, expected at least rig.width = "
                f"{rig.width:g} mm"
            )
        if rig.plate_length + rig.travel >= rig.length:
            raise InputError(
                f"rig.plate_length = {rig.plate_length:g} mm and rig.travel = {rig.travel:g} mm: expected their sum "
                f"below rig.length = {rig.length:g} mm, so that the pulled end sticks out; "
                f"--set rig.length={rig.plate_length + rig.travel + STICKS_OUT:g} leaves enough"
            )

    def prepare(self, run: FrictionRun, specimen: int = 0, observer: Observer = SILENT) -> Prepared:
        """The strip between its plates."""
        self.refuse(run)
        meso = run.model.scale == "meso"
        return self._yarns(run, specimen, observer) if meso else self._shells(run, specimen)

    def _shells(self, run: FrictionRun, specimen: int) -> Prepared:
        rig, size = run.rig, run.model.macro.element_size_mm
        if rig.length_mm < LEAST_SHELLS * size:
            raise InputError(
                f"rig.length = {rig.length:g} mm: expected at least {LEAST_SHELLS} shells of model.macro.element_size "
                f"= {size:g} mm; --set model.macro.element_size={rig.length_mm / LEAST_SHELLS:.3g} or less"
            )
        # the model of the tensile strip, its clamps being its first and last row
        shape = StripShape(rig.length_mm - 2.0 * size, rig.width_mm, size, size, seed=run.variability.seed + specimen)
        contact = self_contact(run.fabric, run.model.macro, run.solver.safety)
        model = build_strip(run.fabric, fabric_laminate(run), rig.direction, shape, contact)
        half = 0.5 * run.fabric.thickness_mm
        test = FrictionTest(run, pull_axis(run), (-half, half), np.full(model.n_nodes, half))
        facts = {"width_mm": rig.width_mm, "area_mm2": rig.length_mm * rig.width_mm} | _faces(test.faces)
        return Prepared(model, test, facts=facts)

    def _yarns(self, run: FrictionRun, specimen: int, observer: Observer) -> Prepared:
        start = clock.perf_counter()
        direction, period = run.rig.direction, pitch(run, run.rig.direction)
        across, along = yarns_across(run, direction, specimen), round(run.rig.length_mm / period)
        n_wales, n_courses = (across, along) if direction == "warp" else (along, across)
        piece = cut(run, n_wales, n_courses, specimen, observer)
        model = build_meso(run, piece.paths, piece.draws, run.rig.membrane_share)
        z, radius = model.position()[:, 2], model.group.radius
        faces = (float((z - radius).min()), float((z + radius).max()))
        test = FrictionTest(run, pull_axis(run), faces, radius)
        width = carrying_width(run, direction, specimen)
        facts = {"yarns_across": float(across), "width_mm": width, "area_mm2": along * period * width} | _faces(faces)
        return Prepared(model, test, clock.perf_counter() - start, piece.table, facts)

    def solve(self, prepared: Prepared, run: FrictionRun, observer: Observer) -> tuple[History, SimulationCost]:
        """Press, settle, pull."""
        history, cost = simulate(prepared.model, prepared.rig, run.solver, run.output, observer)
        return self.finish(run, prepared, history), cost

    def finish(self, run: FrictionRun, prepared: Prepared, history: History) -> History:
        """Energies from the pull on: what pressing a thick strip takes and loses says nothing of it."""
        return replace(after_rest(history, PRESSED), curve=history.curve)

    def results(self, run: FrictionRun, prepared: Prepared, history: History) -> dict[str, float]:
        """Levels, the paper's coefficient of two faces and that of one, pressure, penetration against deformation."""
        curve, normal = history.curve, run.rig.normal_force_n
        late = curve["displacement_mm"] > (1.0 - KINETIC_SHARE) * run.rig.travel_mm
        kinetic = float(curve["pull_force_n"][late].mean())
        return {
            "pull_force_kinetic_n": kinetic,
            "pull_force_static_n": static_force(curve)[0],
            "mu_paper": kinetic / normal,
            "mu_per_face": kinetic / (2.0 * normal),
            "normal_force_n": float(curve["normal_force_n"][late].mean()),
            "normal_force_error_pct": 100.0
            * float(np.abs(_smooth(curve["normal_force_n"][late]) / normal - 1.0).max()),
            "compression_mm": -float(curve["plate_travel_mm"][late].mean()),
            **_pressures(run, history, prepared.facts["width_mm"]),
            **_penetrations(history),
        }

    def assess(self, run: FrictionRun, prepared: Prepared, history: History, cost: SimulationCost) -> Quality:
        """The gates of every run, the normal force within 1 %, and plates that sink in less than elements deform."""
        quality = assess(run, prepared, history, cost, self.span(history))
        found = self.results(run, prepared, history)
        error, sunk = found["normal_force_error_pct"], found["penetration_over_deformation_pct"]
        if error > 100.0 * FORCE_TOLERANCE:
            quality = quality.refusing(f"normal force is off by {error:.1f} % while the strip is pulled")
        if sunk > 100.0 * PENETRATION_TOLERANCE:
            quality = quality.refusing(f"plates sink in by {sunk:.0f} % of the largest deformation of an element")
        return quality

    def span(self, history: History) -> Span:
        """The whole pull, at the latest from the samples of the static force on."""
        return Span(reported_from=static_force(history.curve)[1])


def _faces(faces: tuple[float, float]) -> dict[str, float]:
    return {"lower_face_mm": faces[0], "upper_face_mm": faces[1]}


def static_force(curve: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Largest force [N] before the share of the travel that is kinetic, and the time [ms] of the first sample of its
    mean; infinite where nothing was pulled.
    """
    moved = curve["displacement_mm"]
    early = (moved > 0.0) & (moved <= (1.0 - KINETIC_SHARE) * moved.max())
    if not early.any():
        return float("nan"), float("inf")
    force = _smooth(curve["pull_force_n"][early])
    return float(force.max()), float(curve["time_ms"][early][int(np.argmax(force))])


def map_cell(run: FrictionRun) -> float:
    """Side of a cell of the pressure map [mm]: a shell, or small enough to tell the loops."""
    if run.rig.pressure_cell_mm is not None:
        return run.rig.pressure_cell_mm
    return run.fabric.wale_spacing / 3.0 if run.model.scale == "meso" else run.model.macro.element_size_mm


def _pressures(run: FrictionRun, history: History, width: float) -> dict[str, float]:
    """Mean pressure [MPa] on what lies between the plates, ``width`` [mm] of fabric, the largest one of a cell, and who
    carries it (yarns).
    """
    rig = run.rig
    covered = rig.plate_length_mm - (1.0 - 0.5 * KINETIC_SHARE) * rig.travel_mm
    found = {
        "pressure_mean_mpa": rig.normal_force_n / (covered * width),
        "pressure_peak_mpa": float(pressure_map(history, map_cell(run)).pressure.max()),
    }
    if run.model.scale == "meso":
        found |= {f"plate_load_on_{part}_pct": share for part, share in shares(history).items()}
    return found


def _penetrations(history: History) -> dict[str, float]:
    """Deepest penetration of a plate against the largest change of an element's side or chord [um]."""
    first, last, cells = history.frames[0].position, history.frames[-1].position, history.mesh.cells
    moved = last - first
    stretch = float(np.linalg.norm(moved[cells] - moved[np.roll(cells, 1, axis=1)], axis=2).max())
    deepest = float(history.contacts["tool_penetration_max_um"].max())
    return {
        "plate_penetration_um": deepest,
        "element_deformation_um": 1e3 * stretch,
        "penetration_over_deformation_pct": 0.1 * deepest / max(stretch, 1e-12),
    }


def _smooth(values: np.ndarray, width: int = 5) -> np.ndarray:
    """Moving mean: single chunks hold the ringing of the contact."""
    return np.convolve(values, np.full(width, 1.0 / width), "valid") if len(values) >= width else values
