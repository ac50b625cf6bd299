"""Rows of Table 3: the experiment, the simulation, and whether it passes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from knittest.base.errors import InputError
from knittest.base.kinds import kinds
from knittest.base.resources import data_dir
from knittest.config.run import Run, Scale
from knittest.experiment.compare import compare_results
from knittest.experiment.row_kind import RowKind, row_kind
from knittest.experiment.tables import PublishedValue, published
from knittest.laboratory.registry import REPORTS
from knittest.studies.regress.cases import Case
from knittest.studies.trials.record import Record

#: an input must come back within this share of the mean: the presets promise it of tension curves
INPUT_TOLERANCE = 0.01
#: a row without a published sd must be met within this share of the mean. It is B, which grows with the overhang's
#: third power; loops add to the bending of a strip of yarns
SHARE_WITHOUT_SD: dict[Scale, float] = {"macro": 0.03, "meso": 0.10}


@dataclass(frozen=True)
class Row:
    """One published number: ``simulated`` and ``deviation_sd`` are NaN where there is none; ``rule`` says when it
    passes, ``reason`` why it does not.
    """

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
        """Tell whether the row passes: no reason speaks against it."""
        return not self.reason


def table3_rows(case: Case, run: Run, record: Record, limit_sd: float) -> Iterator[Row]:
    """A row for each number that the paper publishes of ``case``; without a result it fails, saying why.

    ``limit_sd`` is what predicted and tuned rows may deviate, in standard deviations of the experiment.
    """
    fabric = run.fabric
    if fabric.experiment is None or fabric.experiment_variant is None:
        raise InputError(f"variant {case.variant}: the fabric names no experiment to be judged by")
    names = kinds()[case.test].published
    raw = published(data_dir() / fabric.experiment, fabric.experiment_variant, run.direction, names)
    values = [value for value in REPORTS[case.test].scaled(run, raw) if value.quantity in case.rows]
    row_kinds = {value.quantity: row_kind(run, value.quantity) for value in values}
    found = {row["quantity"]: row for row in compare_results(record.values, values, row_kinds)}
    for value in values:
        compared, kind = found.get(value.quantity), row_kinds[value.quantity]
        simulated = compared["simulated"] if compared else math.nan
        deviation = compared["deviation_sd"] if compared else math.nan
        rule, reason = _judge(case.scale, kind, simulated, value, limit_sd)
        if compared is None:
            reason = no_result(record)
        yield Row(case, value.quantity, value.mean, value.sd, simulated, deviation, kind, value.table, rule, reason)


def _judge(scale: Scale, kind: RowKind, simulated: float, value: PublishedValue, limit_sd: float) -> tuple[str, str]:
    """The rule that a row of ``kind`` passes by, and why it does not, empty if it does."""
    if kind == "input" or not value.sd > 0.0:
        share = INPUT_TOLERANCE if kind == "input" else SHARE_WITHOUT_SD[scale]
        off = abs(simulated / value.mean - 1.0)
        rule = f"within {100.0 * share:g} %"
        return rule, "" if off <= share else f"{100.0 * off:.2f} % off the {'input' if kind == 'input' else 'mean'}"
    off = abs(simulated - value.mean) / value.sd
    return f"within {limit_sd:g} sd", "" if off <= limit_sd else f"{off:.2f} sd off the mean"


def no_result(record: Record) -> str:
    """Reason why a run gave no number."""
    if record.status == "completed":
        return "the run has no such result"
    return f"the run {record.status}: {record.reason}" if record.reason else f"the run {record.status}"
