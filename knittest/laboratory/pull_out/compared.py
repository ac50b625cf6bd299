"""Rows of a laboratory's pull-outs beside those of a run."""

from knittest.experiment.conditions import Conditions
from knittest.experiment.lab_conditions import SERIES
from knittest.experiment.tables import PublishedValue, with_note
from knittest.laboratory.pull_out.config import PullOutRun
from knittest.laboratory.pull_out.lab_files import AT_REST, EACH, EACH_AT_REST, EDGES, MEAN, PEAK, WORDS
from knittest.laboratory.pull_out.sliding import SLIDES
from knittest.laboratory.strips import pitch

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


def for_length(run: PullOutRun, row: PublishedValue) -> PublishedValue:
    """``row``; friction of a crossing says of how many it is, where the run has others."""
    if row.quantity not in (EACH, EACH_AT_REST) or not other_length(run, row.conditions):
        return row
    period = pitch(run, run.rig.direction)
    counts = ((row.conditions.embedded_length_mm or 0.0) / period, embedded(run) / period)
    return with_note(row, "of {:.0f} instead of {:.0f} crossings".format(*counts))
