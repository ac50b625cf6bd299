"""Forming: a blank of shells or yarns between stamp, die and blank holder."""

from dataclasses import replace

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Array, Frame, History, Mesh, Quality
from knittest.laboratory.base import PreparedSpecimen, limited_laminate
from knittest.laboratory.fabric_test import FabricTest
from knittest.laboratory.forming.config import FormingRun
from knittest.laboratory.forming.results import (
    DIRECTIONS,
    MidSurface,
    draw_in,
    measure_mid_surface,
    rim_waves,
    yarn_forces,
)
from knittest.laboratory.forming.rig import FormingTest, count_swapped_crossings, no_bending_note
from knittest.laboratory.forming.tool_check import fitting_tools, tools_of
from knittest.laboratory.quality_checks import assess
from knittest.laboratory.strips import check_shows_shear, cut_piece, material_angles, node_weights, random_offsets
from knittest.models.explicit_model import ExplicitModel
from knittest.models.macro import build_sheet, rectangle, self_contact
from knittest.models.meso import build_meso
from knittest.solve.state import SILENT, Observer, SimulationCost
from knittest.tooling.outline import stamp_outline

#: height over the thickness above which fabric above its tool, or a crest of the rim above its troughs, is a wrinkle
WRINKLE_HEIGHT = 0.5
#: largest penetration of a tool over half the thickness, or the radius of a yarn
LARGEST_DEPTH_SHARE = 0.25
#: least mass of the holder over the blank's: penalties of all touching nodes, 0.3 m / dt^2 each, against 4 M / dt^2
LEAST_MASS_RATIO = 0.2
#: radius about an inner corner of the stamp over its own in which angles are read, and percentile for high values
NEAR_CORNER, HIGH = 1.5, 95.0


