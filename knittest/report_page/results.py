"""Section of a report on the results of a run and their deviations; notices on how the run ended."""

import math
from collections.abc import Mapping
from typing import Any

from knittest.base.history import equilibrium_rows, unchecked_peak_note
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
    unfold_results,
)
from knittest.experiment.comparison import ERRORS, UNRATED
from knittest.laboratory.numerical_error import error_notes
from knittest.report_page.blocks import Block, Cell, Section, Table, Text, Tone
from knittest.report_page.files import Number
from knittest.report_page.loaded_run import LoadedRun

ERROR_HEADER = ("quantity", "at half the speed", "on the other mesh", "numerical error")
_VERDICTS: dict[str, Tone] = {
    "within 1 sd": "good", "outside 1 sd": "bad",
    **dict.fromkeys(("not comparable", UNRESOLVED, FEW, UNSCATTERED), "warn"),
}  # fmt: skip
#: error of a peak, a strain or a force at an angle that has a notice above the table [%]
LARGE_ERROR = 10.0
HEADER = ("quantity", "simulated", "experiment", "deviation", "kind")
_PREDICTED = "predicted: no parameter was fitted to this row"


def _sentence(text: str) -> Text:
    return Text(f"{text[0].upper()}{text[1:]}.")


def error_blocks(run: LoadedRun) -> list[Block]:
    """Table of numerical errors, unless the run was not compared, and notes on their estimate."""
    summary = run.summary
    notes = map(_sentence, error_notes(summary.plain(), asked=run.setting("output", "verify") is True))
    if not summary.numerical_error or summary.refused:
        return list(notes)
    rows = []
    for quantity, found in summary.numerical_error.items():
        label, form = LABELS.get(quantity, (quantity.replace("_", " "), "{:.4g}"))
        mesh = found.get("finer_mesh_pct", found.get("coarser_mesh_pct"))
        error = _finite(found.get("error"))
        missing = Cell("not available", note=str(found.get("reason") or ""), tone="warn")
        shown = missing if error is None else Cell(f"± {error_text(error, form)}", error)
        rows.append((Cell(label), _change(found.get("half_speed_pct")), _change(mesh), shown))
    caption = "Numerical error: grid convergence index (Roache, safety factor 3) from half the speed and another mesh"
    return [Table(caption, ERROR_HEADER, rows, (1, 2, 3)), *notes]


def _change(percent: Number | str) -> Cell:
    value = _finite(percent)
    return Cell("-") if value is None else Cell(f"{value:+.2f} %", value)


def _finite(value: Number | str) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None


def rows_of(run: LoadedRun) -> list[ResultRow]:
    """Results of the run as every table shows them."""
    return result_rows(run.summary.plain(), refused=bool(run.summary.refused))


def ending_notices(run: LoadedRun) -> list[Block]:
    """Notices on how the run ended, on warnings and on missing files."""
    manifest, blocks = run.manifest, list[Block]()
    if manifest.status == "running":
        blocks.append(Text("Not finished: the run is in progress or was killed; knittest resume continues it.", "warn"))
    elif manifest.status not in ("", "completed"):
        reason = manifest.message or "no reason was recorded"
        on = "; knittest resume continues it" if manifest.status == "interrupted" else ""
        verb = {"failed": "failed", "interrupted": "was interrupted"}.get(manifest.status, f"is {manifest.status}")
        blocks.append(Text(f"This run {verb}: {reason}{on}. There are no results.", "bad"))
    if run.summary.refused:
        blocks.append(Text("Not compared with the experiment: " + "; ".join(run.summary.refused), "bad"))
    elif manifest.status == "completed":
        blocks.append(Text("The run passed all quality checks.", "good"))
    blocks += [Text(f"Warning: {reason}", "warn") for reason in run.summary.warnings]
    if run.problems:
        blocks.append(Text("Missing or not readable: " + "; ".join(run.problems), "warn"))
    return blocks


