"""Report of the bias extension test: force and normalised force over the shear angle, and the zones of the strip."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, Specimen
from knittest.base.kinds import kinds
from knittest.experiment.curves import FORCE, ReferenceCurve, noted
from knittest.experiment.curves import normalised as of_frame
from knittest.experiment.tables import PublishedValue
from knittest.export.line_picture import Line, line_picture
from knittest.export.yarn_pictures import PULLED, faces_picture
from knittest.laboratory.bias_extension.config import BiasExtensionRun
from knittest.laboratory.bias_extension.strip import BiasStrip, pin_jointed_force, strip_of
from knittest.laboratory.bias_extension.test import BiasExtension
from knittest.laboratory.bias_extension.zones import material_of, zone_picture, zone_table
from knittest.laboratory.given_data import imported_corridor
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    References,
    Report,
    draw_energies,
    same_test,
    scatter,
    title_of,
)
from knittest.laboratory.strips import STRIP_JAWS, strip_jaws
from knittest.materials.trellis import ANGLE, NORMALISED

NORMALISED_LABEL = "normalised shear force [N/mm]"
#: shear angle at which the zones are drawn [deg]
MAPPED = 30.0


class BiasExtensionReport(Report[BiasExtensionRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        ANGLE, FORCE, "shear angle of the middle, pin-jointed [deg]", "force of the clamp [N]", others=(NORMALISED,),
        labels={NORMALISED: NORMALISED_LABEL}, reach="rig.max_angle",
    )  # fmt: skip
    placed_by = STRIP_JAWS

    def scaled(self, run: BiasExtensionRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Normalised forces, which no size of a strip enters, as they are."""
        return list(rows)

    def matched(self, run: BiasExtensionRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Normalised by the size of the tested strip, or of the picture frame that it is of.

        Raises :class:`InputError` for another test, and for a force [N] of a strip of unknown size.
        """
        tested = curve.conditions
        if tested.frame_side_mm and tested.fabric_side_mm:
            return noted(of_frame(curve), "of a frame, where the whole fabric is sheared alike")
        if curve.y_name == NORMALISED and tested.test not in ("", run.rig.kind):
            return noted(curve, f"of a {tested.test} test, normalised to the same shear force")
        return normalised(same_test(run, curve))

    def size(self, run: BiasExtensionRun) -> tuple[float, str]:
        """Sheared areas over half the middle's diagonal [mm], which the force at an angle grows with."""
        strip = strip_of(run)
        return 2.0 * sum(strip.areas) / strip.middle, f"{strip.width:g} mm wide, {strip.length:g} mm between the clamps"

    def size_free(self, run: BiasExtensionRun, columns: Mapping[str, np.ndarray]) -> tuple[CurveAxes, Columns]:
        """The normalised force."""
        return replace(self.axes, y=NORMALISED, ylabel=NORMALISED_LABEL), dict(columns)

    def reference_curve(self, run: BiasExtensionRun) -> ReferenceCurve | None:
        """The fabric's own strips, normalised."""
        curve = imported_corridor(run, kinds()[run.rig.kind].published)
        return None if curve is None else self.matched(run, curve)

    def tables(self, run: BiasExtensionRun, specimens: list[Specimen]) -> dict[str, Columns]:
        """zones.csv of the first specimen."""
        history = specimens[0].history
        return {"zones.csv": zone_table(history, strip_of(run), material_of(run, history))}

    def placed(self, run: BiasExtensionRun, specimen: Specimen) -> list[Body]:
        """Both jaws."""
        return strip_jaws(specimen, axis=1)

    def pictures(self, run: BiasExtensionRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png, energies.png, zones.png, and deformed.png of yarns."""
        self._curve_picture(run, specimens, references, folder / "curve.png")
        draw_energies(run, specimens, folder, BiasExtension().span)
        history = specimens[0].history
        frame, material = min(history.frames, key=lambda one: abs(one.coordinate - MAPPED)), material_of(run, history)
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

    def _curve_picture(
        self, run: BiasExtensionRun, specimens: list[Specimen], references: References, path: Path
    ) -> None:
        """Picture of the force, in N, or normalised beside references, which are; shells beside pin-jointed yarns."""
        beside = bool(references.curves)
        column, label = (NORMALISED, NORMALISED_LABEL) if beside else (FORCE, self.axes.ylabel)
        lines = [
            Line(s.history.curve[ANGLE], s.history.curve[column], f"simulated, specimen {k}")
            for k, s in enumerate(specimens, 1)
        ]
        if run.model.scale == "macro":
            angle = specimens[0].history.curve[ANGLE]
            lines.append(Line(angle, _by_the_law(run, np.deg2rad(angle), beside), "shear law, pin-jointed yarns", ":"))
        lines += [Line(c.x, c.mean, f"{c.source} ({c.kind})", "--") for c in references.curves]
        line_picture(
            path, lines, title=title_of(run), xlabel=self.axes.xlabel, ylabel=label, levels=self.levels(run),
            bands=scatter(references.curves),
        )  # fmt: skip


def _by_the_law(run: BiasExtensionRun, angle: np.ndarray, beside: bool) -> np.ndarray:
    """Force [N], or normalised force [N/mm], of pin-jointed yarns under the fabric's shear law at ``angle`` [rad]."""
    strip = strip_of(run)
    force = pin_jointed_force(run, strip, angle)
    return strip.normalised(force, angle) if beside else force


def normalised(curve: ReferenceCurve) -> ReferenceCurve:
    """``curve`` of a strip as normalised shear force [N/mm]; raises :class:`InputError` for a force [N] of a strip of
    unknown size.
    """
    if curve.y_name == NORMALISED:
        return curve
    length, width = curve.conditions.gauge_length_mm, curve.conditions.strip_width_mm
    if curve.y_name != FORCE or length is None or width is None:
        sizes = {"gauge_length_mm": length, "strip_width_mm": width}
        missing = " and ".join(f"'# {name}: ...'" for name, size in sizes.items() if size is None)
        raise InputError(
            f"{curve.file or curve.source}: {curve.y_name} of a strip on the bias: expected a column {NORMALISED}, or "
            f"{FORCE} of the clamp and in the header {missing or 'both sizes'} (options --gauge-length, --width)"
        )
    force = BiasStrip(length, width).normalised(curve.mean, np.deg2rad(curve.x))
    note = f"normalised by its own size, {width:g} mm wide, {length:g} mm between the clamps"
    return noted(replace(curve, mean=force, sd=None, y_name=NORMALISED), note)
