"""Report of the picture frame: force over shear angle, the map of the wrinkles, a laboratory's cycles, yarn
friction.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, Specimen
from knittest.base.kinds import kinds
from knittest.experiment.conditions import EXACT
from knittest.experiment.curves import ReferenceCurve, normalised
from knittest.experiment.tables import PublishedValue, friction_curves, left_out, with_factors, with_note
from knittest.export.line_picture import Band, Line, Span, line_picture
from knittest.export.yarn_pictures import PULLED, faces_picture
from knittest.laboratory.given_data import imported_corridor
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.lab_files import LAST, LOSS, ROWS_OF_A_RUN, SAME_TURN, WORK
from knittest.laboratory.picture_frame.pictures import FrameShape, height_picture, shear_picture
from knittest.laboratory.picture_frame.rig import bars, starting
from knittest.laboratory.picture_frame.test import (
    FRAME_SIDES,
    MAPPED,
    PictureFrame,
    fabric_side,
    frame_at,
    material_angles,
    material_scatter,
    measure_wrinkles,
)
from knittest.laboratory.records import Study
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    References,
    Report,
    draw_energies,
    same_test,
    scatter,
    title_of,
    unless_one,
)
from knittest.laboratory.strips import angle_table, crossing_angles
from knittest.materials.trellis import NORMALISED, crosshead_of_normalised


def other_cycles(run: PictureFrameRun, row: PublishedValue) -> str:
    """Reason why ``row`` is of other cycles than those of ``run``; empty if it is not, or where either has none."""
    rig, count, turn = run.rig, row.conditions.cycles, row.conditions.cycle_angle_deg
    if row.quantity not in ROWS_OF_A_RUN or not rig.cycles:
        return ""
    if count is None or turn is None:
        return "cycles of an unknown number and angle: expected rows cycles and cycle_angle_deg of the same variant"
    if not math.isclose(turn, rig.max_angle, rel_tol=SAME_TURN):
        return (
            f"cycles up to {turn:.4g} deg, the run's go to {rig.max_angle:g}: --set rig.max_angle={turn:.4g} makes "
            "them comparable"
        )
    if row.quantity == LAST and 1 < rig.cycles != count:
        return f"the last of {count:g} cycles, the run has {rig.cycles}: --set rig.cycles={count:g} makes it comparable"
    return ""


def for_cycles(run: PictureFrameRun, row: PublishedValue) -> PublishedValue:
    """``row`` for the square of ``run``, with whose area its work grows; says so, and of how many cycles it is the
    first where the run has another number.
    """
    side = run.rig.side_mm
    count, own = row.conditions.cycles, row.conditions.fabric_side_mm
    notes = [f"the first of {count:g}"] if run.rig.cycles and count is not None and count != run.rig.cycles else []
    if row.quantity in (WORK, LOSS) and own is not None and not math.isclose(own, side, rel_tol=EXACT):
        factor = (side / own) ** 2
        row = replace(row, mean=row.mean * factor, sd=row.sd * factor)
        notes.append(f"for a square of {side:.4g} instead of {own:g} mm")
    return with_note(row, ", ".join(notes))


#: units of what grows with the square
GROWING = ("N", "mJ")
NORMALISED_LABEL = r"normalised shear force $F_s L_{frame} / L_{fabric}^2$ [N/mm]"


class PictureFrameReport(Report[PictureFrameRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "frame_shear_angle_deg",
        "shear_force_n",
        "shear angle of the frame [deg]",
        "force of the crosshead [N]",
        others=(NORMALISED,),
        labels={NORMALISED: NORMALISED_LABEL},
        reach="rig.max_angle",
    )
    placed_by = FRAME_SIDES

    def scaled(self, run: PictureFrameRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Forces of the crosshead and work of cycles for the run's sides, and said so; normalised ones as they are;
        without rows of other cycles than the run's.

        Raises :class:`InputError` where the table states no sides.
        """
        size, words = self.size(run)
        found = [_for_size(row, size, words) if row.quantity.startswith("shear_force") else row for row in rows]
        found = [
            for_cycles(run, row) if row.quantity in ROWS_OF_A_RUN else row
            for row in found
            if not other_cycles(run, row)
        ]
        what = f"{fabric_side(run):.4g} mm modelled, in whole pitches"
        return [with_factors(row, self.factors(run), what) if row.unit in GROWING else row for row in found]

    def factors(self, run: PictureFrameRun) -> tuple[float, ...]:
        """Area of the square over that of the whole pitches in it, with which forces and work grow."""
        return unless_one([(run.rig.side_mm / fabric_side(run)) ** 2] * run.variability.specimens)

    def apart(self, run: PictureFrameRun, rows: Sequence[PublishedValue]) -> list[str]:
        """Rows of cycles up to another angle, and of the last of another number of cycles."""
        return left_out((row, other_cycles(run, row)) for row in rows)

    def matched(self, run: PictureFrameRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Normalised by the sides of the tested frame, so that the run's sides do not matter."""
        return normalised(same_test(run, curve))

    def size(self, run: PictureFrameRun) -> tuple[float, str]:
        """L_fabric^2 / L_frame [mm], which the force at an angle grows with."""
        side = run.rig.frame_side or run.rig.side
        return run.rig.side**2 / side, f"square of {run.rig.side:g} mm in a frame of {side:g} mm"

    def size_free(self, run: PictureFrameRun, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """The normalised force."""
        return replace(self.axes, y=NORMALISED, ylabel=NORMALISED_LABEL), dict(columns)

    def reference_curve(self, run: PictureFrameRun) -> ReferenceCurve | None:
        """The fabric's own frames, normalised; of the paper's fabrics no shear force is published."""
        curve = imported_corridor(run, kinds()[run.rig.kind].published)
        return None if curve is None else self.matched(run, curve)

    def tables(self, run: PictureFrameRun, specimens: list[Specimen]) -> dict[str, Columns]:
        """shear-angle.csv of the first specimen."""
        return {"shear-angle.csv": angle_table(material_scatter(specimens[0].history))}

    def placed(self, run: PictureFrameRun, specimen: Specimen) -> list[Body]:
        """The four bars."""
        weft, warp = (specimen.facts[name] for name in FRAME_SIDES)
        return bars(specimen.history, (weft, warp))

    def pictures(self, run: PictureFrameRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png, energies.png, wrinkles.png, shear-angle.png, and deformed.png of yarns."""
        self._curve_picture(run, specimens, references, folder / "curve.png")
        draw_energies(run, specimens, folder, PictureFrame().span)
        history = specimens[0].history
        frame = frame_at(history, MAPPED)
        found = measure_wrinkles(frame, history, run.rig.side)
        note = (
            f"at {frame.coordinate:.1f} deg: amplitude {found.amplitude:.2f} mm, {found.count} crests across the pull"
        )
        sides = run.rig.frame_side or run.rig.side, fabric_side(run)
        shape = FrameShape(max(sides), (1.0 - run.rig.mounting_slack_fraction) * sides[1], frame.coordinate)
        height_picture(
            folder / "wrinkles.png", found.x, found.y, found.height, title=title_of(run), note=note, shape=shape
        )
        if history.mesh.kind == "beams":
            places = crossing_angles(history.mesh, frame)[1]
            faces_picture(
                folder / "deformed.png", history.mesh, frame, title=title_of(run),
                note=f"frame at {frame.coordinate:.1f} deg", axes_labels=PULLED,
            )  # fmt: skip
        else:
            places = frame.position[history.mesh.cells][:, :, :2]
        shear_picture(
            folder / "shear-angle.png", angle_table(material_scatter(history)), places,
            np.rad2deg(material_angles(history.mesh, frame)) - frame.coordinate, title=title_of(run),
            shape=shape,
        )  # fmt: skip

    def _curve_picture(
        self, run: PictureFrameRun, specimens: list[Specimen], references: References, path: Path
    ) -> None:
        """Picture of the force, in N, or normalised beside references, which are."""
        beside = bool(references.curves)
        column, label = (NORMALISED, NORMALISED_LABEL) if beside else (self.axes.y, self.axes.ylabel)
        lines = []
        for k, s in enumerate(specimens):
            first = s.history.curve
            lines.append(Line(first[self.axes.x], first[column], f"simulated, specimen {k + 1}"))
        lines += [Line(c.x, c.mean, f"{c.source} ({c.kind})", "--") for c in references.curves]
        lines += _other_friction(run, beside)
        line_picture(
            path, lines, title=title_of(run), xlabel=self.axes.xlabel, ylabel=label, levels=self.levels(run),
            bands=[*scatter(references.curves), *_range(references.curves)],
            spans=[Span(0.0, starting(run), "start-up: the fabric's inertia")],
        )  # fmt: skip


def _for_size(row: PublishedValue, size: float, words: str) -> PublishedValue:
    """A crosshead force at an angle, which grows with L_fabric^2 / L_frame [mm], for ``size`` of it."""
    fabric, frame = row.conditions.fabric_side_mm, row.conditions.frame_side_mm
    if fabric is None or frame is None:
        raise InputError(
            f"{row.file}: {row.quantity} of a frame of unknown sides: expected rows frame_side_mm and fabric_side_mm "
            "[mm] of the same variant; knittest data import --test picture-frame writes them"
        )
    factor = size * frame / fabric**2
    if math.isclose(factor, 1.0, rel_tol=EXACT):
        return row
    note = f"for a {words} instead of {fabric:g} in {frame:g} mm"
    return with_note(replace(row, mean=row.mean * factor, sd=row.sd * factor), note)


def _other_friction(run: PictureFrameRun, as_normalised: bool) -> list[Line]:
    """The shipped sweep over yarn-yarn friction, which is not published: for yarns, scaled to this frame."""
    if run.model.scale != "meso":
        return []
    sides = fabric_side(run), run.rig.frame_side or run.rig.side
    lines = []
    for curve in friction_curves(run.fabric.name):
        newton = crosshead_of_normalised(curve.force, np.deg2rad(curve.angle), *sides)
        label = f"yarn-yarn friction {curve.coefficient:g} (simulated, calibrated)"
        lines.append(Line(curve.angle, curve.force if as_normalised else newton, label, ":"))
    return lines


def _range(curves: list[ReferenceCurve]) -> list[Band]:
    """Band between the references, where all of them are."""
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
    used, sides = run.fabric.contact.friction_coefficient, (fabric_side(run), run.rig.frame_side or run.rig.side)
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
