"""Outcome of a calibration, as calibration.json holds it."""

import math
from collections import Counter
from dataclasses import dataclass
from typing import NotRequired, TypedDict

import numpy as np

import knittest
from knittest.base.result_rows import LABELS
from knittest.config.base import Quantity
from knittest.export.manifest import now
from knittest.studies.calibrate.evaluate import Evaluation
from knittest.studies.calibrate.judge import Judgement
from knittest.studies.calibrate.parameters import current
from knittest.studies.calibrate.problem import Problem
from knittest.studies.calibrate.targets import Number, Target
from knittest.studies.trials.record import looser_note
from knittest.studies.trials.trial import code_digest


class TargetRow(TypedDict):
    """A target beside the best point, None without one; ``mean``, ``sd`` and ``simulated`` are of a single number."""

    target: str
    test: str
    weight: float
    source: str
    quantity: NotRequired[str]
    mean: NotRequired[float]
    sd: NotRequired[float]
    simulated: NotRequired[float | None]
    deviation_sd: float | None


class ParameterRow(TypedDict):
    """A parameter: its bounds, start, prior, value before and value found, None without one."""

    fields: list[str]
    unit: str
    low: float
    high: float
    start: float
    prior_mean: float | None
    prior_sd: float | None
    value: float | None
    before: float | None
    before_source: str
    sd: NotRequired[float | None]
    interval_95: NotRequired[list[float]]
    sensitivity_sd: NotRequired[float]


@dataclass(frozen=True)
class Outcome:
    """``history`` in the order of the search, its ``best`` and what is known of it; ``failure`` says why it did not end
    well, and is empty where it did.
    """

    problem: Problem
    history: list[Evaluation]
    best: Evaluation | None
    judgement: Judgement | None
    failure: str = ""

    @property
    def converged(self) -> bool:
        """Tell whether the search came to its end and its result may be used."""
        return not self.failure

    @property
    def runs(self) -> int:
        """Number of runs, those that came to nothing included."""
        return len({record.key for one in self.history for record in one.records.values()})

    @property
    def rms(self) -> float:
        """Root mean square over the targets of the best point's deviation [sd]; nan without one."""
        found = [row["deviation_sd"] for row in target_rows(self)] if self.best else []
        squares = [math.nan if deviation is None else deviation**2 for deviation in found]
        return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def target_rows(outcome: Outcome) -> list[TargetRow]:
    """Each target beside the best point; the deviation of a curve is its root mean square."""
    best = outcome.best
    return [
        _target_row(target, best.simulated[k] if best else None) for k, target in enumerate(outcome.problem.targets)
    ]


def _target_row(target: Target, simulated: float | None) -> TargetRow:
    if isinstance(target, Number):
        off = None if simulated is None else (simulated - target.mean) / target.sd
        return {
            "target": target.label, "test": target.test, "weight": target.weight, "source": target.source,
            "quantity": target.quantity, "mean": target.mean, "sd": target.sd, "simulated": simulated,
            "deviation_sd": off,
        }  # fmt: skip
    return {
        "target": target.label, "test": target.test, "weight": target.weight, "source": target.source,
        "deviation_sd": simulated,
    }  # fmt: skip


def parameter_rows(outcome: Outcome) -> list[ParameterRow]:
    """Each parameter: bounds, start, prior, what it was before and what was found."""
    rows = []
    runs = [case.run() for case in outcome.problem.cases]
    for k, parameter in enumerate(outcome.problem.parameters):
        before, source = _before(current(parameter.paths[0], runs))
        row: ParameterRow = {
            "fields": [".".join(map(str, path)) for path in parameter.paths],
            "unit": parameter.unit, "low": parameter.low, "high": parameter.high, "start": parameter.start,
            "prior_mean": parameter.prior[0] if parameter.prior else None,
            "prior_sd": parameter.prior[1] if parameter.prior else None,
            "value": outcome.best.values[k] if outcome.best else None,
            "before": before, "before_source": source,
        }  # fmt: skip
        if outcome.judgement:
            found = outcome.judgement.found[k]
            finite = found.sd if math.isfinite(found.sd) else None
            row |= {"sd": finite, "interval_95": list(found.interval), "sensitivity_sd": found.sensitivity}
        rows.append(row)
    return rows


def _before(number: Quantity | float | None) -> tuple[float | None, str]:
    return (number.value, number.source) if isinstance(number, Quantity) else (number, "")


def warnings_of(outcome: Outcome) -> list[str]:
    """Warnings that a reader of the result must know: limits of its runs first."""
    limits = looser_note(record for one in outcome.history for record in one.records.values())
    return [*limits, *(outcome.judgement.warnings if outcome.judgement else [])]


def as_data(outcome: Outcome) -> dict[str, object]:
    """Plain data of calibration.json."""
    statuses = {r.key: r.status for one in outcome.history for r in one.records.values()}
    return {
        "calibration": outcome.problem.name,
        "status": "converged" if outcome.converged else "not converged",
        "reason": outcome.failure,
        "method": outcome.problem.method,
        "parameters": parameter_rows(outcome),
        "targets": target_rows(outcome),
        "rms_deviation_sd": outcome.rms if outcome.best else None,
        "warnings": warnings_of(outcome),
        "runs": outcome.runs,
        "runs_by_status": dict(Counter(statuses.values())),
        "evaluations": [_evaluation(one) for one in outcome.history],
        "version": knittest.__version__,
        "code": code_digest(),
        "written": now(),
    }


def _evaluation(one: Evaluation) -> dict[str, object]:
    return {
        "number": one.number,
        "values": list(one.values),
        "simulated": list(one.simulated) if one.good else None,
        "reason": one.reason,
        "trials": {name: record.key for name, record in one.records.items()},
    }


def report_lines(outcome: Outcome) -> list[str]:
    """Lines that the command prints at its end."""
    lines = [f"{'converged' if outcome.converged else 'not converged: ' + outcome.failure} ({outcome.runs} runs)"]
    for parameter, row in zip(outcome.problem.parameters, parameter_rows(outcome), strict=True):
        if row["value"] is not None:
            unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
            ends = row.get("interval_95")
            interval = f", 95 % interval {ends[0]:.4g} to {ends[1]:.4g}" if ends else ""
            lines.append(f"  {' = '.join(row['fields'])} = {row['value']:.5g}{unit}{interval}")
    for one in target_rows(outcome) if outcome.best else []:
        form = LABELS.get(one.get("quantity", ""), ("", "{:.5g}"))[1]
        values = f"{form.format(one['simulated'])} for {one['mean']:g} ± {one['sd']:g}, " if "mean" in one else ""
        lines.append(f"  {one['target']}: {values}{one['deviation_sd']:+.3f} sd ({one['source']})")
    lines += [f"  warning: {text}" for text in warnings_of(outcome)]
    lost = [one for one in outcome.history if not one.good]
    lines += [f"  no number at point {one.number}: {one.reason}" for one in lost]
    return lines


def largest_deviations(outcome: Outcome) -> np.ndarray:
    """Largest deviation [sd] among the targets at each point (n,), nan without numbers."""
    found = [np.abs(one.deviations).max() if one.deviations is not None else math.nan for one in outcome.history]
    return np.array(found)
