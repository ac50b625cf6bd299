"""Report of the picture frame: force over shear angle, wrinkles, cycles of a laboratory, yarn friction."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Array, Body, Specimen
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import ReferenceCurve, normalise_force
from knittest.experiment.tables import PublishedValue, friction_curves, rejected_row_lines, with_factors, with_note
from knittest.export.line_picture import Band, Line, Span
from knittest.export.yarn_pictures import PULLED, faces_picture
from knittest.laboratory.base import nontrivial_factors
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.lab_files import CYCLE_QUANTITIES, LAST, LOSS, SAME_TURN, WORK
from knittest.laboratory.picture_frame.pictures import FrameShape, height_picture, shear_picture
from knittest.laboratory.picture_frame.rig import bars, start_up_angle
from knittest.laboratory.picture_frame.test import (
    FRAME_SIDES,
    MAPPED_ANGLE,
    fabric_side,
    frame_at,
    material_scatter,
    measure_wrinkles,
)
from knittest.laboratory.records import Study
from knittest.laboratory.reference_curves import matched_corridor
from knittest.laboratory.report_base import (
    CurveAxes,
    FabricReport,
    References,
    check_same_test,
    scatter_bands,
    size_of,
    title_of,
)
from knittest.laboratory.strips import angle_table, material_angles
from knittest.materials.trellis import NORMALISED, crosshead_of_normalised


def cycle_mismatch(run: PictureFrameRun, row: PublishedValue) -> str:
    """Reason why the cycles of ``row`` are not those of ``run``; empty if they are, or where either has none."""
    rig, count, turn = run.rig, row.conditions.cycles, row.conditions.cycle_angle_deg
    if row.quantity not in CYCLE_QUANTITIES or not rig.cycles:
        return ""
    if count is None or turn is None:
        return "unknown number and angle of its cycles: expected rows cycles and cycle_angle_deg of the same variant"
    if not math.isclose(turn, rig.max_angle, rel_tol=SAME_TURN):
        return (
            f"cycles up to {turn:.4g} deg, in the run up to {rig.max_angle:g}: compare with "
            f"--set rig.max_angle={turn:.4g}"
        )
    if row.quantity == LAST and 1 < rig.cycles != count:
        return f"the last of {count:g} cycles, the run has {rig.cycles}: compare with --set rig.cycles={count:g}"
    return ""


def scale_cycle_row(run: PictureFrameRun, row: PublishedValue) -> PublishedValue:
    """``row`` scaled to the area of the square of ``run``, with a note on another number of cycles."""
    side = run.rig.side_mm
    count, own = row.conditions.cycles, row.conditions.fabric_side_mm
    notes = [f"the first of {count:g}"] if run.rig.cycles and count is not None and count != run.rig.cycles else []
    if row.quantity in (WORK, LOSS) and own is not None and not math.isclose(own, side, rel_tol=EXACT):
        factor = (side / own) ** 2
        row = replace(row, mean=row.mean * factor, sd=row.sd * factor)
        notes.append(f"for a square of {side:.4g} instead of {own:g} mm")
    return with_note(row, ", ".join(notes))


#: units of what grows with the square
SIZE_UNITS = ("N", "mJ")
NORMALISED_LABEL = r"normalised shear force $F_s L_{frame} / L_{fabric}^2$ [N/mm]"


class PictureFrameReport(FabricReport[PictureFrameRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "frame_shear_angle_deg", "shear_force_n", "shear angle of the frame [deg]", "force of the crosshead [N]",
        others=(NORMALISED,), labels={NORMALISED: NORMALISED_LABEL}, reach="rig.max_angle",
    )  # fmt: skip
    placement_facts = FRAME_SIDES

    def scaled(self, run: PictureFrameRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Scale forces and work to the run's sides, without other cycles; raises :class:`InputError` without sides."""
        size, words = self.size(run)
        what, found = f"{fabric_side(run):.4g} mm modelled, in whole pitches", []
        for row in rows:
            if cycle_mismatch(run, row):
                continue
            one = _scale_to_size(row, size, words) if row.quantity.startswith("shear_force") else row
            one = scale_cycle_row(run, one) if row.quantity in CYCLE_QUANTITIES else one
            found.append(with_factors(one, self.factors(run), what) if one.unit in SIZE_UNITS else one)
        return found

    def factors(self, run: PictureFrameRun) -> tuple[float, ...]:
        """Area of the square over that of its whole pitches, to which forces and work are proportional."""
        return nontrivial_factors([(run.rig.side_mm / fabric_side(run)) ** 2] * run.variability.specimens)

    def apart(self, run: PictureFrameRun, rows: Sequence[PublishedValue]) -> list[str]:
        """Rows of cycles up to another angle, and of the last of another number of cycles."""
        return rejected_row_lines((row, cycle_mismatch(run, row)) for row in rows)

    def scale_curve(self, run: PictureFrameRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Normalise by the sides of the tested frame."""
        return normalise_force(check_same_test(run, curve))

    def size(self, run: PictureFrameRun) -> tuple[float, str]:
        """L_fabric^2 / L_frame [mm], to which the force at an angle is proportional."""
        (words,) = size_of(run)
        return run.rig.side**2 / run.rig.outer_side, words

    def size_free_curve(
        self, run: PictureFrameRun, columns: Mapping[str, np.ndarray]
    ) -> tuple[CurveAxes, dict[str, Array]]:
        """The normalised force."""
        return replace(self.axes, y=NORMALISED, ylabel=NORMALISED_LABEL), dict(columns)

    def reference_curve(self, run: PictureFrameRun) -> ReferenceCurve | None:
        """Corridor of the fabric's own frames, normalised."""
        return matched_corridor(run)

    def tables(self, run: PictureFrameRun, specimens: list[Specimen]) -> dict[str, dict[str, Array]]:
        """shear-angle.csv of the first specimen."""
        return {"shear-angle.csv": angle_table(material_scatter(run, specimens[0].history))}

    def placed(self, run: PictureFrameRun, specimen: Specimen) -> list[Body]:
        """The four bars."""
        weft, warp = (specimen.facts[name] for name in FRAME_SIDES)
        return bars(specimen.history, (weft, warp))

    def draw_specimen(self, run: PictureFrameRun, specimen: Specimen, folder: Path) -> None:
        """Draw wrinkles.png, shear-angle.png, and deformed.png of a meso model."""
        history, title = specimen.history, title_of(run)
        frame = frame_at(history, MAPPED_ANGLE)
        found = measure_wrinkles(frame, history, run.rig.side)
        at = f"at {frame.coordinate:.1f} deg"
        note = f"{at}: amplitude {found.amplitude:.2f} mm, {found.count} crests across the pull"
        sides = run.rig.outer_side, fabric_side(run)
        shape = FrameShape(max(sides), (1.0 - run.rig.mounting_slack_fraction) * sides[1], frame.coordinate)
        height_picture(folder / "wrinkles.png", found.x, found.y, found.height, title=title, note=note, shape=shape)
        angle, places = material_angles(run, history.mesh, frame)
        if history.mesh.kind == "beams":
            path = folder / "deformed.png"
            faces_picture(path, history.mesh, frame, title=title, note=f"frame {at}", axes_labels=PULLED)
        else:
            places = frame.position[history.mesh.cells][:, :, :2]
        difference = np.rad2deg(angle) - frame.coordinate
        table = angle_table(material_scatter(run, history))
        shear_picture(folder / "shear-angle.png", table, places, difference, title=title, shape=shape)

    def draw_curve(self, run: PictureFrameRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw the force [N], or with references the normalised force."""
        curves = references.curves
        column, label = (NORMALISED, NORMALISED_LABEL) if curves else (self.axes.y, self.axes.ylabel)
        lines = [*self.simulated(specimens, column), *_friction_lines(run, bool(curves))]
        start_up = Span(0.0, start_up_angle(run), "start-up: the fabric's inertia")
        bands = [*scatter_bands(curves), *_range_bands(curves)]
        self.draw_lines(run, lines, references, path, ylabel=label, bands=bands, spans=[start_up])


def _scale_to_size(row: PublishedValue, size: float, words: str) -> PublishedValue:
    fabric, frame = row.conditions.fabric_side_mm, row.conditions.frame_side_mm
    if fabric is None or frame is None:
        raise InputError(
            f"{row.file}: {row.quantity} of a frame with unknown sides: expected rows frame_side_mm and fabric_side_mm "
            "[mm] of the same variant, as knittest data import --test picture-frame writes them"
        )
    factor = size * frame / fabric**2
    if math.isclose(factor, 1.0, rel_tol=EXACT):
        return row
    note = f"for a {words} instead of {fabric:g} in {frame:g} mm"
    return with_note(replace(row, mean=row.mean * factor, sd=row.sd * factor), note)


def _friction_lines(run: PictureFrameRun, as_normalised: bool) -> list[Line]:
    """Lines of the shipped sweep over yarn-yarn friction, scaled to this frame of yarns."""
    if run.model.scale != "meso":
        return []
    sides, lines = (fabric_side(run), run.rig.outer_side), []
    for curve in friction_curves(run.fabric.name):
        newton = crosshead_of_normalised(curve.force, np.deg2rad(curve.angle), *sides)
        label = f"yarn-yarn friction {curve.coefficient:g} (simulated, calibrated)"
        lines.append(Line(curve.angle, curve.force if as_normalised else newton, label, ":"))
    return lines


def _range_bands(curves: list[ReferenceCurve]) -> list[Band]:
    low, high = max((c.x[0] for c in curves), default=0.0), min((c.x[-1] for c in curves), default=0.0)
    if len(curves) < 2 or not high > low:
        return []
    x = np.linspace(low, high, 200)
    values = np.array([np.interp(x, c.x, c.mean) for c in curves])
    return [Band(x, values.min(axis=0), values.max(axis=0), f"range of the {len(curves)} references")]


#: shear angles of the table [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)


def study(run: PictureFrameRun, results: Mapping[str, object]) -> Study | None:
    """The shipped sweep, scaled to the frame of ``run``, and what ``run`` itself found; none of shells."""
    curves = friction_curves(run.fabric.name) if run.model.scale == "meso" else []
    if not curves:
        return None
    used, sides = run.fabric.contact.friction_coefficient, (fabric_side(run), run.rig.outer_side)
    rows: list[tuple[str, tuple[float, ...]]] = []
    for curve in curves:
        force = np.interp(ANGLES, curve.angle, curve.force, right=np.nan)
        newton = crosshead_of_normalised(force, np.deg2rad(ANGLES), *sides)
        rows.append((f"sweep, {curve.coefficient:g}", tuple(float(f) for f in newton)))
    own = results.get("shear_force_n_at_deg")
    if isinstance(own, dict):
        values = (own.get(f"{angle:g}") for angle in ANGLES)
        numbers = tuple(v if isinstance(v, float) else np.nan for v in values)
        rows.append((f"this run, {used.value:g} ({used.source})", numbers))
    return Study(
        "Force of the crosshead [N] by yarn-yarn friction: a shipped sweep, scaled to the size of this frame",
        ("yarn-yarn friction coefficient", *(f"{angle:g} deg" for angle in ANGLES)),
        tuple(rows),
        "The coefficient is not published. The sweep was simulated on squares of 50 mm with the set calibrated; "
        "knittest batch repeats it.",
    )
