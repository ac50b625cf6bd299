"""Outcome of a run: its end, results beside the experiment, the metrics of its curve, the numerical error of each
result.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from knittest.base.history import rest_rows, unjudged_note
from knittest.base.result_rows import (
    FEW,
    KINDS,
    LABELS,
    NO_REFERENCE,
    NOTHING,
    OF_MEANS,
    UNRESOLVED,
    UNSCATTERED,
    ResultRow,
    assumed_inputs,
    error_text,
    result_rows,
    unfolded,
)
from knittest.experiment.compare import ERRORS, UNRATED
from knittest.laboratory.numerical_error import error_notes
from knittest.report_page.blocks import Block, Cell, Section, Table, Text, Tone
from knittest.report_page.files import ComparedRow, Number
from knittest.report_page.loading import LoadedRun

ERROR_HEADER = ("quantity", "at half the speed", "on the other mesh", "numerical error")


def error_blocks(run: LoadedRun) -> list[Block]:
    """Table of the changes and errors, or that there are none, then how they were found; of a refused run nothing."""
    summary = run.summary
    notes = error_notes(summary.plain(), asked=run.setting("output", "verify") is True)
    texts = [Text(note[0].upper() + note[1:] + ".") for note in notes]
    if not summary.numerical_error or summary.refused:
        return list(texts)
    rows = []
    for quantity, found in summary.numerical_error.items():
        label, form = LABELS.get(quantity, (quantity.replace("_", " "), "{:.4g}"))
        mesh = found.get("finer_mesh_pct", found.get("coarser_mesh_pct"))
        error = _error_number(found.get("error"))
        told = Cell("not available", note=str(found.get("reason") or ""), tone="warn")
        told = told if error is None else Cell(f"± {error_text(error, form)}", error)
        rows.append((Cell(label), _change(found.get("half_speed_pct")), _change(mesh), told))
    caption = "Numerical error: index of Roache with a safety factor of 3, from half the speed and another mesh"
    return [Table(caption, ERROR_HEADER, rows, (1, 2, 3)), *texts]


def _change(percent: Number | str) -> Cell:
    value = _error_number(percent)
    return Cell("-") if value is None else Cell(f"{value:+.2f} %", value)


def _error_number(value: Number | str) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


_VERDICTS: dict[str, Tone] = {
    "within 1 sd": "good", "outside 1 sd": "bad", "refused": "bad", "not comparable": "warn", UNRESOLVED: "warn",
    FEW: "warn", UNSCATTERED: "warn",
}  # fmt: skip
#: error of a peak, a strain or a force at an angle that is said above the table [%]
FAR_OFF = 10.0
HEADER = ("quantity", "simulated", "experiment", "deviation", "kind")
_PREDICTED = "predicted: no parameter was fitted to this row"


def rows_of(run: LoadedRun) -> list[ResultRow]:
    """Results of the run as every table shows them."""
    return result_rows(run.summary.plain(), refused=bool(run.summary.refused))


def ending(run: LoadedRun) -> list[Block]:
    """Notices on how the run ended and on what of its folder is missing."""
    manifest, blocks = run.manifest, list[Block]()
    if manifest.status == "running":
        blocks.append(Text("Not finished: the run is still going on, or was killed. knittest resume goes on.", "warn"))
    elif manifest.status not in ("", "completed"):
        reason = manifest.message or "no reason was recorded"
        on = "; knittest resume goes on" if manifest.status == "interrupted" else ""
        blocks.append(Text(f"This run {_verb(manifest.status)}: {reason}{on}. There are no results.", "bad"))
    if run.summary.refused:
        blocks.append(Text("Comparison refused: " + "; ".join(run.summary.refused), "bad"))
    elif manifest.status == "completed":
        blocks.append(Text("The run passed all quality checks.", "good"))
    blocks += [Text(f"Warning: {reason}", "warn") for reason in run.summary.warnings]
    if run.problems:
        blocks.append(Text("Missing or not readable: " + "; ".join(run.problems), "warn"))
    return blocks


def results(run: LoadedRun) -> Section:
    """Table of results and deviations with the kind of each row, and metrics of the curve."""
    rows = rows_of(run)
    blocks: list[Block] = []
    if rows:
        count = run.setting("variability", "specimens")
        several = isinstance(count, int) and count > 1
        what = f"Results, mean ± sd of {count} specimens" if several else "Results"
        what += " ± numerical error" if run.summary.numerical_error and what == "Results" else ""
        sources = sorted({_cited(row) for row in run.summary.comparison if row.source})
        against = f", beside the experiment ({'; '.join(sources)}: mean ± sd)" if sources else ""
        alone = all(row.verdict == NO_REFERENCE and row.kind == "-" for row in rows)
        shown = HEADER[:2] if alone else HEADER
        blocks.append(Table(what + against, shown, [_cells(row)[: len(shown)] for row in rows], (1, 2, 3)))
        blocks += [Text(f"{NOTHING[0].upper()}{NOTHING[1:]}.")] if alone else []
        kinds = {row.kind for row in rows}
        notes = {"predicted": _PREDICTED, **KINDS}
        blocks += [Text(text[0].upper() + text[1:] + ".") for kind, text in notes.items() if kind in kinds]
        blocks += [Text(f"{OF_MEANS}.")] if several and run.summary.comparison else []
        blocks += _assumed(assumed_inputs(run.summary.plain(), rows))
        blocks += error_blocks(run)
        note = unjudged_note(run.summary.plain().get("unjudged"))
        blocks += [Text(note[0].upper() + note[1:] + ".")] if note else []
        blocks += _rest(run)
    else:
        blocks.append(Text("This run left no results.", "warn"))
    blocks += [block for curve in run.comparison.curves for block in _metrics(curve)]
    return Section(f"run-{run.number}-results", "Results and deviations", blocks)


def _cited(row: ComparedRow) -> str:
    """Source of a row without the note on how it was scaled, which stands in the row."""
    return row.source.removesuffix(f", {row.scaled}") if row.scaled else row.source


def _cells(row: ResultRow) -> tuple[Cell, ...]:
    return (
        Cell(row.label), Cell(row.simulated, row.value), Cell(row.experiment),
        Cell(row.deviation, note=row.verdict, tone=_VERDICTS.get(row.verdict, "")),
        Cell(row.kind, note=row.on_assumed),
    )  # fmt: skip


def _rest(run: LoadedRun) -> list[Block]:
    """State of rest that yarns started from, in the middle of the specimen."""
    rest = run.summary.plain().get("rest")
    rows = [(Cell(name), Cell(text)) for name, text in rest_rows(unfolded(rest))] if rest else []
    return [Table("Yarns at rest before the test, middle third of the specimen or the cell", (), rows)] if rows else []


def _assumed(fields: Sequence[str]) -> list[Block]:
    """The inputs that decide the rows and that nobody vouches for."""
    return [Text(f"Assumed inputs that decide these rows: {', '.join(fields)}.", "warn")] if fields else []


def _metrics(curve: Mapping[str, object]) -> list[Block]:
    """One comparison of curves; names of the metrics as comparison.json has them. Large errors stand above it."""
    against = f"{curve.get('judged_against', 'a curve')} ({curve.get('reference_kind', 'kind not stated')})"
    note = f"; {curve['note']}" if curve.get("note") else ""
    if not curve.get("comparable"):
        reason = curve.get("reason", "no reason stated")
        return [Text(f"Curve against {against}{note}: not comparable: {reason}", "warn")]
    errors = [
        *((f"{what} off", curve.get(key), "%") for key, what in ERRORS.items()),
        *_at_angles(curve),
    ]
    found = [*errors, ("root mean square deviation", curve.get("rmse_pct_of_peak"), "% of the peak")]
    rows = [(Cell(name), _number(value, unit)) for name, value, unit in found if value is not None]
    rows.append((Cell("rating after ISO/TS 18571, 0 to 1"), _rating(curve, [value for _, value, _ in errors])))
    table = Table(f"The curve against {against}{note}", ("metric", "value"), rows, (1,))
    far = [f"{name} by {v:+.0f} %" for name, v, _ in errors if isinstance(v, int | float) and abs(v) > FAR_OFF]
    return [Text(f"Curve against {against}: {', '.join(far)}", "bad"), table] if far else [table]


def _rating(curve: Mapping[str, Any], errors: Sequence[Any]) -> Cell:
    """The rating, which stands beside ``errors`` only, or why there is none; also of runs that wrote one before."""
    rating = curve.get("rating")
    reason = UNRATED.get(curve.get("reference_kind", ""), "") or curve.get("no_rating", "")
    if isinstance(rating, Mapping) and not reason and any(isinstance(error, int | float) for error in errors):
        return _number(rating.get("overall"), f"({rating.get('grade', 'no grade')})")
    return Cell(f"not given: {reason or 'there are no errors to stand beside it'}")


def _at_angles(curve: Mapping[str, object]) -> list[tuple[str, Any, str]]:
    """Deviations at the angles of a curve of shear."""
    found = next((value for name, value in curve.items() if name.endswith("_at_deg")), None)
    if not isinstance(found, Mapping):
        return []
    return [(f"force at {a} deg off", f.get("error_pct"), "%") for a, f in found.items() if isinstance(f, Mapping)]


def _number(value: object, unit: str) -> Cell:
    return Cell(f"{value:.4g} {unit}", float(value)) if isinstance(value, int | float) else Cell(f"{value} {unit}")


def _verb(status: str) -> str:
    return {"failed": "failed", "interrupted": "was interrupted"}.get(status, f"ended as {status}")
