"""Report of the pull-out test: pull force over the way of the inlay's end, and a laboratory's pull-outs beside it."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.history import Body, Specimen
from knittest.experiment.conditions import EXACT, Conditions
from knittest.experiment.curves import ReferenceCurve, add_note
from knittest.experiment.lab_conditions import SERIES
from knittest.experiment.tables import PublishedValue, rejected_row_lines, with_factors, with_note
from knittest.export.line_picture import Line
from knittest.laboratory.base import nontrivial_factors
from knittest.laboratory.pull_out.config import PullOutRun
from knittest.laboratory.pull_out.lab_files import AT_REST, EACH, EACH_AT_REST, EDGES, MEAN, PEAK, TAIL, WORDS
from knittest.laboratory.pull_out.sliding import SLIDES
from knittest.laboratory.pull_out.test import CLAMPS, UNBALANCED, clamps
from knittest.laboratory.report_base import CurveAxes, FabricReport, QualityCheck, References, SizeFreeReport
from knittest.laboratory.strips import AXIS, pitch

#: forces that grow with the embedded length
FORCE_QUANTITIES = (AT_REST, PEAK, MEAN)
#: travel [pitch] beyond whole pitches in which the inlay stretches and begins to slide
MORE = 0.3


def embedded_length(run: PullOutRun) -> float:
    """Embedded length [mm] of ``run``, in whole pitches."""
    period = pitch(run, run.rig.direction)
    return round(run.rig.length_mm / period) * period


def pull_mismatch(run: PullOutRun, row: PublishedValue) -> str:
    """Reason why ``row`` is of another pull-out than ``run``; empty if it is not."""
    if reason := piece_mismatch(run, row.conditions):
        return reason
    if row.quantity not in FORCE_QUANTITIES:
        return ""
    if reason := length_mismatch(run, row.conditions):
        return reason
    # whole pitches that the inlay of the run slides without stretch
    count, own = row.conditions.slid_pitches, int((run.rig.travel_mm - SLIDES) / pitch(run, run.rig.direction))
    if row.quantity != MEAN or count == own:
        return ""
    if count is None:
        return "mean over an unknown number of pitches; knittest data import writes it"
    way = (count + MORE) * pitch(run, run.rig.direction)
    return f"mean over {count:g} pitches, in the run over {own}: compare with --set rig.travel={way:.3g}"


def piece_mismatch(run: PullOutRun, tested: Conditions) -> str:
    """Reason why a tested piece was clamped otherwise, or is of another fabric, than that of ``run``; else empty."""
    edges, density = tested.clamped_edges, tested.crossing_density_per_100_mm
    if edges is None or density is None or tested.embedded_length_mm is None:
        return "unknown embedded length, crossing yarns or clamped edges; knittest data import writes them"
    if edges != EDGES[run.rig.clamped_edges]:
        other = next((name for name, number in EDGES.items() if number == edges), "sides")
        return (
            f"{WORDS[other]}, in the run {WORDS[run.rig.clamped_edges]}: compare with --set rig.clamped_edges={other}"
        )
    own = 100.0 / pitch(run, run.rig.direction)
    if abs(density - own) > SERIES * own:
        return f"{density:g} crossing yarns per 100 mm, in the run {own:.3g}: another fabric"
    return ""


def length_mismatch(run: PullOutRun, tested: Conditions) -> str:
    """Reason why the embedded length of ``tested`` is not that of ``run``, of whole pitches; empty if it is."""
    period, own, length = pitch(run, run.rig.direction), embedded_length(run), tested.embedded_length_mm or 0.0
    if abs(length - own) <= 0.5 * period:
        return ""
    return f"{length:g} mm embedded, in the run {own:.3g} mm: compare with --set rig.length={length:g}"


def length_factor(run: PullOutRun, tested: float, slid: float) -> float:
    """Length [mm] still embedded in a test over that in ``run``, once the inlay has ``slid`` [mm]."""
    return (tested - slid) / (embedded_length(run) - slid)


def scale_curve_to_length(run: PullOutRun, curve: ReferenceCurve) -> ReferenceCurve:
    """``curve`` for the embedded length of ``run``, by the crossings that still hold, up to the last pitch."""
    tested = curve.conditions.embedded_length_mm or 0.0
    if math.isclose(tested, embedded_length(run), rel_tol=EXACT):
        return curve
    slid = np.clip(curve.x, 0.0, min(tested, embedded_length(run)) - pitch(run, run.rig.direction))
    factor = np.array([length_factor(run, tested, float(s)) for s in slid])
    scaled = replace(curve, mean=curve.mean / factor, sd=None if curve.sd is None else curve.sd / factor)
    return add_note(scaled, f"for {embedded_length(run):.4g} mm embedded, in whole pitches, instead of {tested:g} mm")


def scale_row_to_length(run: PullOutRun, row: PublishedValue) -> PublishedValue:
    """``row`` with the factor from the tested length to that of ``run``, or with a note on its number of crossings."""
    if row.quantity in FORCE_QUANTITIES:
        tested = row.conditions.embedded_length_mm or 0.0
        slid = (row.conditions.slid_pitches or 0.0) * pitch(run, run.rig.direction) if row.quantity == MEAN else 0.0
        factors = nontrivial_factors([length_factor(run, tested, 0.5 * slid)] * run.variability.specimens)
        return with_factors(
            row, factors, f"{embedded_length(run):.4g} mm embedded in whole pitches, {tested:g} mm in the test"
        )
    if row.quantity not in (EACH, EACH_AT_REST) or not length_mismatch(run, row.conditions):
        return row
    period = pitch(run, run.rig.direction)
    counts = ((row.conditions.embedded_length_mm or 0.0) / period, embedded_length(run) / period)
    return with_note(row, "of {:.0f} instead of {:.0f} crossings".format(*counts))


class PullOutReport(SizeFreeReport[PullOutRun], FabricReport[PullOutRun]):
    """See :class:`knittest.laboratory.report_base.Report`."""

    axes = CurveAxes(
        "displacement_mm", "pull_force_n", "way of the inlay's clamp [mm]", "pull force [N]", others=(TAIL,),
        reach="rig.travel",
    )  # fmt: skip
    placement_facts = CLAMPS

    def scaled(self, run: PullOutRun, rows: Sequence[PublishedValue]) -> list[PublishedValue]:
        """Values of pieces that were clamped as that of the run; forces of its embedded length only."""
        return [scale_row_to_length(run, row) for row in rows if not pull_mismatch(run, row)]

    def apart(self, run: PullOutRun, rows: Sequence[PublishedValue]) -> list[str]:
        """Rows of a piece that was clamped or cut otherwise."""
        return rejected_row_lines((row, pull_mismatch(run, row)) for row in rows)

    def conditions(self, run: PullOutRun) -> Conditions:
        """Also of the piece."""
        density, edges = 100.0 / pitch(run, run.rig.direction), EDGES[run.rig.clamped_edges]
        return replace(
            super().conditions(run), embedded_length_mm=embedded_length(run), crossing_density_per_100_mm=density,
            clamped_edges=edges,
        )  # fmt: skip

    def scale_curve(self, run: PullOutRun, curve: ReferenceCurve) -> ReferenceCurve:
        """Curve for the embedded length of the run; raises :class:`InputError` for another piece."""
        reason = piece_mismatch(run, curve.conditions) or length_mismatch(run, curve.conditions)
        if reason:
            raise InputError(f"{curve.file or curve.source}: {reason}")
        return scale_curve_to_length(run, super().scale_curve(run, curve))

    def quality_checks(self, run: PullOutRun) -> list[QualityCheck]:
        """Standard checks, and the balance of the clamps."""
        return [
            *super().quality_checks(run),
            QualityCheck("difference of the clamps", "results", "clamp_difference_pct", UNBALANCED),
        ]

    def placed(self, run: PullOutRun, specimen: Specimen) -> list[Body]:
        """The clamps of the piece, and that of the inlay."""
        return clamps(specimen.history, specimen.facts, AXIS[run.rig.direction], run.rig.clamped_edges == "sides")

    def draw_curve(self, run: PullOutRun, specimens: list[Specimen], references: References, path: Path) -> None:
        """Draw the force, and the friction of equal crossings over the embedded length."""
        lines = []
        for k, one in enumerate(specimens):
            curve = one.history.curve
            lines.append(Line(curve["displacement_mm"], curve["pull_force_n"], f"simulated, specimen {k + 1}"))
            friction = one.results["crossing_friction_n"]
            if k == 0 and np.isfinite(friction):
                held = friction * curve["embedded_mm"] / one.facts["pitch_mm"]
                lines.append(Line(curve["displacement_mm"], held, f"{friction:.3g} N per embedded crossing", ":"))
        self.draw_lines(run, lines, references, path, bands=())

    def note(self, specimen: Specimen) -> str:
        """Travel at the end."""
        return f"inlay pulled by {specimen.history.curve['displacement_mm'][-1]:.1f} mm"
