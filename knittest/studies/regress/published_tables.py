"""Rows of Table 3, which pass or fail, and of Table 4: elements and CPU hours of the paper and of these runs."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.base.kinds import kinds, test_names
from knittest.config.run import Run, Scale
from knittest.experiment.comparison import compare_results
from knittest.experiment.origin import RowKind, row_kind
from knittest.experiment.tables import PublishedValue, published_rows
from knittest.laboratory.report_base import REPORTS
from knittest.studies.regress.cases import Case, paper_cost
from knittest.studies.trials.trial import Record

#: largest deviation of an input, as a share of the mean
INPUT_TOLERANCE = 0.01
#: largest deviation of a row without a published sd, as a share of the mean. It is B, which increases with the third
#: power of the overhang; loops add to the bending of a meso strip
SHARE_WITHOUT_SD: dict[Scale, float] = {"macro": 0.03, "meso": 0.10}


@dataclass(frozen=True)
class PublishedRow:
    """Published number and its ``simulated`` value, NaN without one; ``rule`` to pass, ``reason`` of a failure."""

    case: Case
    quantity: str
    mean: float
    sd: float
    simulated: float
    deviation_sd: float
    kind: RowKind
    source: str
    rule: str
    reason: str = ""

    @property
    def passed(self) -> bool:
        """Tell whether the row passes."""
        return not self.reason


def table3_rows(case: Case, run: Run, record: Record, limit_sd: float) -> Iterator[PublishedRow]:
    """Rows of Table 3 of ``case``; ``limit_sd`` [sd] is for predicted and tuned ones; rows without a result fail."""
    fabric = run.fabric
    if fabric.experiment is None or fabric.experiment_variant is None:
        raise InputError(f"variant {case.variant}: the fabric names no experiment to compare with")
    names = kinds()[case.test].published
    raw = published_rows(data_dir() / fabric.experiment, fabric.experiment_variant, run.direction, names)
    values = [value for value in REPORTS[case.test].scaled(run, raw) if value.quantity in case.rows]
    row_kinds = {value.quantity: row_kind(run, value.quantity) for value in values}
    found = {row["quantity"]: row for row in compare_results(record.values, values, row_kinds)}
    for value in values:
        compared, kind = found.get(value.quantity), row_kinds[value.quantity]
        simulated = compared["simulated"] if compared else math.nan
        deviation = compared["deviation_sd"] if compared else math.nan
        rule, reason = _apply_rule(case.scale, kind, simulated, value, limit_sd)
        if compared is None:
            reason = no_result_reason(record)
        yield PublishedRow(
            case, value.quantity, value.mean, value.sd, simulated, deviation, kind, value.table, rule, reason
        )


def _apply_rule(
    scale: Scale, kind: RowKind, simulated: float, value: PublishedValue, limit_sd: float
) -> tuple[str, str]:
    """Rule of a row of ``kind``, and the reason why it fails, empty if it passes."""
    if kind == "input" or not value.sd > 0.0:
        share = INPUT_TOLERANCE if kind == "input" else SHARE_WITHOUT_SD[scale]
        off = abs(simulated / value.mean - 1.0)
        rule = f"within {100.0 * share:g} %"
        return rule, "" if off <= share else f"{100.0 * off:.2f} % off the {'input' if kind == 'input' else 'mean'}"
    off = abs(simulated - value.mean) / value.sd
    return f"within {limit_sd:g} sd", "" if off <= limit_sd else f"{off:.2f} sd off the mean"


def no_result_reason(record: Record) -> str:
    """Reason why a run lacks a number."""
    if record.status == "completed":
        return "the run has no such result"
    return f"run {record.status}{': ' if record.reason else ''}{record.reason}"


@dataclass(frozen=True)
class CostRow:
    """Test at a scale; ``note`` says why numbers are missing (NaN), or preset and checks; ``added_mass`` in %."""

    test: str
    scale: str
    paper_elements: float
    paper_cpu_h: float
    elements: float
    cpu_h: float
    steps: float
    added_mass: float
    note: str


def table4_rows(done: Mapping[Case, Record]) -> Iterator[CostRow]:
    """All rows of Table 4 at the scales among ``done``, each with its run of variant 1."""
    scales = [scale for scale in ("macro", "meso") if any(case.scale == scale for case in done)]
    for test in test_names():
        for scale in scales:
            if (paper := paper_cost(test, scale)) is None:
                continue
            case = next((c for c in done if (c.test, c.scale) == (test, scale) and 4 in c.tables), None)
            elements, cpu_h = paper
            yield CostRow(test, scale, elements, cpu_h, *_cost_numbers(case, done))


def total_hours(rows: Iterable[CostRow]) -> tuple[float, float]:
    """CPU hours of the paper and of these runs, of the ``rows`` that have both."""
    both = [(row.paper_cpu_h, row.cpu_h) for row in rows if math.isfinite(row.cpu_h) and math.isfinite(row.paper_cpu_h)]
    return sum(paper for paper, _ in both), sum(ours for _, ours in both)


def _cost_numbers(case: Case | None, done: Mapping[Case, Record]) -> tuple[float, float, float, float, str]:
    if case is None:
        return *(math.nan,) * 4, "not run at this level"
    record = done[case]
    if record.summary is None:
        return *(math.nan,) * 4, f"no result: {record.status}"
    cost, added = record.summary["cost"], record.summary["quality"].get("added_mass_pct")
    passed = "quality checks passed" if record.status == "completed" else record.status
    note = ", ".join(part for part in (f"preset {case.preset}", case.label, passed) if part)
    return cost["elements"], cost["cpu_s"] / 3600.0, cost["steps"], math.nan if added is None else added, note
