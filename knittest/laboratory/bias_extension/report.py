"""Report of the bias extension test: force and normalised force over the shear angle, and the zones of the strip."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, Specimen
from knittest.experiment.curves import FORCE, ReferenceCurve, add_note
from knittest.experiment.curves import normalise_force as of_frame
from knittest.export.line_picture import Line
from knittest.export.yarn_pictures import PULLED, faces_picture
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.strip import BiasStrip, pin_jointed_force, strip_of
from knittest.laboratory.bias_extension.zones import material_points, zone_picture, zone_table
from knittest.laboratory.reference_curves import matched_corridor
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    FabricReport,
    References,
    SizeFreeReport,
    check_same_test,
    title_of,
)
from knittest.laboratory.strips import STRIP_JAWS, strip_jaws
from knittest.materials.trellis import ANGLE, NORMALISED

NORMALISED_LABEL = "normalised shear force [N/mm]"
#: shear angle at which the zones are drawn [deg]
MAPPED_ANGLE = 30.0


class BiasExtensionReport(SizeFreeReport[BiasExtensionRun], FabricReport[BiasExtensionRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        ANGLE, FORCE, "shear angle of the middle, pin-jointed [deg]", "force of the clamp [N]", others=(NORMALISED,),
        labels={NORMALISED: NORMALISED_LABEL}, reach="rig.max_angle",
    )  # fmt: skip
    placement_facts = STRIP_JAWS

    def scale_curve(self, run: BiasExtensionRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Normalise ``curve`` by its strip or frame; raises :class:`InputError` for another test or unknown size."""
        tested = curve.conditions
        if tested.frame_side_mm and tested.fabric_side_mm:
            return add_note(of_frame(curve), "of a picture frame, which shears the whole fabric alike")
        if curve.y_name == NORMALISED and tested.test not in ("", run.rig.kind):
            return add_note(curve, f"of a {tested.test} test, normalised to the same shear force")
        return normalise_curve(check_same_test(run, curve))

    def size(self, run: BiasExtensionRun) -> tuple[float, str]:
        """Sheared areas over half the middle's diagonal [mm], to which the force is proportional."""
        strip = strip_of(run)
        return 2.0 * sum(strip.areas) / strip.middle, f"{strip.width:g} mm wide, {strip.length:g} mm between the clamps"

    def size_free_curve(self, run: BiasExtensionRun, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """The normalised force."""
        return replace(self.axes, y=NORMALISED, ylabel=NORMALISED_LABEL), dict(columns)

    def reference_curve(self, run: BiasExtensionRun) -> ReferenceCurve | None:
        """Corridor of the fabric's own strips, normalised."""
        return matched_corridor(run)

    def tables(self, run: BiasExtensionRun, specimens: list[Specimen]) -> dict[str, Columns]:
        """zones.csv of the first specimen."""
        history = specimens[0].history
        return {"zones.csv": zone_table(history, strip_of(run), material_points(run, history))}

    def placed(self, run: BiasExtensionRun, specimen: Specimen) -> list[Body]:
        """Both jaws."""
        return strip_jaws(specimen, axis=1)

    def draw_specimen(self, run: BiasExtensionRun, specimen: Specimen, folder: Path) -> None:
        """Draw zones.png, and deformed.png of a meso model."""
        history = specimen.history
        frame, material = (
            min(history.frames, key=lambda one: abs(one.coordinate - MAPPED_ANGLE)),
            material_points(run, history),
        )
        zone_picture(
            folder / "zones.png", zone_table(history, strip_of(run), material), material.drawn(frame),
            np.rad2deg(material.angles(frame)), title=title_of(run),
            where=f"at {frame.coordinate:.1f} deg of pin-jointed yarns",
        )  # fmt: skip
        if history.mesh.kind == "beams":
            note = f"at {frame.coordinate:.1f} deg"
            faces_picture(
                folder / "deformed.png", history.mesh, frame, title=title_of(run), note=note, axes_labels=PULLED
            )

    def draw_curve(self, run: BiasExtensionRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw the force [N], or with references the normalised force; of shells also that of pin-jointed yarns."""
        column, label = (NORMALISED, NORMALISED_LABEL) if references.curves else (FORCE, self.axes.ylabel)
        lines = self.simulated(specimens, column)
        if run.model.scale == "macro":
            strip, angle = strip_of(run), specimens[0].history.curve[ANGLE]
            force = pin_jointed_force(run, strip, np.deg2rad(angle))
            force = strip.normalised_force(force, np.deg2rad(angle)) if references.curves else force
            lines.append(Line(angle, force, "shear law, pin-jointed yarns", ":"))
        self.draw_lines(run, lines, references, path, ylabel=label)


def normalise_curve(curve: ReferenceCurve) -> ReferenceCurve:
    """Normalised shear force [N/mm] of a strip; raises :class:`InputError` for a force [N] without the strip's size."""
    if curve.y_name == NORMALISED:
        return curve
    length, width = curve.conditions.gauge_length_mm, curve.conditions.strip_width_mm
    if curve.y_name != FORCE or length is None or width is None:
        sizes = {"gauge_length_mm": length, "strip_width_mm": width}
        missing = " and ".join(f"'# {name}: ...'" for name, size in sizes.items() if size is None)
        raise InputError(
            f"{curve.file or curve.source}: {curve.y_name} of a bias strip: expected a column {NORMALISED}, or "
            f"{FORCE} of the clamp with {missing or 'both sizes'} in the header (--gauge-length, --width)"
        )
    force = BiasStrip(length, width).normalised_force(curve.mean, np.deg2rad(curve.x))
    note = f"normalised by its own size, {width:g} mm wide, {length:g} mm between the clamps"
    return add_note(replace(curve, mean=force, sd=None, y_name=NORMALISED), note)
