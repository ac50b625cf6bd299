"""A regression as text: Table 3 row by row, Table 4 beside ours, drift, and the verdict."""

import math
import sys
from collections.abc import Iterator
from dataclasses import astuple

from knittest.base.errors import ResourceError
from knittest.base.layout import table, width_of
from knittest.base.result_rows import LABELS
from knittest.experiment.row_kind import RowKind
from knittest.export.provenance import cpu_model
from knittest.studies.regress.cost import CostRow, total
from knittest.studies.regress.drift import LIMITS, Drift, own_limits
from knittest.studies.regress.judge import Row
from knittest.studies.regress.outcome import LOST, Outcome, largest_of
from knittest.studies.regress.rounding import TIMES
from knittest.studies.regress.widening import limits_of

HEAD3 = ("specimen", "scale", "preset", "quantity", "simulated", "experiment", "deviation", "kind", "passes", "verdict")
HEAD4 = ("test", "scale", "elements, paper", "ours", "CPU h, paper", "ours", "steps", "mass added [%]", "")
RIGHT3, RIGHT4 = (4, 5, 6), (2, 3, 4, 5, 6, 7)


def lines_of(outcome: Outcome) -> Iterator[str]:
    """The whole text."""
    if outcome.rows:
        yield "Table 3 of Pham et al. (2019), and F_R/F_N of Eq. 3: mean and sd of the experiment"
        yield from _lines([HEAD3, *map(_row3, outcome.rows)], RIGHT3)
        yield (
            "predicted: no parameter was fitted to it or chosen with it in view; tuned: one was; input: given to the "
            "model, which returns it; assumed: decided by what is assumed"
        )
        yield ""
    if outcome.costs:
        yield "Table 4, variant 1: different machines and, unless the preset is paper, another size of the model"
        yield from _lines([HEAD4, *map(_row4, outcome.costs)], RIGHT4)
        paper, ours = total(outcome.costs)
        yield f"together, of what ran: {paper:.4g} CPU h in the paper, {ours:.2g} here"
        yield ""
    yield from _drift_lines(outcome)
    yield from _verdict(outcome)


def _row3(row: Row) -> tuple[str, ...]:
    label, form = LABELS.get(row.quantity, (row.quantity, "{:.4g}"))
    experiment = _number(row.mean, form) + (f" ± {_number(row.sd, form)}" if math.isfinite(row.sd) else "")
    share = 100.0 * (row.simulated / row.mean - 1.0)
    deviation = f"{row.deviation_sd:+.2f} sd" if math.isfinite(row.deviation_sd) else f"{share:+.1f} %"
    deviation = deviation if math.isfinite(share) else "-"
    verdict = "pass" if row.passed else f"FAIL: {row.reason}"
    case = row.case
    return (
        case.specimen, case.scale, case.preset, label, _number(row.simulated, form), experiment, deviation, row.kind,
        row.rule, verdict,
    )  # fmt: skip


def _row4(row: CostRow) -> tuple[str, ...]:
    numbers = (row.paper_elements, row.elements, row.paper_cpu_h, row.cpu_h, row.steps, row.added_mass)
    forms = ("{:.0f}", "{:.0f}", "{:.4g}", "{:.2g}", "{:.0f}", "{:.2g}")
    return (row.test, row.scale, *map(_number, numbers, forms), row.note)


def _drift_lines(outcome: Outcome) -> Iterator[str]:
    if outcome.updated:
        yield f"baseline {outcome.baseline}: {len(outcome.updated)} runs written"
        yield from (f"  {text}" for text in outcome.updated)
    yield from (f"  {name}: dropped, no level runs it any more" for name in outcome.dropped)
    for scale, limits in LIMITS.items():
        mine = [drift for drift in outcome.drifts if drift.case.scale == scale]
        if mine:
            good = sum(drift.passed for drift in mine)
            yield f"drift from the baseline, {scale}: {good} of {len(mine)} runs pass{_largest(mine)}"
            number, curve = 100.0 * limits.number, 100.0 * limits.curve
            yield f"  limits: {number:g} % of a number, {curve:g} % of a curve's largest value"
            yield from _wider(mine)
            yield from (f"  FAIL {drift.case.name}: {reason}" for drift in mine for reason in drift.reasons)
    if any(drift.entry is not None and drift.entry.cpu != cpu_model() for drift in outcome.drifts):
        yield "  some of the baseline was written on another processor model, which rounds differently"
    yield from (f"FAIL {name}: {LOST}" for name in outcome.lost)


def _wider(drifts: list[Drift]) -> Iterator[str]:
    """Lines on wider limits, those of what enlarges rounding."""
    for drift in drifts:
        if drift.entry is None:
            continue
        if limits := own_limits(drift.case, drift.entry):
            number, curve, buckled = (100.0 * v for v in astuple(limits))
            yield f"  {drift.case.name}, which enlarges rounding: {number:g} %, {curve:g} %, of buckles {buckled:g} %"
        elif drift.entry.runs > 1 and drift.changes:
            along = limits_of(drift.case, drift.entry)
            widest = max({*along} - {*drift.entry.ranges}, key=lambda name: along[name])
            yield (
                f"  {drift.case.name}: these and {TIMES:g} times the scatter of {drift.entry.runs} runs rounded "
                f"differently, together {100.0 * along[widest]:.2g} % at most ({widest}); a crest more or fewer"
            )


def _largest(drifts: list[Drift]) -> str:
    change = largest_of(drifts)
    return f"; largest change {100.0 * abs(change.change):.2g} %, {change.what}" if change else ""


def _verdict(outcome: Outcome) -> Iterator[str]:
    row_kinds: tuple[RowKind, ...] = ("predicted", "tuned", "input", "assumed")
    tallies = {kind: outcome.tally(kind) for kind in row_kinds}
    counts = [f"{good} of {total} {kind}" for kind, (good, total) in tallies.items() if total]
    said = f": rows that pass: {', '.join(counts)}" if counts else ""
    words = {0: "PASS", ResourceError.exit_code: "NOT JUDGED, the machine had no room"}
    yield words.get(outcome.exit_code, "FAIL") + said


def _number(value: float, form: str) -> str:
    return form.format(value) if math.isfinite(value) else "-"


def _lines(rows: list[tuple[str, ...]], right: tuple[int, ...]) -> list[str]:
    return [line for row in table(rows, width_of(sys.stdout), right) for line in row]
