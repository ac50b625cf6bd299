"""Section of a report on the quality checks with their limits, the energies and the cost of a run."""

import math
from collections.abc import Mapping

import numpy as np

from knittest.base.result_rows import unfold_results
from knittest.base.summary import Value
from knittest.laboratory.report_base import QualityCheck
from knittest.report_page.blocks import Block, Cell, Section, Table, Text
from knittest.report_page.files import Number
from knittest.report_page.loaded_run import LoadedRun

_COST = {
    "wall_s": "wall time, sum over the specimens [s]",
    "cpu_s": "processor time [s]",
    "compile_s": "compilation, part of the wall time [s]",
    "element_steps_per_s": "element steps per second",
}
#: rows of a table of trials
MOST_ROWS = 12


def quality_section(run: LoadedRun) -> Section:
    """Section with the verdict of each quality check, the energies and the cost."""
    blocks: list[Block] = []
    summary = run.summary
    if run.run is not None and run.report is not None and summary.quality:
        parts: dict[str, Mapping[str, Value]] = {
            "quality": summary.quality, "results": unfold_results(summary.plain()["results"]),
        }  # fmt: skip
        presets = {limit.name: limit.preset for limit in summary.limits}
        rows = [
            _check_row(check, _number(parts[check.part].get(check.key)), presets)
            for check in run.report.quality_checks(run.run)
        ]
        caption = "Quality checks: a run that fails one is not compared with the experiment"
        blocks.append(Table(caption, ("check", "value", "limit", "verdict"), rows, (1, 2)))
    elif summary.quality:
        plain = [(Cell(k.replace("_", " ")), Cell(_number_text(v), v)) for k, v in summary.quality.items()]
        blocks.append(Table("Quality measures (limits unknown)", ("measure", "value"), plain, (1,)))
    else:
        blocks.append(Text("This run has no quality checks.", "warn"))
    for limit in summary.limits:
        accepted = "accepted by --accept-limits" if limit.accepted else "not accepted, so the run is not compared"
        value, preset = (f"{_number_text(number)} {limit.unit}".strip() for number in (limit.value, limit.preset))
        blocks.append(Text(f"Relaxed limit: {limit.name} = {value} (preset {preset}), {accepted}", "bad"))
    blocks += [Text(f"Failed: {reason}", "bad") for reason in summary.refused]
    blocks += _energies(run)
    cost = [(Cell(_COST.get(k, k)), Cell(_number_text(v), v)) for k, v in summary.cost.items()]
    if cost:
        blocks.append(Table("Cost", (), cost, (1,)))
    return Section(f"run-{run.number}-gates", "Quality checks and energies", blocks)


def _check_row(check: QualityCheck, value: float | None, presets: Mapping[str, Number]) -> tuple[Cell, ...]:
    """Row of a check; ``presets`` are the limits of the preset, by field, where the run has relaxed limits."""
    preset = presets.get(check.field)
    relaxed = f" (preset {preset:g} {check.unit})" if preset is not None else ""
    limit = Cell(f"{check.limit:g} {check.unit}{relaxed}", check.limit, tone="warn" if relaxed else "")
    if value is None or not math.isfinite(value):
        return Cell(check.label), Cell("-"), limit, Cell("not measured", tone="warn")
    value *= check.scale
    verdict = Cell("pass", tone="good") if value <= check.limit else Cell("FAIL", tone="bad")
    return Cell(check.label), Cell(f"{value:.3g} {check.unit}", value), limit, verdict


def _number(value: Value) -> float | None:
    if isinstance(value, Mapping):
        return max((v for v in value["values"] if v is not None), default=None)
    return value


def _energies(run: LoadedRun) -> list[Block]:
    """Table of the energies at the largest force and at the end, or of the trials of a static equilibrium."""
    table = run.energies
    parts = {k: v for k, v in table.items() if k.endswith("_mj")}
    if not table:
        return [Text("This run has no table of energies.", "warn")]
    if not parts:
        header = tuple(name.replace("_", " ") for name in table)
        rows = [tuple(Cell(f"{v:.5g}", v) for v in row) for row in np.column_stack(list(table.values()))[-MOST_ROWS:]]
        return [Table("Static equilibrium: the last trials of its search", header, rows, tuple(range(len(header))))]
    at = {"at the end" if run.whole else "at the stop": -1}
    if (top := _largest_force(run)) is not None:
        at = {"at the largest force": top, **at}
    rows = [
        (Cell(name.removesuffix("_mj").replace("_", " ")), *(Cell(f"{v[i]:.4g}", float(v[i])) for i in at.values()))
        for name, v in parts.items()
    ]
    return [Table("Energies [mJ]; not checked after the first failure", ("energy", *at), rows, (1, 2)[: len(at)])]


def _largest_force(run: LoadedRun) -> int | None:
    """Last row of the energies up to the time of the largest force; ``None`` if unknown."""
    column = run.curve.get(run.report.axes.y) if run.report else None
    times, when = run.energies.get("time_ms"), run.curve.get("time_ms")
    if column is None or times is None or when is None or not np.isfinite(column).any():
        return None
    # one row later the specimen may have failed
    return max(int(np.searchsorted(times, when[np.nanargmax(column)], side="right")) - 1, 0)


def _number_text(value: Number) -> str:
    return "-" if value is None else f"{value:.6g}"
