"""The page and results.csv of a sweep, from the files in its folder."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from knittest.base.errors import InputError
from knittest.base.files import replace_file
from knittest.base.result_rows import LABELS, UNSCATTERED, unfold_results
from knittest.config.aliases import present_field
from knittest.config.fields import field_at
from knittest.config.studies import parse_sweep
from knittest.config.yaml_loader import parse_document
from knittest.report_page.blocks import Block, Cell, Table, Text, Tone
from knittest.report_page.files import Reader
from knittest.report_page.pictures import picture
from knittest.report_page.studies import Column, link, provenance, split_table
from knittest.studies.batch.picture import CHOICES as PICTURED
from knittest.studies.batch.plan import Plan, Row, SweptField, axes_of
from knittest.studies.trials.page import NOT_FINISHED, TABLE, Contents, StudyPage, facts_table, repeat_blocks, write_csv
from knittest.studies.trials.runner import TRIALS
from knittest.studies.trials.trial import MEANING, OPEN, Record

if TYPE_CHECKING:
    from pandas import DataFrame, Series


#: status of a row with invalid input
INVALID = "invalid"
#: a swept field without a value, as in a sweep file; pandas reads it from CSV as a missing number
NULL = "null"


def results_table(plan: Plan, rows: Sequence[Row], records: Mapping[str, Record]) -> "DataFrame":
    """Table of all runs; swept columns have the field's dotted name, results their name in summary.json."""
    import pandas as pd

    swept = [field.name for field in plan.swept_fields]
    lines = [_line(row, None if row.trial is None else records.get(row.trial.key), swept) for row in rows]
    names = dict.fromkeys(name for parts in zip(*lines, strict=True) for part in parts for name in part)
    flat = [{name: value for part in line for name, value in part.items()} for line in lines]
    return pd.DataFrame(flat, columns=list(names))


def write_table(table: "DataFrame", folder: Path, parquet: bool) -> None:
    """Write results.csv and, where asked for, results.parquet; raises :class:`ResourceError`.

    Parquet has one type a column: mixed columns become text, and values that are not given are missing.
    """
    write_csv(table, folder)
    if parquet:
        table = table.where(table != NULL).infer_objects()
        kinds = {name: table[name].dropna().map(type).nunique() for name in table.columns}
        mixed = [name for name, count in kinds.items() if count > 1 and table[name].dtype == object]
        with replace_file(folder / "results.parquet") as temporary:
            table.astype(dict.fromkeys(mixed, "string")).to_parquet(temporary, index=False)


def _line(row: Row, record: Record | None, swept: Sequence[str]) -> tuple[dict[str, object], ...]:
    """Cells of a row by the name of their column, in parts: each part has its columns before those of the next."""
    run, summary = row.trial.run if row.trial else None, record.summary if record else None
    head: dict[str, object] = {
        "run": row.number,
        "status": record.status if record else OPEN if run else INVALID,
        "reason": record.reason if record else row.problem,
        "test": row.case.kind,
        "fabric": run.fabric.name if run else "",
        "scale": run.model.scale if run else "",
        "direction": run.direction if run else "",
        "preset": run.model.preset if run else "",
        "parameters": run.parameters if run else "",
    }
    chosen = {name: json.dumps(v) if isinstance(v := row.values.get(name), dict | list) else v for name in swept}
    chosen = {name: NULL if value is None else value for name, value in chosen.items()}
    results: dict[str, object] = {}  # mean and sd of an ensemble
    for name, value in unfold_results(summary.get("results", {})).items() if summary else ():
        found = {name: value["mean"], f"{name}_sd": value["sd"]} if isinstance(value, Mapping) else {name: value}
        results |= found
    comparison: dict[str, object] = {
        f"{one['quantity']}_{name}": one.get(name)
        for one in (summary.get("comparison", []) if summary else [])
        for name in ("simulated", "experiment_mean", "experiment_sd", "deviation_sd", "deviation_pct", "kind")
    }
    limits = record.relaxed_limits if record else []
    tail: dict[str, object] = {"attempts": None, "host": "", "ended": ""}
    if record:
        tail = {"attempts": 1 + len(record.earlier), "host": record.host, "ended": record.ended}
    tail["folder"] = f"{TRIALS}/{row.trial.key}" if row.trial else ""
    return (
        head, chosen, results, comparison,
        {**(summary.get("quality", {}) if summary else {}), **({"looser_limits": "; ".join(limits)} if limits else {})},
        {**(record.cost if record and record.cost else {})}, tail,
    )  # fmt: skip


