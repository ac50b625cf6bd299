"""The page and results.csv of a sweep, from what it left in its folder."""

import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.errors import InputError
from knittest.base.files import replacing, write_atomic
from knittest.base.result_rows import LABELS, UNSCATTERED, unfolded
from knittest.base.summary import Value
from knittest.config.fields import place
from knittest.config.studies import parse_sweep
from knittest.config.yaml_loader import parse_document
from knittest.report_page.blocks import Block, Cell, Code, Page, Section, Table, Text, Tone
from knittest.report_page.files import Reader
from knittest.report_page.page import target_file, write_page
from knittest.report_page.pictures import picture
from knittest.report_page.studies import Column, file_to_save, link, problems, provenance, wide
from knittest.studies.batch.plan import Plan, Row, Swept, axes_of
from knittest.studies.trials.runner import TRIALS
from knittest.studies.trials.trial import MEANING, OPEN, Record

if TYPE_CHECKING:
    from pandas import DataFrame, Series


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


SWEEP, TABLE = "sweep.yaml", "results.csv"
#: rows of the table on the page
MOST_ROWS = 300
#: reasons on the page
MOST_REASONS = 100
CHOICES = ("test", "fabric", "scale", "direction", "preset", "parameters")
HEAD = ("run", "status", "reason", *CHOICES, "folder")
_MEANING: dict[object, str] = {**dict(MEANING.items()), INVALID: "the input is refused", OPEN: "not run yet"}
_TONES: dict[str, Tone] = {"completed": "good", OPEN: "warn"}


def is_sweep(folder: Path) -> bool:
    """Tell whether ``folder`` is that of a sweep with a table."""
    return (folder / SWEEP).is_file() and (folder / TABLE).is_file()


def write_sweep_page(folder: Path, out: Path | None = None) -> Path:
    """Write the page of the sweep in ``folder`` into it, or to ``out``; raises as ``write_reports`` does."""
    target = target_file([folder], out)
    return write_page(target, sweep_page(folder, target.parent))


def sweep_page(folder: Path, at: Path) -> Page:
    """The page of the sweep in ``folder``, to lie in the folder ``at``.

    What is missing or damaged is named on it and costs its own part only.
    """
    reader = Reader(folder)
    swept, table = _swept(reader), _table(reader)
    parts = [
        Section("reasons", "What went wrong", _reasons(folder, at, table), 2),
        Section("runs", "Runs and results", _runs(folder, at, table, swept), 2),
        Section("pictures", "Results over what was swept", _pictures(folder), 2),
        Section("repeat", "How to repeat it", _repeat(reader, table), 2),
    ]
    head = Section("summary", "Sweep", [*_ending(table), *problems(reader), *_states(table, swept)], 2)
    return Page(f"Sweep {folder.resolve().name}", f"{len(table)} runs", [head, *parts])


def _table(reader: Reader) -> "DataFrame":
    """results.csv, with the columns that every table has."""
    import pandas as pd

    table = reader.frame(TABLE)
    if table is None:
        return pd.DataFrame(columns=HEAD)
    missing = [name for name in HEAD if name not in table]
    if missing:
        reader.complain(f"{TABLE}: no column {', '.join(missing)}")
    gaps = [name for name in HEAD if name not in missing and table[name].isna().any()]
    return table.assign(**dict.fromkeys(missing, ""), **{name: table[name].astype(object).fillna("") for name in gaps})


def _swept(reader: Reader) -> list[Swept]:
    raw = reader.raw(SWEEP, 1_000_000)
    if raw is None:
        return []
    try:
        document = parse_document(raw.decode("utf-8", errors="replace"), SWEEP)
        sweep = parse_sweep(document)
        return Plan(sweep, [], axes_of(sweep, document)).swept
    except InputError as error:
        reader.complain(error)
        return []


def _ending(table: "DataFrame") -> list[Block]:
    counts = table["status"].value_counts()
    left, lost = int(counts.get(OPEN, 0)), int(len(table) - counts.get("completed", 0) - counts.get(OPEN, 0))
    blocks: list[Block] = []
    if left:
        blocks.append(Text(f"Not finished; runs left: {left}. The same command goes on with them.", "warn"))
    if lost:
        blocks.append(Text(f"Without a result that counts: {lost} of {len(table)} runs; each has its reason.", "bad"))
    if "looser_limits" in table:
        found = table["looser_limits"].dropna()
        named = ", ".join(dict.fromkeys("; ".join(map(str, found)).split("; ")))
        blocks.append(Text(f"Limits looser than the preset's in {len(found)} of {len(table)} runs: {named}", "bad"))
    return blocks


def _states(table: "DataFrame", swept: Sequence[Swept]) -> list[Block]:
    counts = table["status"].value_counts()
    rows = [(Cell(str(s), tone=_tone(s)), Cell(str(n), float(n)), Cell(_MEANING.get(s, ""))) for s, n in counts.items()]
    facts = [("swept", ", ".join(_name(table, field) for field in swept) or "nothing")]
    facts += [(name, ", ".join(dict.fromkeys(filter(None, map(str, table[name]))))) for name in CHOICES]
    if "cpu_s" in table and table["cpu_s"].notna().any():
        facts.append(("processor time", f"{table['cpu_s'].sum():.4g} s"))
    described = Table("The sweep", (), [(Cell(name), Cell(value)) for name, value in facts if value])
    return [described, Table("How the runs ended", ("state", "runs", "meaning"), rows, (1,))]


