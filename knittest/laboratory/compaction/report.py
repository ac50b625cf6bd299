"""Report of the compaction test: thickness over pressure."""

from pathlib import Path

import numpy as np

from knittest.base.history import Body, Specimen
from knittest.experiment.curves import ReferenceCurve
from knittest.export.line_picture import Band, Level, Line, line_picture
from knittest.export.yarn_pictures import faces_picture
from knittest.laboratory.compaction.config import CompactionRun
from knittest.laboratory.compaction.test import (
    SUNK_TOLERANCE,
    UNEVEN_TOLERANCE,
    Compaction,
    plate_centres,
    plate_lengths,
    pressed_size,
)
from knittest.laboratory.compaction.van_wyk import PRESSURES, fit, loading
from knittest.laboratory.report_base import (
    Columns,
    CurveAxes,
    Gate,
    NoSize,
    References,
    Report,
    draw_energies,
    energy_gates,
    title_of,
)
from knittest.laboratory.strips import at_frames, plate_block


class CompactionReport(NoSize[CompactionRun], Report[CompactionRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "pressure_kpa", "thickness_mm", "pressure of the plates [kPa]", "thickness between the plates [mm]",
        reach="rig.max_pressure",
    )  # fmt: skip
    placed_by = ("lower_plate_mm", "upper_plate_mm")

    def gates(self, run: CompactionRun) -> list[Gate]:
        """Standard gates, and those of the plates."""
        return [
            *energy_gates(run),
            Gate("difference of the plates' forces", "results", "plate_difference_pct", UNEVEN_TOLERANCE),
            Gate("plates sunk in, of their way", "results", "plate_sunk_pct", SUNK_TOLERANCE),
        ]

    def levels(self, run: CompactionRun) -> list[Level]:
        """Thickness that the fabric file states, which was measured under a pressure of its own."""
        return [Level(run.fabric.thickness.value, f"fabric file: {run.fabric.thickness.value:g} mm")]

    def reference_curve(self, run: CompactionRun) -> ReferenceCurve | None:
        """No curve of compaction is published for the paper's fabrics."""
        return None

    def curve(self, specimens: list[Specimen]) -> Columns:
        """Rows of the first specimen in which the pressure is larger than ever before."""
        columns = specimens[0].history.curve
        grown = np.isin(columns["pressure_kpa"], loading(columns["thickness_mm"], columns["pressure_kpa"])[1])
        return {name: values[grown] for name, values in columns.items()}

    def placed(self, run: CompactionRun, specimen: Specimen) -> list[Body]:
        """Both plates, each closing by half the way."""
        history, facts = specimen.history, specimen.facts
        faces = facts["lower_plate_mm"], facts["upper_plate_mm"]
        centres, lengths = plate_centres(history.frames[0].position, faces), plate_lengths(pressed_size(run))
        offset = np.zeros((2, len(history.frames), 3))
        offset[:, :, 2] = np.outer([0.5, -0.5], at_frames(history, "compaction_mm"))
        names = ("lower plate", "upper plate")
        placed = zip(names, centres, offset, strict=True)
        return [plate_block(name, centre, lengths, moved) for name, centre, moved in placed]

    def pictures(self, run: CompactionRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png with the fitted law and the fabric file's thickness, energies.png, deformed.png."""
        lines = []
        for k, one in enumerate(specimens):
            thickness, pressure = loading(one.history.curve["thickness_mm"], one.history.curve["pressure_kpa"])
            seen = pressure >= min(PRESSURES)
            lines.append(Line(thickness[seen], pressure[seen], f"simulated, specimen {k + 1}"))
            law = fit(thickness, pressure) if k == 0 else None
            if law is not None and law.follows:
                at = np.linspace(thickness[seen].min(), min(thickness[seen].max(), 0.9999 * law.thickness), 300)
                lines.append(Line(at, law.pressure(at), f"p ~ 1/t^n - 1/t0^n, n = {law.exponent:.1f}", ":"))
        lines += [Line(c.mean, c.x, f"{c.source} ({c.kind})", "--") for c in references.curves]
        measured = run.fabric.thickness
        sd = measured.sd or 0.005 * measured.value
        ends = np.array([measured.value - sd, measured.value + sd])
        low, high = np.full(2, min(PRESSURES)), np.full(2, run.rig.max_pressure)
        line_picture(
            folder / "curve.png", lines, title=title_of(run), xlabel=self.axes.ylabel, ylabel=self.axes.xlabel,
            bands=[Band(ends, low, high, "thickness of the fabric file, ± sd; its pressure is not stated")],
            logarithmic=True,
        )  # fmt: skip
        draw_energies(run, specimens, folder, Compaction().span)
        history = specimens[0].history
        faces_picture(
            folder / "deformed.png", history.mesh, history.frames[-1], title=title_of(run),
            note=f"at {history.curve['thickness_mm'][-1]:.2f} mm between the plates",
        )  # fmt: skip