class Forming(FabricTest[FormingRun]):
    """See :class:`knittest.laboratory.base.Test`."""

    def check_run(self, run: FormingRun) -> None:
        """Raise :class:`InputError` for a blank that shows no shear angle."""
        wales, courses = _whole_pitches(run)
        check_shows_shear(run, wales, courses, "rig.blank_width" if wales < courses else "rig.blank_length")

    def prepare(self, run: FormingRun, specimen: int = 0, observer: Observer = SILENT) -> PreparedSpecimen:
        """Make the blank flat on the die, the stamp on it; raises :class:`InputError` for a holder too light."""
        prepared = super().prepare(run, specimen, observer)
        blank, holder = float(prepared.model.mass.sum()), run.rig.holder
        mass = blank if holder.mass_g is None else holder.mass_g
        if run.rig.blank_holder_force > 0.0 and mass < LEAST_MASS_RATIO * blank:
            raise InputError(
                f"rig.holder.mass = {holder.mass:g} kg is too small for the time step: give at least "
                f"{LEAST_MASS_RATIO:g} of "
                f"the blank's {1e-3 * blank:.3g} kg, or remove it"
            )
        return prepared

    def mount_shells(self, run: FormingRun, specimen: int) -> PreparedSpecimen:
        """Make the blank of shells."""
        rig, fabric, size = run.rig, run.fabric, run.model.macro.element_size_mm
        length, width, thickness = rig.blank_length_mm, rig.blank_width_mm, fabric.thickness_mm
        rows = np.linspace(-0.5 * length, 0.5 * length, max(round(length / size), 2) + 1)
        points, cells = rectangle(rows, width, size)
        points[:, 2] = random_offsets(rig.imperfection_mm, run.variability.seed + specimen, len(points))
        soft = limited_laminate(run, rig.membrane_share)
        contact = self_contact(fabric, run.model.macro, run.solver.safety)
        model = build_sheet(points, cells, soft, fabric.area_mass_g_per_mm2, thickness, contact=contact)
        # unevenness does not reach into the tools
        radius = 0.5 * thickness - np.abs(points[:, 2])
        prepared = _place_between_tools(run, model, thickness, radius, length * width)
        return replace(prepared, notes=(*no_bending_note(run), *prepared.notes))

    def mount_yarns(self, run: FormingRun, specimen: int, observer: Observer) -> PreparedSpecimen:
        """Make the blank of whole pitches."""
        rig, fabric = run.rig, run.fabric
        n_wales, n_courses = _whole_pitches(run)
        piece = cut_piece(run, n_wales, n_courses, specimen, observer)
        size = n_wales * fabric.wale_spacing, n_courses * fabric.course_spacing
        height = np.concatenate([p.points[:, 2] for p in piece.paths])
        centre = np.array([0.5 * size[0], 0.5 * size[1], 0.5 * (height.min() + height.max())])
        paths = [replace(p, points=p.points - centre) for p in piece.paths]
        model = build_meso(run, paths, piece.draws, rig.membrane_share)
        z, radius = model.position()[:, 2], model.group.radius
        thickness = 2.0 * float((np.abs(z) + radius).max())
        prepared = _place_between_tools(run, model, thickness, radius, float(size[0] * size[1]))
        return replace(prepared, yarns=piece.table)

    def results(self, run: FormingRun, prepared: PreparedSpecimen, history: History) -> dict[str, float]:
        """Forces, shear angles, wrinkles, draw-in and yarn forces at the end of forming."""
        mesh, first, last = history.mesh, history.frames[0], history.frames[-1]
        surface, thickness = mid_surface_at(run, prepared.facts, history, last), prepared.facts["thickness_mm"]
        edge, forces = draw_in(mesh, first, last), yarn_forces(run, mesh, history.frames)
        waves = rim_waves(edge.start, edge.rise, WRINKLE_HEIGHT * thickness)
        strains = {}
        if "strain_warp" in last.fields:  # a check of the share of the membrane stiffness
            largest = max(float(last.fields[f"strain_{d}"].max()) for d in DIRECTIONS)
            strains = {"max_membrane_strain_pct": 100.0 * largest}
        found = {
            "stamp_force_max_n": float(history.curve["stamp_force_n"].max()),
            **_wrinkles(surface, thickness),
            "rim_wave_height_mm": waves.largest,
            "rim_wave_count": float(waves.count),
            **_shear(run, mesh, last),
            "draw_in_max_mm": float(edge.drawn.max()),
            "draw_in_warp_mm": 0.5 * (edge.middle("warp_low") + edge.middle("warp_high")),
            "draw_in_weft_mm": 0.5 * (edge.middle("weft_low") + edge.middle("weft_high")),
            "max_yarn_force_n": float(_inlay_forces(forces).max()),
            "max_yarn_utilisation_pct": float(forces["utilisation_pct"].max()),
            **strains,
            "yarns_at_risk": float(np.count_nonzero(forces["utilisation_pct"] > 100.0 * run.rig.risk_share)),
            "tool_penetration_max_um": float(history.contacts["tool_penetration_max_um"].max()),
        }
        if mesh.kind == "beams" and run.fabric.has_inlays_both_ways:
            found["crossings_out_of_order"] = float(count_swapped_crossings(run, mesh, first, last))
        return found

    def assess(self, run: FormingRun, prepared: PreparedSpecimen, history: History, cost: SimulationCost) -> Quality:
        """Evaluate the standard checks, drag, and penetration of tools; warn of what the model leaves out."""
        quality = assess(run, prepared, history, cost, self.span(history), drag_ratio(run, prepared))
        deepest = float(history.contacts["tool_penetration_max_um"].max())
        limit = allowed_depth(run)
        if deepest > limit:
            quality = quality.with_failed_check(
                f"tool penetration of {deepest:.0f} um exceeds the limit of {limit:.0f} um"
            )
        assert isinstance(prepared.rig, FormingTest)
        return quality.with_warnings(*prepared.notes, *prepared.rig.tools.notes)


def _place_between_tools(
    run: FormingRun, model: ExplicitModel, thickness: float, radius: Array, area: float
) -> PreparedSpecimen:
    """Put a blank of ``thickness`` [mm] and ``area`` [mm2] between its tools."""
    checked = fitting_tools(run, thickness)
    weight = node_weights(run.fabric, run.rig.gravity_mm_per_ms2, model, area)
    test = FormingTest(run, checked.tools, thickness, radius, weight)
    facts = {"thickness_mm": thickness, "area_mm2": area}
    return PreparedSpecimen(model, test, facts=facts, notes=checked.fit.fit_warnings)