def _reasons(folder: Path, at: Path, table: "DataFrame") -> list[Block]:
    """State and reason of every run without a result that counts."""
    lost = table[~table["status"].isin(("completed", OPEN))]
    if lost.empty:
        return [Text("Every run that ended gave a result that counts.")]
    rows = [
        (*_naming(folder, at, row), Cell(str(row["reason"]) or "no reason is recorded"))
        for _, row in lost.head(MOST_REASONS).iterrows()
    ]
    caption = f"Without a result that counts: {len(lost)}"
    caption += f", the first {MOST_REASONS} of them; {TABLE} has all" if len(lost) > MOST_REASONS else ""
    return [Table(caption, ("run", "state", "reason"), rows)]


def _naming(folder: Path, at: Path, row: "Series") -> tuple[Cell, Cell]:
    """Number of a run with a link to it, and its state."""
    run = Cell(str(row["run"]), href=link(folder, str(row["folder"]), at))
    return run, Cell(row["status"], tone=_tone(row["status"]))


def _runs(folder: Path, at: Path, table: "DataFrame", swept: Sequence[Swept]) -> list[Block]:
    """One row a run; of very many those without a result first."""
    caption = "Runs; small print: deviation from the experiment, and kind of the row"
    if len(table) > MOST_ROWS:
        caption = f"{MOST_ROWS} of {len(table)} runs, those that did not complete first; {TABLE} has all"
        settled = table["status"].isin(("completed", OPEN))
        table = table.loc[settled.sort_values(kind="stable").index].head(MOST_ROWS)
    rows = [row for _, row in table.iterrows()]
    named = [_naming(folder, at, row) for row in rows]
    naming = [Column("run", [run for run, _ in named]), Column("state", [state for _, state in named])]
    varying = [name for name in CHOICES if table[name].nunique() > 1]
    beside = [Column(name, [Cell(str(row[name])) for row in rows]) for name in varying]
    beside += [_field(table, field, rows) for field in swept if field.name in table and field.name not in CHOICES]
    results = [name for name in LABELS if name in table and table[name].notna().any()]
    beside += [Column(LABELS[name][0], [_result(row, name) for row in rows], numeric=True) for name in results]
    return wide(caption, naming, beside)


def _field(table: "DataFrame", field: Swept, rows: Sequence["Series"]) -> Column:
    import pandas as pd

    cells = []
    for row in rows:
        number = _number(row[field.name])
        said = NULL if pd.isna(row[field.name]) else str(row[field.name])
        cells.append(Cell(said) if number is None else Cell(f"{number:.6g}", number))
    return Column(_name(table, field), cells, numeric=all(cell.value is not None for cell in cells))


def _result(row: "Series", name: str) -> Cell:
    value = _number(row[name])
    if value is None:
        return Cell("-")
    form, compared = LABELS[name][1], _number(row.get(f"{name}_simulated"))
    factor = 1.0 if compared is None or value == 0.0 else compared / value  # to the nominal size of the specimen
    sd, deviation = _number(row.get(f"{name}_sd")), _number(row.get(f"{name}_deviation_sd"))
    share, kind = _number(row.get(f"{name}_deviation_pct")), row.get(f"{name}_kind")
    off = [] if share is None else [f"{share:+.1f} %, {UNSCATTERED}"]
    notes = ["refused"] if row["status"] == "refused" else off if deviation is None else [f"{deviation:+.2f} sd"]
    notes += [kind] if isinstance(kind, str) and row["status"] == "completed" else []
    text = form.format(factor * value) + (f" ± {form.format(factor * sd)}" if sd is not None else "")
    return Cell(text, factor * value, note=", ".join(notes))


def _number(value: object) -> float | None:
    """A finite number, ``None`` for anything else."""
    import numpy as np

    return float(value) if isinstance(value, int | float | np.number) and np.isfinite(value) else None


def _name(table: "DataFrame", field: Swept) -> str:
    found = place(tuple(field.name.split(".")), table["test"].iloc[0] if len(table) else None)
    return f"{field.name} [{found.unit}]" if found and found.unit not in ("", "1") else field.name


def _tone(status: object) -> Tone:
    return _TONES.get(str(status), "bad")


def _pictures(folder: Path) -> list[Block]:
    names = sorted(folder.glob("overview*.png"))
    caption = "Filled: completed; hollow: refused by a quality gate; cross: no result"
    return [picture(name, caption) for name in names] or [Text("There is no picture: no result, or nothing varies.")]


def _repeat(reader: Reader, table: "DataFrame") -> list[Block]:
    blocks: list[Block] = [Code(f"knittest batch {SWEEP}", f"Command; {SWEEP} is the one below")]
    blocks += file_to_save(reader, SWEEP, "The sweep; its files of fabrics and rigs are seen from its own folder")
    return [*blocks, *provenance(reader.folder, [str(name) for name in table["folder"]])]
