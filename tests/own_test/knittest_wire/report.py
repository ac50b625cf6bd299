"""Report of the wire."""

from pathlib import Path

import numpy as np

from knittest.base.history import Specimen
from knittest.experiment.curves import ReferenceCurve
from knittest.export.line_picture import Level, Line, line_picture
from knittest.laboratory.quality_checks import Span
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    QualityCheck,
    References,
    SizeFreeReport,
    draw_energies,
    energy_checks,
    title_of,
)
from knittest_wire.config import WireRun


class WireReport(SizeFreeReport):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("strain_pct", "force_n", "strain [%]", "force [N]")

    def levels(self, run: WireRun) -> list[Level]:
        """Hooke's force at the end."""
        return [Level(0.01 * run.rig.max_strain * run.rig.stiffness, "EA times strain")]

    def quality_checks(self, run: WireRun) -> list[QualityCheck]:
        """Standard quality checks."""
        return energy_checks(run)

    def reference_curve(self, run: WireRun) -> ReferenceCurve | None:
        """Nothing is published."""
        return None

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Channels of the first wire."""
        return specimens[0].history.curve

    def tables(self, run: WireRun, specimens: list[Specimen]) -> dict[str, Columns]:
        """elements.csv: strain of each element at the end."""
        first, last = (f.position[:, 0] for f in (specimens[0].history.frames[0], specimens[0].history.frames[-1]))
        return {"elements.csv": {"x_mm": first[:-1], "strain_pct": 100.0 * (np.diff(last) / np.diff(first) - 1.0)}}

    def pictures(self, run: WireRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png and energies.png."""
        curve = specimens[0].history.curve
        line_picture(
            folder / "curve.png", [Line(curve["strain_pct"], curve["force_n"], "simulated")], title=title_of(run),
            xlabel=self.axes.xlabel, ylabel=self.axes.ylabel, levels=self.levels(run),
        )  # fmt: skip
        draw_energies(run, specimens, folder, lambda history: Span())
