"""Report of the cell test: conjugate force over the path, energies, and the cell at its end."""

from functools import partial
from pathlib import Path

from knittest.base.history import Specimen
from knittest.experiment.curves import ReferenceCurve
from knittest.export.line_picture import Line, line_picture
from knittest.export.yarn_pictures import faces_picture
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.cell.test import judged_span
from knittest.laboratory.report_base import CurveAxes, NoSize, References, Report, draw_energies, title_of

#: conjugate force by path
LABELS = {
    "shear": "shear force, conjugate to the angle [N/mm]",
    "warp": "mean stress along the warp [N/mm]",
    "weft": "mean stress along the weft [N/mm]",
    "biaxial": "work an area and strain [N/mm]",
    "bending": "moment a length [N]",
    "compaction": "pressure [MPa]",
    "steps": "work an area and share of the path [N/mm]",
}


class CellReport(NoSize[CellRun], Report[CellRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes("path_pct", "conjugate_force", "share of the path [%]", "force conjugate to the path")

    def reference_curve(self, run: CellRun) -> ReferenceCurve | None:
        """None: nobody measures a cell."""
        return None

    def pictures(self, run: CellRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png, energies.png, deformed.png."""
        lines = [
            Line(s.history.curve["path_pct"], s.history.curve["conjugate_force"], f"simulated, specimen {k}")
            for k, s in enumerate(specimens, 1)
        ]
        lines += [Line(c.x, c.mean, f"{c.source} ({c.kind})", "--") for c in references.curves]
        line_picture(
            folder / "curve.png", lines, title=title_of(run), xlabel=self.axes.xlabel, ylabel=LABELS[run.rig.path],
            levels=self.levels(run),
        )  # fmt: skip
        draw_energies(run, specimens, folder, partial(judged_span, run))
        history = specimens[0].history
        faces_picture(folder / "deformed.png", history.mesh, history.frames[-1], title=title_of(run), note="at the end")
