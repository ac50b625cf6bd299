"""Friction test: a strip between two plates."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.history import Array, History, Quality
from knittest.laboratory.base import PreparedSpecimen, fabric_laminate
from knittest.laboratory.fabric_test import FabricTest
from knittest.laboratory.friction.config import FrictionRun
from knittest.laboratory.friction.lab_files import FREE_LENGTH
from knittest.laboratory.friction.rig import KINETIC_SHARE, PRESSED, FrictionTest, force_shares, pressure_map, pull_axis
from knittest.laboratory.quality_checks import Span, check_limit
from knittest.laboratory.restart import check_ringing, history_from_time
from knittest.laboratory.strips import cut_piece, modelled_width, needle_nodes, pitch, wale_course_counts, yarns_across
from knittest.models.macro import StripShape, build_strip, self_contact
from knittest.models.meso import build_meso
from knittest.solve.state import Observer, SimulationCost

#: largest error of the normal force, and penetration over element deformation [%] (Pham et al. 2019, section 4.4)
FORCE_TOLERANCE, PENETRATION_TOLERANCE = 1.0, 100.0
#: least share of the friction of both faces by Coulomb's law with which a strip that slides is pulled, and largest
#: change of the pull force while it slides, over that friction [%]
SLIDING, STEADY_TOLERANCE = 0.9, 5.0
#: least rows of the moving mean of forces, and its share of the rows of a test
ROWS_OF_MEAN, SHARE_OF_MEAN = 5, 0.002
#: shells along a strip, one of them in each clamp
LEAST_SHELLS = 3


class Friction(FabricTest[FrictionRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    lowers_speed = True

    def check_run(self, run: FrictionRun) -> None:
        """Raise :class:`InputError` for plates that do not cover the strip, or that cover the pulled end."""
        rig = run.rig
        if rig.plate_width < rig.width:
            raise InputError(
                f"rig.plate_width = {rig.plate_width:g} mm: expected at least rig.width = {rig.width:g} mm"
            )
        if run.pulls_loops:
            if rig.plate_length >= rig.length:
                raise InputError(
                    f"rig.plate_length = {rig.plate_length:g} mm: must be less than rig.length = {rig.length:g} mm, so "
                    "that the pulled end stays outside the plates"
                )
            return
        if rig.travel >= rig.plate_length:
            raise InputError(
                f"rig.travel = {rig.travel:g} mm: must be less than rig.plate_length = {rig.plate_length:g} mm, or "
                "the strip leaves the plates"
            )
        if rig.plate_length + rig.travel >= rig.length:
            raise InputError(
                f"rig.plate_length = {rig.plate_length:g} mm and rig.travel = {rig.travel:g} mm: their sum must be "
                f"less than rig.length = {rig.length:g} mm, so that the pulled end stays outside the plates; use "
                f"--set rig.length={rig.plate_length + rig.travel + FREE_LENGTH:g}"
            )

    def mount_shells(self, run: FrictionRun, specimen: int) -> PreparedSpecimen:
        """Make the strip of shells: the model of the tensile strip, its clamps being its first and last row."""
        rig, size = run.rig, run.model.macro.element_size_mm
        if rig.length_mm < LEAST_SHELLS * size:
            raise InputError(
                f"rig.length = {rig.length:g} mm: expected at least {LEAST_SHELLS} shells of model.macro.element_size "
                f"= {size:g} mm; use --set model.macro.element_size={rig.length_mm / LEAST_SHELLS:.3g} or less"
            )
        shape = StripShape(rig.length_mm - 2.0 * size, rig.width_mm, size, size, seed=run.variability.seed + specimen)
        contact = self_contact(run.fabric, run.model.macro, run.solver.safety)
        model = build_strip(run.fabric, fabric_laminate(run), rig.direction, shape, contact)
        half = 0.5 * run.fabric.thickness_mm
        test = FrictionTest(run, pull_axis(run), (-half, half), np.full(model.n_nodes, half))
        facts = {"width_mm": rig.width_mm, "area_mm2": rig.length_mm * rig.width_mm} | test.facts
        return PreparedSpecimen(model, test, facts=facts)

    def mount_yarns(self, run: FrictionRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the strip of whole yarns and pitches."""
        direction, period = run.rig.direction, pitch(run, run.rig.direction)
        across, along = yarns_across(run, direction, specimen), round(run.rig.length_mm / period)
        piece = cut_piece(run, *wale_course_counts(direction, along, across), specimen, observer)
        model = build_meso(run, piece.paths, piece.draws, run.rig.membrane_share)
        z, radius = model.position()[:, 2], model.group.radius
        faces = float((z - radius).min()), float((z + radius).max())
        length = run.fabric.course_spacing * wale_course_counts(direction, along, across)[1]
        held = edge_nodes(run, model.position()[:, 1], model.group.chain, length) if run.pulls_loops else None
        test = FrictionTest(run, pull_axis(run), faces, radius, held)
        width = modelled_width(run, direction, specimen)
        facts = {"yarns_across": float(across), "width_mm": width, "area_mm2": along * period * width}
        return PreparedSpecimen(model, test, yarns=piece.table, facts=facts | test.facts)

    def finish(self, run: FrictionRun, prepared: PreparedSpecimen, history: History) -> History:
        """Return energies from the pull on, as those of pressing a thick strip say nothing of it, and the energy input.

        That is the outside work, or the work of the pull if it is more: a pressed strip recovers and lifts the plate.
        """
        pressed = prepared.rig.pressed if isinstance(prepared.rig, FrictionTest) else PRESSED
        later, curve = history_from_time(history, pressed), history.curve
        work = np.interp(later.energies["time_ms"], curve["time_ms"], pull_work(curve))
        largest = np.maximum(np.abs(later.energies["external_mj"]), work)
        return replace(later, curve=curve, energies=later.energies | {"energy_input_mj": largest})

    def results(self, run: FrictionRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Forces, coefficients of two faces and of one, pressure, penetration over deformation."""
        curve, normal = history.curve, run.rig.normal_force_n
        late = curve["displacement_mm"] > (1.0 - KINETIC_SHARE) * run.rig.travel_mm
        kinetic = float(curve["pull_force_n"][late].mean())
        error = float(np.abs(_smooth(curve["normal_force_n"][late], len(late)) / normal - 1.0).max())
        return {
            "pull_force_kinetic_n": kinetic,
            "pull_force_static_n": static_force(curve)[0],
            "mu_paper": kinetic / normal,
            "mu_per_face": kinetic / (2.0 * normal),
            "normal_force_n": float(curve["normal_force_n"][late].mean()),
            "normal_force_error_pct": 100.0 * error,
            "compression_mm": -float(curve["plate_travel_mm"][late].mean()),
            **_pressures(run, history, prepared.facts["width_mm"]),
            **_penetrations(history),
        }

    def assess(self, run: FrictionRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the standard checks, normal force and penetration of the plates, and whether the strip slides.

        Raises :class:`TooFastError` where the normal force rings.
        """
        quality = super().assess(run, prepared, history, cost)
        found = self.results(run, prepared, history)
        error, sunk = found["normal_force_error_pct"], found["penetration_over_deformation_pct"]
        text = f"plate penetration is {sunk:.0f} % of the largest element deformation"
        quality = check_limit(quality, sunk, PENETRATION_TOLERANCE, text)
        if quality.failures:  # a lower speed may mend the checks below too
            return quality
        text = f"normal force deviates by {error:.1f} % during the pull"
        check_ringing(prepared.restarts, error, FORCE_TOLERANCE, text)
        quality = check_limit(quality, error, FORCE_TOLERANCE, text)
        pull, coulomb = found["pull_force_kinetic_n"], 2.0 * run.rig.kinetic_coefficient * run.rig.normal_force_n
        if coulomb == 0.0:
            return quality
        remedy = (
            f"lower rig.normal_force (now {run.rig.normal_force:g} N) or raise rig.travel (now {run.rig.travel:g} mm)"
        )
        if pull < SLIDING * coulomb:
            return quality.with_failed_check(
                f"the strip stretches instead of sliding, or its loops come apart: its pull force is {pull:.3g} N, "
                f"that of Coulomb's law {coulomb:.3g} N; {remedy}"
            )
        change = 100.0 * slip_change(history.curve) / coulomb
        return check_limit(
            quality, abs(change), STEADY_TOLERANCE,
            f"the strip does not slide steadily: its pull force changes by {change:.1f} % of Coulomb's law between the "
            "halves of the travel of the kinetic force", f"; {remedy}",
        )  # fmt: skip

    def span(self, history: History) -> Span:
        """Return the span of the pull, at the latest from the samples of the static force on."""
        return Span(reported_from=static_force(history.curve)[1])


def edge_nodes(run: FrictionRun, y: Array, chain: NDArray[np.int64], length: float) -> NDArray[np.int64]:
    """Nodes at ``y`` (n,) that a piece larger than ``length`` [mm] along y would hold: yarn ends, crests of edge loops.

    A loop at a free edge has no loop that holds it, so that narrow strips unravel under small forces.
    """
    return needle_nodes(np.abs(y - 0.5 * length) - 0.5 * length, chain, run.fabric.course_spacing)


def static_force(curve: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Largest force [N] before the kinetic share of the travel, and time [ms] of the first sample of its mean."""
    moved = curve["displacement_mm"]
    early = (moved > 0.0) & (moved <= (1.0 - KINETIC_SHARE) * moved.max())
    if not early.any():
        return float("nan"), float("inf")
    force = _smooth(curve["pull_force_n"][early], len(early))
    return float(force.max()), float(curve["time_ms"][early][int(np.argmax(force))])


def pull_work(curve: Mapping[str, np.ndarray]) -> Array:
    """Work of the pull force so far [mJ], (n_rows,)."""
    force, moved = curve["pull_force_n"], np.maximum(curve["displacement_mm"], 0.0)
    return np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(moved)))


def slip_change(curve: Mapping[str, np.ndarray]) -> float:
    """Change of the mean pull force [N] from the first to the second half of the kinetic share of the travel."""
    moved, force = curve["displacement_mm"], curve["pull_force_n"]
    begin, middle = (1.0 - share * KINETIC_SHARE for share in (1.0, 0.5))
    first = (moved > begin * moved.max()) & (moved <= middle * moved.max())
    return float(force[moved > middle * moved.max()].mean() - force[first].mean())


def map_cell(run: FrictionRun) -> float:
    """Side of a cell of the pressure map [mm]: a shell, or small enough to resolve loops."""
    if run.rig.pressure_cell_mm is not None:
        return run.rig.pressure_cell_mm
    return run.fabric.wale_spacing / 3.0 if run.model.scale == "meso" else run.model.macro.element_size_mm


def _pressures(run: FrictionRun, history: History, width: float) -> dict[str, float]:
    """Mean pressure [MPa] on ``width`` [mm] of fabric, largest pressure of a cell, load of each yarn system [%]."""
    rig = run.rig
    covered = rig.plate_length_mm - (1.0 - 0.5 * KINETIC_SHARE) * rig.travel_mm
    if run.pulls_loops:
        covered += mean_stretch(run, history)
    found = {
        "pressure_mean_mpa": rig.normal_force_n / (covered * width),
        "pressure_peak_mpa": float(pressure_map(history, map_cell(run)).pressure.max()),
    }
    if run.model.scale == "meso":
        found |= {f"plate_load_on_{part}_pct": share for part, share in force_shares(history).items()}
    return found


def mean_stretch(run: FrictionRun, history: History) -> float:
    """Mean stretch [mm] of the strip during the kinetic share of the travel: way of its free end in the frames."""
    axis = pull_axis(run)
    end = int(np.argmin(history.frames[0].position[:, axis]))
    times = [frame.time for frame in history.frames]
    way = [float(history.frames[0].position[end, axis] - frame.position[end, axis]) for frame in history.frames]
    late = history.curve["displacement_mm"] > (1.0 - KINETIC_SHARE) * run.rig.travel_mm
    return float(np.interp(history.curve["time_ms"][late], times, way).mean())


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


def _smooth(values: np.ndarray, rows: int) -> np.ndarray:
    """Moving mean of ``values`` in a test of ``rows``: single ones hold the ringing of the contact."""
    width = max(ROWS_OF_MEAN, round(SHARE_OF_MEAN * rows))
    return np.convolve(values, np.full(width, 1.0 / width), "valid") if len(values) >= width else values