SWEEP = "sweep.yaml"
#: most rows of the table, and most reasons, on the page
MOST_ROWS, MOST_REASONS = 300, 100
CHOICES = ("test", *PICTURED)
HEAD = ("run", "status", "reason", *CHOICES, "folder")
_MEANING: dict[object, str] = {**dict(MEANING.items()), OPEN: "not run yet"}
_TONES: dict[object, Tone] = {"completed": "good", OPEN: "warn"}


def _contents(reader: Reader, at: Path) -> Contents:
    swept, table = _swept_fields(reader), _table(reader)
    pictures = sorted(reader.folder.glob("overview*.png"))
    caption = "Filled: completed; hollow: a quality check failed; cross: no result"
    return Contents(
        "", f"{len(table)} runs", _notes(table), _facts(table, swept),
        [
            ("reasons", "Runs without a valid result", _reasons(reader.folder, at, table)),
            ("runs", "Runs and results", _runs(reader.folder, at, table, swept)),
            ("pictures", "Results over the swept fields", [picture(path, caption) for path in pictures]
             or [Text("There is no picture: no run has a result, or no field varies.")]),
            ("repeat", "How to repeat it", [
                *repeat_blocks("batch", SWEEP, "The sweep; paths in it start at its own folder", reader),
                *provenance(reader.folder, [str(name) for name in table["folder"]]),
            ]),
        ],
    )  # fmt: skip


PAGE = StudyPage("Sweep", (SWEEP, TABLE), _contents)


def _table(reader: Reader) -> "DataFrame":
    """Read results.csv, with the columns that every table has."""
    import pandas as pd

    table = reader.frame(TABLE)
    if table is None:
        return pd.DataFrame(columns=HEAD)
    table = table.rename(columns=present_field)
    missing = [name for name in HEAD if name not in table]
    if missing:
        reader.add_problem(f"{TABLE}: no column {', '.join(missing)}")
    gaps = [name for name in HEAD if name not in missing and table[name].isna().any()]
    return table.assign(**dict.fromkeys(missing, ""), **{name: table[name].astype(object).fillna("") for name in gaps})


def _swept_fields(reader: Reader) -> list[SweptField]:
    raw = reader.raw(SWEEP, 1_000_000)
    if raw is None:
        return []
    try:
        document = parse_document(raw.decode("utf-8", errors="replace"), SWEEP)
        sweep = parse_sweep(document)
        return Plan(sweep, [], axes_of(sweep, document)).swept_fields
    except InputError as error:
        reader.add_problem(error)
        return []


def _notes(table: "DataFrame") -> list[Block]:
    counts = table["status"].value_counts()
    left, lost = int(counts.get(OPEN, 0)), int(len(table) - counts.get("completed", 0) - counts.get(OPEN, 0))
    blocks: list[Block] = [Text(NOT_FINISHED.format(left), "warn")] if left else []
    if lost:
        blocks.append(Text(f"{lost} of {len(table)} runs have no valid result; the reasons are below.", "bad"))
    if "looser_limits" in table:
        found = table["looser_limits"].dropna()
        named = ", ".join(dict.fromkeys("; ".join(map(str, found)).split("; ")))
        told = f"{len(found)} of {len(table)} runs have limits looser than those of the preset: {named}"
        blocks.append(Text(told, "bad"))
    return blocks


