"""Report of the pull-out test: pull force over the way of the inlay's end."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, Specimen
from knittest.experiment.curves import ReferenceCurve
from knittest.experiment.tables import PublishedValue, left_out
from knittest.export.faces_picture import faces_picture
from knittest.export.line_picture import Line, line_picture
from knittest.laboratory.pull_out.clamps import CLAMPS, clamps
from knittest.laboratory.pull_out.compared import for_length, for_whole_pitches, other_length, other_piece, other_pull
from knittest.laboratory.pull_out.config import PullOutRun
from knittest.laboratory.pull_out.lab_files import TAIL
from knittest.laboratory.pull_out.test import UNBALANCED, PullOut
from knittest.laboratory.report_base import (
    CurveAxes,
    Gate,
    NoSize,
    References,
    Report,
    draw_energies,
    energy_gates,
    title_of,
)
from knittest.laboratory.strips import AXIS


class PullOutReport(NoSize[PullOutRun], Report[PullOutRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "displacement_mm", "pull_force_n", "way of the inlay's clamp [mm]", "pull force [N]", others=(TAIL,),
        reach="rig.travel",
    )  # fmt: skip
    placed_by = CLAMPS

    def scaled(self, run: PullOutRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Values as they are, of a piece that was held as that of the run; forces of its embedded length alone."""
        return [for_length(run, row) for row in rows if not other_pull(run, row)]

    def apart(self, run: PullOutRun, rows: Sequence[PublishedValue]) -> list[str]:
        """Rows of a piece that was held or cut otherwise."""
        return left_out((row, other_pull(run, row)) for row in rows)

    def matched(self, run: PullOutRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Curve over the way of the free end, for the embedded length of the run in whole pitches; raises
        :class:`InputError` for another piece.
        """
        reason = other_piece(run, curve.conditions) or other_length(run, curve.conditions)
        if reason:
            raise InputError(f"{curve.file or curve.source}: {reason}")
        return for_whole_pitches(run, super().matched(run, curve))

    def gates(self, run: PullOutRun) -> list[Gate]:
        """Standard gates, and the balance of the clamps."""
        return [*energy_gates(run), Gate("difference of the clamps", "results", "clamp_difference_pct", UNBALANCED)]

    def reference_curve(self, run: PullOutRun) -> ReferenceCurve | None:
        """No pull-out is published for the paper's fabrics."""
        return None

    def placed(self, run: PullOutRun, specimen: Specimen) -> list[Body]:
        """The clamps of the piece, and that of the inlay."""
        return clamps(specimen.history, specimen.facts, AXIS[run.rig.direction], run.rig.clamped == "sides")

    def pictures(self, run: PullOutRun, specimens: list[Specimen], references: References, folder: Path) -> None:
        """curve.png with the friction of equal crossings over the embedded length, energies.png, deformed.png."""
        lines = []
        for k, one in enumerate(specimens):
            curve = one.history.curve
            lines.append(Line(curve["displacement_mm"], curve["pull_force_n"], f"simulated, specimen {k + 1}"))
            friction = one.results["crossing_friction_n"]
            if k == 0 and np.isfinite(friction):
                held = friction * curve["embedded_mm"] / one.facts["pitch_mm"]
                lines.append(Line(curve["displacement_mm"], held, f"{friction:.3g} N a crossing that still holds", ":"))
        lines += [Line(c.x, c.mean, f"{c.source} ({c.kind})", "--") for c in references.curves]
        line_picture(folder / "curve.png", lines, title=title_of(run), xlabel=self.axes.xlabel, ylabel=self.axes.ylabel)
        draw_energies(run, specimens, folder, PullOut().span)
        history = specimens[0].history
        faces_picture(
            folder / "deformed.png", history.mesh, history.frames[-1], title=title_of(run),
            note=f"inlay pulled by {history.curve['displacement_mm'][-1]:.1f} mm",
        )  # fmt: skip
