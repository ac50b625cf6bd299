"""Report of the picture frame: force over shear angle, and the map of the wrinkles."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from knittest.compare import compare_curves
from knittest.config.run import PictureFrameRun
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import PublishedValue
from knittest.export.line_picture import Level, Line, line_picture
from knittest.export.map_picture import height_picture
from knittest.laboratory.picture_frame import MAPPED, frame_at
from knittest.laboratory.wrinkles import measure_wrinkles
from knittest.reports.base import Columns, CurveAxes, Gate, References, draw_energies, energy_gates, title_of
from knittest.specimen import Specimen


class PictureFrameReport:
    """See :class:`knittest.reports.base.Report`."""

    axes = CurveAxes(
        "frame_shear_angle_deg", "shear_force_n", "shear angle of the frame [deg]", "force of the crosshead [N]"
    )

    def levels(self, run: PictureFrameRun) -> list[Level]:
        """There is none."""
        return []

    def gates(self, run: PictureFrameRun) -> list[Gate]:
        """Those of every test."""
        return energy_gates(run)

    def scaled(self, run: PictureFrameRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """As they are: nothing of it grows with the specimen."""
        return list(rows)

    def reference_curve(self, run: PictureFrameRun) -> ReferenceCurve | None:
        """No shear force is published."""
        return None

    def compare(self, run: PictureFrameRun, specimens: list[Specimen], curve: ReferenceCurve) -> list[dict[str, Any]]:
        """Force over frame shear angle."""
        found = specimens[0].history.curve
        return [compare_curves(found["frame_shear_angle_deg"], found["shear_force_n"], curve)]

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Channels of the first specimen."""
        return specimens[0].history.curve

    def pictures(self, run: PictureFrameRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png, energies.png, wrinkles.png."""
        lines = [
            Line(
                s.history.curve["frame_shear_angle_deg"],
                s.history.curve["shear_force_n"],
                f"simulated, specimen {k + 1}",
            )
            for k, s in enumerate(specimens)
        ]
        line_picture(
            folder / "curve.png", lines, title=title_of(run), xlabel=self.axes.xlabel, ylabel=self.axes.ylabel,
        )  # fmt: skip
        draw_energies(run, specimens, folder)
        frame = frame_at(specimens[0].history, MAPPED)
        found = measure_wrinkles(frame, specimens[0].history, run.rig.side)
        note = (
            f"at {frame.coordinate:.1f} deg: amplitude {found.amplitude:.2f} mm, {found.count} crests across the pull"
        )
        height_picture(folder / "wrinkles.png", found.x, found.y, found.height, title=title_of(run), note=note)