def _facts(table: "DataFrame", swept: Sequence[SweptField]) -> list[Block]:
    counts = table["status"].value_counts()
    rows = [(_state(s), Cell(str(n), float(n)), Cell(_MEANING.get(s, ""))) for s, n in counts.items()]
    facts = {"swept": ", ".join(_field_label(table, field) for field in swept) or "nothing"}
    facts |= {name: ", ".join(dict.fromkeys(filter(None, map(str, table[name])))) for name in CHOICES}
    if "cpu_s" in table and table["cpu_s"].notna().any():
        facts["processor time"] = f"{table['cpu_s'].sum():.4g} s"
    return [facts_table("The sweep", facts), Table("Runs by state", ("state", "runs", "meaning"), rows, (1,))]


def _reasons(folder: Path, at: Path, table: "DataFrame") -> list[Block]:
    """State and reason of every run without a valid result."""
    lost = table[~table["status"].isin(("completed", OPEN))]
    if lost.empty:
        return [Text("Every run that ended has a valid result.")]
    first = [row for _, row in lost.head(MOST_REASONS).iterrows()]
    rows = [(*_run_cells(folder, at, row), Cell(str(row["reason"]) or "no reason is recorded")) for row in first]
    caption = f"Runs without a valid result: {len(lost)}"
    caption += f", the first {MOST_REASONS} of them; {TABLE} has all" if len(lost) > MOST_REASONS else ""
    return [Table(caption, ("run", "state", "reason"), rows)]


def _run_cells(folder: Path, at: Path, row: "Series") -> tuple[Cell, Cell]:
    """Number of a run with a link to it, and its state."""
    return Cell(str(row["run"]), href=link(folder, str(row["folder"]), at)), _state(row["status"])


def _state(status: object) -> Cell:
    return Cell(str(status), tone=_TONES.get(status, "bad"))


def _runs(folder: Path, at: Path, table: "DataFrame", swept: Sequence[SweptField]) -> list[Block]:
    """Rows of all runs; of very many runs those that did not complete first."""
    caption = "Runs; small print: deviation from the experiment, and kind of the row"
    if len(table) > MOST_ROWS:
        caption = f"{MOST_ROWS} of {len(table)} runs, those that did not complete first; {TABLE} has all"
        settled = table["status"].isin(("completed", OPEN))
        table = table.loc[settled.sort_values(kind="stable").index].head(MOST_ROWS)
    rows = [row for _, row in table.iterrows()]
    named = [_run_cells(folder, at, row) for row in rows]
    naming = [Column("run", [run for run, _ in named]), Column("state", [state for _, state in named])]
    columns = [Column(n, [Cell(str(row[n])) for row in rows]) for n in CHOICES if table[n].nunique() > 1]
    columns += [_field(table, field, rows) for field in swept if field.name in table and field.name not in CHOICES]
    results = [name for name in LABELS if name in table and table[name].notna().any()]
    columns += [Column(LABELS[name][0], [_result(row, name) for row in rows], numeric=True) for name in results]
    return split_table(caption, naming, columns)


def _field(table: "DataFrame", field: SweptField, rows: Sequence["Series"]) -> Column:
    import pandas as pd

    cells = []
    for row in rows:
        number = _number(row[field.name])
        text = NULL if pd.isna(row[field.name]) else str(row[field.name])
        cells.append(Cell(text) if number is None else Cell(f"{number:.6g}", number))
    return Column(_field_label(table, field), cells, numeric=all(cell.value is not None for cell in cells))


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
    """``value`` if it is a finite number, else None."""
    import numpy as np

    return float(value) if isinstance(value, int | float | np.number) and np.isfinite(value) else None


def _field_label(table: "DataFrame", field: SweptField) -> str:
    found = field_at(tuple(field.name.split(".")), table["test"].iloc[0] if len(table) else None)
    return f"{field.name} [{found.unit}]" if found and found.unit not in ("", "1") else field.name