def _whole_pitches(run: FormingRun) -> tuple[int, int]:
    """Wales and courses of a blank of yarns."""
    rig, fabric = run.rig, run.fabric
    n_wales = max(round(rig.blank_width_mm / fabric.wale_spacing), 2)
    return n_wales, max(round(rig.blank_length_mm / fabric.course_spacing), 2)


def drag_ratio(run: FormingRun, prepared: PreparedSpecimen) -> float:
    """Drag of the damping on the blank at the stamp's full speed over the force that presses it down [-]."""
    assert isinstance(prepared.rig, FormingTest)
    drag = run.solver.damping_per_ms * run.solver.speed_mm_per_ms * float(prepared.model.mass.sum())
    held = float(prepared.rig.weight.sum()) + prepared.rig.holder_force
    return drag / held if held > 0.0 else np.inf if drag > 0.0 else 0.0


def _inlay_forces(forces: dict[str, Array]) -> Array:
    """Forces [N] of the inlays, of the loops where there are none."""
    inlays = forces["system"] != "knit"
    return np.asarray(forces["force_n"][inlays if inlays.any() else slice(None)])


def allowed_depth(run: FormingRun) -> float:
    """Largest allowed penetration of a tool [um]."""
    fabric = run.fabric
    if run.model.scale == "macro":
        return 1e3 * LARGEST_DEPTH_SHARE * 0.5 * fabric.thickness_mm
    heights = [one.section_mm[1] for one in fabric.inlays]
    return 1e3 * LARGEST_DEPTH_SHARE * 0.5 * min([*heights, fabric.knitting.beam_diameter_mm])


def mid_surface_at(run: FormingRun, facts: dict[str, float], history: History, frame: Frame) -> MidSurface:
    """Mid-surface over the tools in ``frame``."""
    thickness = facts["thickness_mm"]
    return measure_mid_surface(history, frame, tools_of(run, thickness), thickness, frame.coordinate)


def shear_field(run: FormingRun, mesh: Mesh, frame: Frame) -> tuple[Array, Array]:
    """Shear angle [deg] of the material, (n,), positive where yarns close up; its place, (n, 2) [mm]."""
    angle, place = material_angles(run, mesh, frame)
    return np.rad2deg(angle), place


def _shear(run: FormingRun, mesh: Mesh, frame: Frame) -> dict[str, float]:
    """Largest shear angle, and its 95th percentile in all, at the inner corners of the stamp, and elsewhere."""
    angle, place = shear_field(run, mesh, frame)
    angle = np.abs(angle)
    found = {"max_shear_angle_deg": float(angle.max()), "shear_angle_p95_deg": float(np.percentile(angle, HIGH))}
    if run.rig.stamp.kind == "stl":
        return found
    outline = stamp_outline(run.rig.stamp)
    corners = outline.span < 0.0
    if not corners.any():
        return found
    middle, radius = outline.start[corners] + 0.5 * outline.span[corners], outline.radius[corners]
    corner = outline.centre[corners] + radius[:, None] * np.column_stack([np.cos(middle), np.sin(middle)])
    near = (np.linalg.norm(place[:, None] - corner, axis=2) < NEAR_CORNER * radius).any(axis=1)
    return found | {
        "shear_angle_inner_corners_p95_deg": float(np.percentile(angle[near], HIGH)),
        "shear_angle_elsewhere_p95_deg": float(np.percentile(angle[~near], HIGH)),
    }


def _wrinkles(surface: MidSurface, thickness: float) -> dict[str, float]:
    """Height of the flange above the die, and shares of flange and bottom that do not follow their tool."""
    flange, bottom, high = surface.flange_heights, surface.stamp_distances, WRINKLE_HEIGHT * thickness
    return {
        "max_wrinkle_height_mm": float(flange.max(initial=0.0)),
        "wrinkle_height_p95_mm": float(np.percentile(flange, HIGH)) if flange.size else 0.0,
        "wrinkled_area_pct": 100.0 * float(np.mean(flange > high)) if flange.size else 0.0,
        "off_stamp_area_pct": 100.0 * float(np.mean(bottom > high)) if bottom.size else 0.0,
    }
