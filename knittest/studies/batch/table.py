"""results.csv of a batch: one row a run."""

import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.atomic import replacing, write_atomic
from knittest.base.errors import InputError
from knittest.base.result_rows import unfolded
from knittest.base.summary import Value
from knittest.studies.batch.plan import Plan, Row
from knittest.studies.trials.record import OPEN, Record
from knittest.studies.trials.runner import TRIALS

if TYPE_CHECKING:
    from pandas import DataFrame

#: cells of a row by the name of their column
Cells = dict[str, object]
#: status of a row whose input is refused
INVALID = "invalid"
#: a swept field that is not given, as a sweep file says it; pandas reads it from CSV as a missing number
NULL = "null"


def results_table(plan: Plan, rows: Sequence[Row], records: Mapping[str, Record]) -> "DataFrame":
    """Run, status and reason; what was chosen and swept; results, comparison, quality and cost; where it is.

    Columns of swept fields have the field's dotted name, those of results their name in summary.json.
    """
    import pandas as pd

    swept = [field.name for field in plan.swept]
    lines = [_line(row, None if row.trial is None else records.get(row.trial.key), swept) for row in rows]
    order = ("head", "swept", "results", "comparison", "quality", "cost", "tail")
    columns = [dict.fromkeys(name for line in lines for name in line[part]) for part in order]
    names = list(dict.fromkeys(name for part in columns for name in part))
    flat = [{name: value for part in order for name, value in line[part].items()} for line in lines]
    return pd.DataFrame(flat, columns=names)


def write_table(table: "DataFrame", folder: Path, parquet: bool) -> None:
    """Write results.csv and, where asked for, results.parquet; raises :class:`ResourceError`."""
    text = io.StringIO()
    table.to_csv(text, index=False, float_format="%.10g")
    write_atomic(folder / "results.csv", text.getvalue())
    if parquet:
        with replacing(folder / "results.parquet") as temporary:
            _uniform(table).to_parquet(temporary, index=False)


def check_parquet() -> None:
    """Raise :class:`InputError` where nothing can write Parquet."""
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise InputError("--parquet: pyarrow is not installed: pip install 'knittest[parquet]'") from None


def _line(row: Row, record: Record | None, swept: Sequence[str]) -> dict[str, Cells]:
    """The cells of a row, by part of the table."""
    summary = record.summary if record else None
    comparison: dict[str, object] = {
        f"{one['quantity']}_{name}": one.get(name)
        for one in (summary.get("comparison", []) if summary else [])
        for name in ("simulated", "experiment_mean", "experiment_sd", "deviation_sd", "deviation_pct", "kind")
    }
    return {
        "head": _head(row, record),
        "swept": {name: _cell(row.values.get(name)) for name in swept},
        "results": _results(unfolded(summary.get("results", {}))) if summary else {},
        "comparison": comparison,
        "quality": {**(summary.get("quality", {}) if summary else {}), **_looser(record)},
        "cost": {**(record.cost if record and record.cost else {})},
        "tail": _tail(row, record),
    }


def _head(row: Row, record: Record | None) -> Cells:
    run = row.trial.run if row.trial else None
    return {
        "run": row.number,
        "status": record.status if record else OPEN if run else INVALID,
        "reason": record.reason if record else row.problem,
        "test": row.case.test,
        "fabric": run.fabric.name if run else "",
        "scale": run.model.scale if run else "",
        "direction": run.direction if run else "",
        "preset": run.model.preset if run else "",
        "parameters": run.parameters if run else "",
    }


def _looser(record: Record | None) -> dict[str, str]:
    """A column for limits looser than the preset's, if there are any."""
    limits = record.looser_limits if record else []
    return {"looser_limits": "; ".join(limits)} if limits else {}


def _results(results: Mapping[str, Value]) -> Cells:
    """A column a result; mean and sd of an ensemble."""
    cells: Cells = {}
    for name, value in results.items():
        if isinstance(value, Mapping):
            cells |= {name: value["mean"], f"{name}_sd": value["sd"]}
        else:
            cells[name] = value
    return cells


def _tail(row: Row, record: Record | None) -> Cells:
    return {
        "attempts": 1 + len(record.earlier) if record else None,
        "host": record.host if record else "",
        "ended": record.ended if record else "",
        "folder": f"{TRIALS}/{row.trial.key}" if row.trial else "",
    }


def _cell(value: object) -> object:
    if value is None:
        return NULL
    return json.dumps(value) if isinstance(value, dict | list) else value


def _uniform(table: "DataFrame") -> "DataFrame":
    """Columns that mix kinds as text, for a format with one type a column; what is not given is missing there."""
    table = table.where(table != NULL).infer_objects()
    kinds = {name: table[name].dropna().map(type).nunique() for name in table.columns}
    return table.astype({name: "string" for name, count in kinds.items() if count > 1 and table[name].dtype == object})
