"""Report of the cell test: conjugate force over the path, energies, and the cell at its end."""

from functools import partial
from pathlib import Path

from knittest.base.history import Specimen
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.cell.test import checked_span
from knittest.laboratory.report_base import CurveAxes, FabricReport, References, SizeFreeReport, draw_energies

#: conjugate force by path
LABELS = {
    "shear": "shear force, conjugate to the angle [N/mm]",
    "warp": "mean stress along the warp [N/mm]",
    "weft": "mean stress along the weft [N/mm]",
    "biaxial": "work per area and strain [N/mm]",
    "bending": "moment per length [N]",
    "compaction": "pressure [MPa]",
    "steps": "work per area and share of the path [N/mm]",
}


class CellReport(SizeFreeReport[CellRun], FabricReport[CellRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("path_pct", "conjugate_force", "share of the path [%]", "force conjugate to the path")

    def pictures(self, run: CellRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """Draw curve.png, energies.png and deformed.png."""
        lines, ylabel = self.simulated(specimens, self.axes.y), LABELS[run.rig.path]
        self.draw_lines(run, lines, references, folder / "curve.png", ylabel=ylabel)
        draw_energies(run, specimens, folder, partial(checked_span, run))
        self.draw_specimen(run, specimens[0], folder)
