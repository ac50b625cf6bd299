"""Report of the pull-out test: pull force over the way of the inlay's end, and a laboratory's pull-outs beside it."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, Specimen
from knittest.experiment.conditions import EXACT, Conditions
from knittest.experiment.curves import ReferenceCurve, noted
from knittest.experiment.lab_conditions import SERIES
from knittest.experiment.tables import PublishedValue, left_out, with_factors, with_note
from knittest.export.line_picture import Line, line_picture
from knittest.export.yarn_pictures import faces_picture
from knittest.laboratory.pull_out.config import PullOutRun
from knittest.laboratory.pull_out.lab_files import AT_REST, EACH, EACH_AT_REST, EDGES, MEAN, PEAK, TAIL, WORDS
from knittest.laboratory.pull_out.sliding import SLIDES
from knittest.laboratory.pull_out.test import CLAMPS, UNBALANCED, PullOut, clamps
from knittest.laboratory.report_base import (
    CurveAxes,
    Gate,
    NoSize,
    References,
    Report,
    draw_energies,
    energy_gates,
    title_of,
    unless_one,
)
from knittest.laboratory.strips import AXIS, pitch

#: forces that grow with the embedded length
WHOLE = (AT_REST, PEAK, MEAN)
#: way [pitch] beyond whole pitches in which the inlay is stretched and lets go
MORE = 0.3


def embedded(run: PullOutRun) -> float:
    """Embedded length [mm] of ``run``, in whole pitches."""
    period = pitch(run, run.rig.direction)
    return round(run.rig.length_mm / period) * period


def slid_pitches(run: PullOutRun) -> int:
    """Whole pitches that the inlay of ``run`` slides, if it does not stretch."""
    return int((run.rig.travel_mm - SLIDES) / pitch(run, run.rig.direction))


def other_pull(run: PullOutRun, row: PublishedValue) -> str:
    """Reason why ``row`` is of another pull-out than ``run``; empty if it is not."""
    return other_piece(run, row.conditions) or (_other_length(run, row) if row.quantity in WHOLE else "")


def other_piece(run: PullOutRun, tested: Conditions) -> str:
    """Reason why a piece was held in another way, or is of another fabric, than that of ``run``; empty if not."""
    edges, density = tested.clamped_edges, tested.crossing_density_per_100_mm
    if edges is None or density is None or tested.embedded_length_mm is None:
        return "of unknown embedded length, crossing yarns or clamped edges; knittest data import writes them"
    if edges != EDGES[run.rig.clamped]:
        other = next((name for name, number in EDGES.items() if number == edges), "sides")
        return f"{WORDS[other]}, in the run {WORDS[run.rig.clamped]}: --set rig.clamped={other} makes them comparable"
    own = 100.0 / pitch(run, run.rig.direction)
    if abs(density - own) > SERIES * own:
        return f"{density:g} crossing yarns per 100 mm, in the run {own:.3g}: another fabric"
    return ""


def other_length(run: PullOutRun, tested: Conditions) -> str:
    """Reason why the embedded length of ``tested`` is not that of ``run``, of whole pitches; empty if it is."""
    period, own, length = pitch(run, run.rig.direction), embedded(run), tested.embedded_length_mm or 0.0
    if abs(length - own) <= 0.5 * period:
        return ""
    return f"{length:g} mm embedded, in the run {own:.3g} mm: --set rig.length={length:g} makes them comparable"


def _other_length(run: PullOutRun, row: PublishedValue) -> str:
    if reason := other_length(run, row.conditions):
        return reason
    count, own = row.conditions.slid_pitches, slid_pitches(run)
    if row.quantity != MEAN or count == own:
        return ""
    if count is None:
        return "mean over an unknown number of pitches; knittest data import writes it"
    way = (count + MORE) * pitch(run, run.rig.direction)
    return f"mean over {count:g} pitches, in the run over {own}: --set rig.travel={way:.3g} makes them comparable"


def length_factor(run: PullOutRun, tested: float, slid: float) -> float:
    """Length [mm] still embedded in a test over that in ``run``, once the inlay has ``slid`` [mm]: crossings that still
    hold, equal ones, are as many as pitches in it.
    """
    return (tested - slid) / (embedded(run) - slid)


def for_whole_pitches(run: PullOutRun, curve: ReferenceCurve) -> ReferenceCurve:
    """``curve`` for the embedded length of ``run``, by the crossings that still hold, up to the last pitch."""
    tested = curve.conditions.embedded_length_mm or 0.0
    if math.isclose(tested, embedded(run), rel_tol=EXACT):
        return curve
    slid = np.clip(curve.x, 0.0, min(tested, embedded(run)) - pitch(run, run.rig.direction))
    factor = np.array([length_factor(run, tested, float(s)) for s in slid])
    scaled = replace(curve, mean=curve.mean / factor, sd=None if curve.sd is None else curve.sd / factor)
    return noted(scaled, f"for {embedded(run):.4g} mm embedded, in whole pitches, instead of {tested:g} mm")


def for_length(run: PullOutRun, row: PublishedValue) -> PublishedValue:
    """``row``; friction of a crossing says of how many it is, where the run has others. Forces of the whole length are
    compared with those of the run for the tested length, by :func:`length_factor`.
    """
    if row.quantity in WHOLE:
        tested = row.conditions.embedded_length_mm or 0.0
        slid = (row.conditions.slid_pitches or 0.0) * pitch(run, run.rig.direction) if row.quantity == MEAN else 0.0
        factors = unless_one([length_factor(run, tested, 0.5 * slid)] * run.variability.specimens)
        return with_factors(
            row, factors, f"{embedded(run):.4g} mm embedded in whole pitches, {tested:g} mm in the test"
        )
    if row.quantity not in (EACH, EACH_AT_REST) or not other_length(run, row.conditions):
        return row
    period = pitch(run, run.rig.direction)
    counts = ((row.conditions.embedded_length_mm or 0.0) / period, embedded(run) / period)
    return with_note(row, "of {:.0f} instead of {:.0f} crossings".format(*counts))


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