def results(run: LoadedRun) -> Section:
    """Section with the results and their deviations, the kind of each row, and the metrics of the curve."""
    rows, plain = rows_of(run), run.summary.plain()
    blocks: list[Block] = []
    if rows:
        count = run.setting("variability", "specimens")
        several = isinstance(count, int) and count > 1
        what = f"Results, mean ± sd of {count} specimens" if several else "Results"
        what += " ± numerical error" if run.summary.numerical_error and not several else ""
        # the scaling of a row stands in the row
        cited = (row.source.removesuffix(f", {row.scaled}") for row in run.summary.comparison if row.source)
        sources = sorted(set(cited))
        against = f", compared with the experiment ({'; '.join(sources)}: mean ± sd)" if sources else ""
        alone = all(row.verdict == NO_REFERENCE and row.kind == "-" for row in rows)
        shown = HEADER[:2] if alone else HEADER
        cells = [_cells(row, refused=bool(run.summary.refused))[: len(shown)] for row in rows]
        blocks.append(Table(what + against, shown, cells, (1, 2, 3)))
        blocks += [_sentence(NOTHING)] if alone else []
        kinds = {row.kind for row in rows}
        blocks += [_sentence(text) for kind, text in {"predicted": _PREDICTED, **KINDS}.items() if kind in kinds]
        blocks += [Text(f"{OF_MEANS}.")] if several and run.summary.comparison else []
        if assumed := assumed_inputs(plain, rows):
            blocks.append(Text(f"Assumed inputs behind these results: {', '.join(assumed)}.", "warn"))
        blocks += error_blocks(run)
        note = unchecked_peak_note(plain.get("unjudged"))
        blocks += [_sentence(note)] if note else []
        relaxed = equilibrium_rows(unfold_results(plain.get("rest") or {}))
        if relaxed:
            caption = "Relaxed fabric before the test, in the middle third of the specimen or in the cell"
            blocks.append(Table(caption, (), [(Cell(name), Cell(text)) for name, text in relaxed]))
    else:
        blocks.append(Text("This run has no results.", "warn"))
    blocks += [block for curve in run.comparison.curves for block in _metrics_blocks(curve)]
    return Section(f"run-{run.number}-results", "Results and deviations", blocks)


def _cells(row: ResultRow, *, refused: bool) -> tuple[Cell, ...]:
    experiment, _, scaled = row.experiment.partition(" (")  # in small print, which wraps
    return (
        Cell(row.label), Cell(row.simulated, row.value), Cell(experiment, note=scaled.removesuffix(")")),
        Cell(row.deviation, note=row.verdict, tone="bad" if refused else _VERDICTS.get(row.verdict, "")),
        Cell(row.kind, note=row.assumed_note),
    )  # fmt: skip


def curve_errors(metrics: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Names and errors [%] of the peak, its strain, levels and forces at angles in the ``metrics`` of a curve."""
    errors = [(what, metrics[key]) for key, what in ERRORS.items() if metrics.get(key) is not None]
    angles = next((value for name, value in metrics.items() if name.endswith("_at_deg")), None)
    for angle, found in angles.items() if isinstance(angles, Mapping) else ():
        if isinstance(found, Mapping) and found.get("error_pct") is not None:
            errors.append((f"force at {angle} deg", found["error_pct"]))
    return errors


def _metrics_blocks(curve: Mapping[str, Any]) -> list[Block]:
    """Comparison of the curve with one reference, with a notice of large errors above it."""
    source = curve.get("compared_with") or curve.get("judged_against", "a curve")  # the latter of an earlier version
    against = f"{source} ({curve.get('reference_kind', 'kind not stated')})"
    note = f"; {curve['note']}" if curve.get("note") else ""
    if not curve.get("comparable"):
        reason = curve.get("reason", "no reason stated")
        return [Text(f"Curve against {against}{note}: not comparable: {reason}", "warn")]
    errors = [(f"error of the {what}", value) for what, value in curve_errors(curve)]
    rows = [(Cell(name), _number(value, "%")) for name, value in errors]
    if (rms := curve.get("rmse_pct_of_peak")) is not None:
        rows.append((Cell("rms error"), _number(rms, "% of the peak")))
    numbers = [(name, value) for name, value in errors if isinstance(value, int | float)]
    rows.append((Cell("rating after ISO/TS 18571, 0 to 1"), _rating_cell(curve, rated=bool(numbers))))
    table = Table(f"Curve compared with {against}{note}", ("metric", "value"), rows, (1,))
    far = [f"{name}: {value:+.0f} %" for name, value in numbers if abs(value) > LARGE_ERROR]
    return [Text(f"Curve compared with {against}: {', '.join(far)}", "bad"), table] if far else [table]


def _rating_cell(curve: Mapping[str, Any], *, rated: bool) -> Cell:
    """Rating of a curve with errors (``rated``), else why there is none; older runs wrote one without errors."""
    rating = curve.get("rating")
    reason = UNRATED.get(curve.get("reference_kind", ""), "") or curve.get("no_rating", "")
    if isinstance(rating, Mapping) and not reason and rated:
        return _number(rating.get("overall"), f"({rating.get('grade', 'no grade')})")
    return Cell(f"not given: {reason or 'there are no errors to support it'}")


def _number(value: object, unit: str) -> Cell:
    return Cell(f"{value:.4g} {unit}", float(value)) if isinstance(value, int | float) else Cell(f"{value} {unit}")
