"""Quality gates with their limits, energies and cost of a run."""

import math
from collections.abc import Mapping

import numpy as np

from knittest.base.result_rows import unfolded
from knittest.base.summary import Value
from knittest.laboratory.report_base import Gate
from knittest.report_page.blocks import Block, Cell, Section, Table, Text
from knittest.report_page.files import LooserLimit, Number
from knittest.report_page.loading import LoadedRun

_COST = {
    "wall_s": "time on the clock, of specimens added up [s]",
    "cpu_s": "processor time [s]",
    "compile_s": "compiling, part of the time on the clock [s]",
    "element_steps_per_s": "elements times steps a second",
}
#: rows of a table of states at rest
MOST_ROWS = 12


def gates(run: LoadedRun) -> Section:
    """Pass or fail of each gate, energies at the end, cost."""
    blocks: list[Block] = []
    summary = run.summary
    if run.run is not None and run.report is not None and summary.quality:
        parts: dict[str, Mapping[str, Value]] = {
            "quality": summary.quality, "results": unfolded(summary.plain()["results"]),
        }  # fmt: skip
        presets = {limit.name: limit.preset for limit in summary.limits}
        rows = [_judged(gate, _number(parts[gate.part].get(gate.key)), presets) for gate in run.report.gates(run.run)]
        caption = "Quality gates: a run that fails one is not compared"
        blocks.append(Table(caption, ("gate", "value", "limit", "verdict"), rows, (1, 2)))
    elif summary.quality:
        plain = [(Cell(k.replace("_", " ")), Cell(_shown(v), v)) for k, v in summary.quality.items()]
        blocks.append(Table("Quality; its limits are not known", ("measure", "value"), plain, (1,)))
    else:
        blocks.append(Text("This run left no quality gates.", "warn"))
    blocks += [Text(_looser(limit), "bad") for limit in summary.limits]
    blocks += [Text(f"Failed: {reason}", "bad") for reason in summary.refused]
    blocks += _energies(run)
    cost = [(Cell(_COST.get(k, k)), Cell(_shown(v), v)) for k, v in summary.cost.items()]
    if cost:
        blocks.append(Table("Cost", (), cost, (1,)))
    return Section(f"run-{run.number}-gates", "Quality gates and energies", blocks)


def _looser(limit: LooserLimit) -> str:
    """Note on a limit that a reader must know before the table above is worth anything."""
    taken = "accepted by --accept-limits" if limit.accepted else "not accepted, so nothing is compared"
    value, preset = (f"{_shown(number)} {limit.unit}".strip() for number in (limit.value, limit.preset))
    return f"Looser than the preset: {limit.name} = {value}, the preset's is {preset}; {taken}"


def _judged(gate: Gate, value: float | None, presets: Mapping[str, Number]) -> tuple[Cell, ...]:
    """The row of a gate; ``presets`` are the preset's limits by field where the run's are looser."""
    preset = presets.get(gate.field)
    looser = f" (preset {preset:g} {gate.unit})" if preset is not None else ""
    limit = Cell(f"{gate.limit:g} {gate.unit}{looser}", gate.limit, tone="warn" if looser else "")
    if value is None or not math.isfinite(value):
        return Cell(gate.label), Cell("-"), limit, Cell("not measured", tone="warn")
    value *= gate.scale
    passed = value <= gate.limit
    verdict = Cell("pass", tone="good") if passed else Cell("FAIL", tone="bad")
    return Cell(gate.label), Cell(f"{value:.3g} {gate.unit}", value), limit, verdict


def _number(value: Value) -> float | None:
    """A number, of an ensemble the largest."""
    if isinstance(value, Mapping):
        return max((v for v in value["values"] if v is not None), default=None)
    return value


def _energies(run: LoadedRun) -> list[Block]:
    """Energies at the largest force and at the end; of a state at rest the trials."""
    table = run.energies
    parts = {k: v for k, v in table.items() if k.endswith("_mj")}
    if not table:
        return [Text("This run left no table of energies.", "warn")]
    if not parts:
        header = tuple(name.replace("_", " ") for name in table)
        rows = [tuple(Cell(f"{v:.5g}", v) for v in row) for row in np.column_stack(list(table.values()))[-MOST_ROWS:]]
        return [Table("No energies by time: a state at rest. Its trials", header, rows, tuple(range(len(header))))]
    at = {"at the end" if run.whole else "when it stopped": -1}
    top = _largest_force(run)
    if top is not None:
        at = {"at the largest force": top, **at}
    rows = [
        (Cell(name.removesuffix("_mj").replace("_", " ")), *(Cell(f"{v[i]:.4g}", float(v[i])) for i in at.values()))
        for name, v in parts.items()
    ]
    caption = "Energies [mJ]; after the first failure they are not judged"
    return [Table(caption, ("energy", *at), rows, tuple(range(1, len(at) + 1)))]


def _largest_force(run: LoadedRun) -> int | None:
    """Last row of the energies up to the time of the largest force, ``None`` where it cannot be told.

    A row later the specimen may be torn.
    """
    column = run.curve.get(run.report.axes.y) if run.report else None
    times, when = run.energies.get("time_ms"), run.curve.get("time_ms")
    if column is None or times is None or when is None or not np.isfinite(column).any():
        return None
    return max(int(np.searchsorted(times, when[np.nanargmax(column)], side="right")) - 1, 0)


def _shown(value: Number) -> str:
    return "-" if value is None else f"{value:.6g}"
