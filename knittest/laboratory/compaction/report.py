"""Report of the compaction test: thickness over pressure."""

from pathlib import Path

import numpy as np

from knittest.base.history import Body, Specimen
from knittest.export.line_picture import Band, Level, Line
from knittest.laboratory.compaction.config import CompactionRun
from knittest.laboratory.compaction.test import SUNK_TOLERANCE, UNEVEN_TOLERANCE, plates, whole_pitches
from knittest.laboratory.compaction.van_wyk import PRESSURES, first_loading, fit
from knittest.laboratory.report_base import Columns, CurveAxes, FabricReport, QualityCheck, References, SizeFreeReport
from knittest.laboratory.strips import offsets, two_plates


class CompactionReport(SizeFreeReport[CompactionRun], FabricReport[CompactionRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "pressure_kpa", "thickness_mm", "pressure of the plates [kPa]", "thickness between the plates [mm]",
        reach="rig.max_pressure",
    )  # fmt: skip
    placement_facts = ("lower_plate_mm", "upper_plate_mm")

    def quality_checks(self, run: CompactionRun) -> list[QualityCheck]:
        """Standard checks, and those of the plates."""
        return [
            *super().quality_checks(run),
            QualityCheck("difference of the plates' forces", "results", "plate_difference_pct", UNEVEN_TOLERANCE),
            QualityCheck("penetration of the plates over their travel", "results", "plate_sunk_pct", SUNK_TOLERANCE),
        ]

    def levels(self, run: CompactionRun) -> list[Level]:
        """Thickness of the fabric file, measured under a pressure of its own."""
        return [Level(run.fabric.thickness.value, f"fabric file: {run.fabric.thickness.value:g} mm")]

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Rows of the first specimen with a larger pressure than before."""
        columns = specimens[0].history.curve
        grown = np.isin(columns["pressure_kpa"], first_loading(columns["thickness_mm"], columns["pressure_kpa"])[1])
        return {name: values[grown] for name, values in columns.items()}

    def placed(self, run: CompactionRun, specimen: Specimen) -> list[Body]:
        """Both plates, each closing by half the travel."""
        history, facts = specimen.history, specimen.facts
        faces = facts["lower_plate_mm"], facts["upper_plate_mm"]
        moved = [offsets(history, {2: "compaction_mm"}, way) for way in (0.5, -0.5)]
        return two_plates(*plates(history.frames[0].position, faces, whole_pitches(run)[1]), moved)

    def draw_curve(self, run: CompactionRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw pressure over thickness with the fitted law and the fabric file's thickness."""
        lines = []
        for k, one in enumerate(specimens):
            thickness, pressure = first_loading(one.history.curve["thickness_mm"], one.history.curve["pressure_kpa"])
            seen = pressure >= min(PRESSURES)
            lines.append(Line(thickness[seen], pressure[seen], f"simulated, specimen {k + 1}"))
            law = fit(thickness, pressure) if k == 0 else None
            if law is not None and law.follows:
                at = np.linspace(thickness[seen].min(), min(thickness[seen].max(), 0.9999 * law.thickness), 300)
                lines.append(Line(at, law.pressure(at), f"p ~ 1/t^n - 1/t0^n, n = {law.exponent:.1f}", ":"))
        curves, measured = references.curves, run.fabric.thickness
        lines += [Line(c.mean, c.x, f"{c.source} ({c.kind})", "--") for c in curves]
        sd = measured.sd or 0.005 * measured.value
        ends = np.array([measured.value - sd, measured.value + sd])
        low, high = np.full(2, min(PRESSURES)), np.full(2, run.rig.max_pressure)
        self.draw_lines(
            run, lines, References(), path, xlabel=self.axes.ylabel, ylabel=self.axes.xlabel, levels=(),
            bands=[Band(ends, low, high, "thickness of the fabric file, ± sd; its pressure is not stated")],
            logarithmic=True,
        )  # fmt: skip

    def note(self, specimen: Specimen) -> str:
        """Thickness at the end."""
        return f"at {specimen.history.curve['thickness_mm'][-1]:.2f} mm between the plates"
