"""Prints the results of runs: simulated and measured values, the quality checks, and where the files are."""

import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from knittest.base.history import equilibrium_line, unchecked_peak_note
from knittest.base.kinds import kinds
from knittest.base.layout import shorten_path, table, width_of, wrap_line
from knittest.base.result_rows import (
    FEW,
    GIVEN,
    KINDS,
    NO_REFERENCE,
    NOTHING,
    OF_MEANS,
    UNRESOLVED,
    UNSCATTERED,
    ResultRow,
    assumed_inputs,
    result_rows,
    unfold_results,
)
from knittest.config.quality_checks import LOOSER
from knittest.experiment.comparison import ERRORS, UNITS
from knittest.experiment.tables import shear_bands
from knittest.export.files import json_text
from knittest.laboratory.numerical_error import error_notes
from knittest.report_page.folders import HEADER as LISTED
from knittest.report_page.folders import ListedFolder
from knittest.report_page.page import page_of
from knittest.report_page.results import curve_errors

if TYPE_CHECKING:
    from knittest.runs.execute import Outcome

HEADER = ("direction", "quantity", "simulated", "experiment", "deviation", "kind", "verdict")
_NUMBERS = ("simulated", "experiment", "deviation")  # columns aligned to the right
#: columns that are left out where they are empty in all rows
VERDICT = 6
EMPTY = (3, 4, 5, VERDICT)
#: colours of verdicts; any other verdict is red
STYLES = {
    "within 1 sd": "green", **dict.fromkeys((NO_REFERENCE, UNRESOLVED, FEW, UNSCATTERED, GIVEN), "yellow"),
}  # fmt: skip
#: by error of a curve: the part of the metrics that holds both values, and the place of the value in that part
COMPARED_VALUES = {
    "peak_error_pct": ("peak", 1), "fracture_strain_error_pct": ("peak", 0),
    "static_error_pct": ("levels", 0), "kinetic_error_pct": ("levels", 1),
}  # fmt: skip
#: warnings printed without --details, and the words of a passed check near its limit, which --details alone prints
MOST_WARNINGS, PASSED_NEAR = 3, "is more than half of its limit"
#: results that only summary.json shows
_HIDDEN_RESULTS = ("force_per_yarn_n", "peak_force_n_per_mm", "peak_time_error_pct")


def results_table(outcomes: Sequence["Outcome"], plus_minus: str = "±") -> list[tuple[str, ...]]:
    """Rows in the order of :data:`HEADER`, one for each direction, scale and quantity."""
    several = len({outcome.summary.get("scale") for outcome in outcomes}) > 1
    return [
        (
            _run_label(outcome) + f", {outcome.summary.get('scale')}" * several,
            row.label,
            row.simulated,
            row.experiment,
            row.deviation,
            row.kind_text,
            row.verdict,
        )
        for outcome in outcomes
        for row in _result_rows(outcome, plus_minus)
        if row.quantity not in _HIDDEN_RESULTS
    ]


def _result_rows(outcome: "Outcome", plus_minus: str = "±") -> list[ResultRow]:
    return result_rows(outcome.summary, plus_minus, refused=bool(outcome.quality.failures))


def _run_label(outcome: "Outcome") -> str:
    return str(outcome.summary["direction"] or outcome.summary["rig"])


def quality_lines(outcome: "Outcome") -> list[str]:
    """The quality checks of a run in one line, then one line for each failure and warning."""
    quality = outcome.quality
    numbers = (
        ("kinetic energy/work", quality.ke_over_ie_max * 100),
        ("energy error", quality.energy_error_max * 100),
        ("damping/work", quality.damping_over_work_max * 100),
        ("penetration/radius", quality.penetration_over_radius_max * 100),
        ("added mass", quality.added_mass_pct),
    )
    text = ", ".join(f"{name} {value:.2g} %" for name, value in numbers if math.isfinite(value))
    verdict = "FAILED, not compared with the experiment" if quality.failures else "passed"
    if quality.failures and all(LOOSER in reason for reason in quality.failures):
        verdict = "passed with relaxed limits, not compared with the experiment"
    note = unchecked_peak_note(outcome.summary.get("unjudged"))
    return [
        f"quality checks, {_run_label(outcome)}: {verdict} ({text})",
        *_relaxed_limits(outcome),
        *([f"  {note}"] if note else []),
        *(f"  failed: {reason}" for reason in quality.failures),
        *(f"  warning: {reason}" for reason in quality.warnings),
    ]


def _relaxed_limits(outcome: "Outcome") -> list[str]:
    return [
        f"  relaxed limit: {limit['name']} = {limit['value']} (preset {limit['preset']}), "
        f"{'accepted' if limit['accepted'] else 'not accepted'}"
        for limit in outcome.summary.get("limits", [])
    ]


def band_line(outcome: "Outcome") -> str:
    """Bands of the shear force of this fabric over its assumed yarn parameters; empty for a test without shear."""
    bands = shear_bands(outcome.run.fabric.name) if kinds()[outcome.run.rig.kind].shears else []
    ranges = ", ".join(f"{b.low:.2g} to {b.high:.2g} at {b.angle:g} deg" for b in bands)
    return f"shear force [N/mm], 5 to 95 % range over the assumed yarn parameters: {ranges}" if ranges else ""


def error_lines(outcomes: Sequence["Outcome"]) -> list[str]:
    """Lines on how the numerical errors were estimated."""
    return _merge_lines(outcomes, lambda outcome: error_notes(outcome.summary))


def _merge_lines(outcomes: Sequence["Outcome"], lines_of: Callable[["Outcome"], Iterable[str]]) -> list[str]:
    """Lines of each outcome: a line that all have stands once, any other has the name of its run in front."""
    named = [(_run_label(outcome), line) for outcome in outcomes for line in lines_of(outcome)]
    common = {line for _, line in named if sum(line == other for _, other in named) == len(outcomes)}
    lines = [line if len(outcomes) == 1 or line in common else f"{name}: {line}" for name, line in named]
    return list(dict.fromkeys(lines))


def curve_line(metrics: Mapping[str, Any]) -> str:
    """Comparison of two curves in one line: the reference, its scaling, the errors, and the rating."""
    if not metrics["comparable"]:
        return f"{_reference_text(metrics)}: not comparable: {metrics['reason']}"
    errors = [f"{what} {value:+.1f} %" for what, value in curve_errors(metrics)]
    errors.append(f"rms error {metrics['rmse_pct_of_peak']:.1f} % of the peak")
    return f"{_reference_text(metrics)}: {', '.join([*errors, _rating_text(metrics)])}"


def curve_table(metrics: Mapping[str, Any], width: int | None = None) -> list[str]:
    """The same as a table of both curves within ``width``, between the reference and the rating."""
    if not metrics["comparable"]:
        return [curve_line(metrics)]
    covered = next(name for name in metrics if name.startswith("range_"))
    low, high = metrics[covered]
    unit = UNITS.get(covered.removeprefix("range_"), "mm")
    rms = (f"rms error, {low:.4g} to {high:.4g} {unit}", "", "", f"{metrics['rmse_pct_of_peak']:.1f} % of peak")
    rows = [("quantity", "run", "reference", "error"), *_compared_values(metrics), rms]
    lines = [line for row in table(rows, width, right=(1, 2, 3)) for line in row]
    return [_reference_text(metrics), "", *lines, "", _rating_text(metrics)]


def _compared_values(metrics: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row for each quantity that both curves have: peaks, levels, or forces at angles."""
    for key, (part, k) in COMPARED_VALUES.items():
        if metrics.get(key) is not None:
            (name, one), (_, other) = (list(metrics[f"{who}_{part}"].items())[k] for who in ("simulated", "reference"))
            yield f"{ERRORS[key]} [{UNITS.get(name, 'N')}]", f"{one:.4g}", f"{other:.4g}", f"{metrics[key]:+.1f} %"
    for name, values in metrics.items():
        for angle, found in values.items() if name.endswith("_at_deg") else ():
            error = "-" if found["error_pct"] is None else f"{found['error_pct']:+.1f} %"
            unit = UNITS.get(name.removesuffix("_at_deg"), "N")
            yield f"force at {angle} deg [{unit}]", f"{found['simulated']:.4g}", f"{found['reference']:.4g}", error


def _reference_text(metrics: Mapping[str, object]) -> str:
    note = f"; {metrics['note']}" if metrics.get("note") else ""
    return f"against {metrics['compared_with']} ({metrics['reference_kind']}{note})"


def _rating_text(metrics: Mapping[str, Any]) -> str:
    rating = metrics["rating"]
    return f"rating {rating['overall']:.2f} ({rating['grade']})" if rating else f"no rating: {metrics['no_rating']}"


def print_results(
    outcomes: Sequence["Outcome"], stream: TextIO | None = None, details: bool = True, *, explained: bool = False
) -> None:
    """Print table, checks, folder and report, which may be ``explained``, on ``stream`` (standard output), with
    ``details`` all notes.
    """
    stream = stream or sys.stdout
    with _ignore_broken_pipe(stream):
        rows, width = results_table(outcomes, "±" if _can_encode("±", stream) else "+-"), width_of(stream)
        columns = _filled_columns(rows)
        for lines, styled in _tables([tuple(row[k] for k in columns) for row in [HEADER, *rows]], width):
            if stream.isatty() and VERDICT in columns:
                _print_coloured(lines, styled, stream)
            else:
                stream.write("\n".join(line for row in lines for line in row) + "\n")
        below = _detail_lines(outcomes, rows) if details else _brief_lines(outcomes, explained)
        stream.write("\n".join(["", *(part for line in below for part in wrap_line(line, width))]) + "\n")
        stream.flush()


def print_rejected(outcomes: Sequence["Outcome"], stream: TextIO | None = None) -> None:
    """Print on ``stream`` (standard error) why runs were not compared; for --quiet, which prints no table."""
    failed = [outcome for outcome in outcomes if outcome.quality.failures]
    print_text(
        (f"knittest: {shorten_path(o.folder)}: not compared with the experiment: {'; '.join(o.quality.failures)}"
         for o in failed),
        stream or sys.stderr,
    )  # fmt: skip


def open_page(page: Path) -> None:
    """Open ``page`` in a browser, or print on standard error that there is none."""
    import webbrowser

    if not webbrowser.open(page.resolve().as_uri()):
        print_text([f"knittest: no browser was found to open {shorten_path(page)}"], sys.stderr)


def print_runs(runs: Sequence[ListedFolder], folder: Path, stream: TextIO | None = None) -> None:
    """Print a list of runs, whose paths are seen from ``folder``, with their number and size."""
    stream = stream or sys.stdout
    if runs:
        rows = [LISTED, *(one.row(folder) for one in runs)]
        keep = [k for k in range(len(LISTED)) if any(row[k] for row in rows[1:])]
        lines = table([[row[k] for k in keep] for row in rows], width_of(stream), right=(keep.index(5),))
        print_text((line for row in lines for line in row), stream)
    size = sum(one.bytes for one in runs) / 1e6
    print_text([f"{len(runs)} run{'s' * (len(runs) != 1)}, {size:.1f} MB"], stream)


def print_json(payload: Mapping[str, object], stream: TextIO | None = None) -> None:
    """Print one JSON object on ``stream`` (standard output); NaN becomes null, a closed pipe is harmless."""
    stream = stream or sys.stdout
    with _ignore_broken_pipe(stream):
        stream.write(json_text(payload))
        stream.flush()


def print_text(lines: Iterable[str], stream: TextIO | None = None) -> None:
    """Print ``lines`` on ``stream`` (standard output), wrapped on a terminal, with +- where it cannot show ±."""
    stream = stream or sys.stdout
    text = "".join(f"{part}\n" for line in lines for part in wrap_line(line, width_of(stream)))
    with _ignore_broken_pipe(stream):
        stream.write(text if _can_encode("±", stream) else text.replace("±", "+-"))
        stream.flush()


def _brief_lines(outcomes: Sequence["Outcome"], explained: bool) -> list[str]:
    """The checks, at most :data:`MOST_WARNINGS` warnings, the run folder and the report."""
    lines = [curve_line(metrics) for outcome in outcomes for metrics in outcome.curves]
    failed = [outcome for outcome in outcomes if outcome.quality.failures]
    if not failed:
        where = "the report explains them" if explained else "--details shows their numbers, assumptions and notes"
        lines.append(f"quality checks: passed; {where}")
    for outcome in failed:
        lines.append(f"quality checks, {_run_label(outcome)}: FAILED, not compared with the experiment")
        lines += [f"  {reason}" for reason in outcome.quality.failures]
    lines += [line for outcome in outcomes for line in _relaxed_limits(outcome)]
    warnings = _merge_lines(outcomes, lambda outcome: [w for w in outcome.quality.warnings if PASSED_NEAR not in w])
    lines += [f"warning: {text}" for text in warnings[:MOST_WARNINGS]]
    more = len(warnings) - MOST_WARNINGS
    if more > 0:
        lines.append(f"{more} more warning{'s' * (more > 1)} in the report, or with --details")
    folders = [outcome.folder for outcome in outcomes]
    lines.append(f"run folder: {shorten_path(folders[0] if len(folders) == 1 else folders[0].parent)}")
    return lines + _report_lines(outcomes)


def _report_lines(outcomes: Sequence["Outcome"]) -> list[str]:
    pages = [page for outcome in outcomes if (page := page_of(outcome.folder))]
    return list(dict.fromkeys(f"report: {shorten_path(page)}" for page in pages))


def _detail_lines(outcomes: Sequence["Outcome"], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """All notes: kinds, assumptions, numerical errors, relaxed fabric, checks, folders, report."""
    kinds_shown = {row[HEADER.index("kind")] for row in rows}
    lines = [text for kind, text in KINDS.items() if kind in kinds_shown]
    lines += [] if VERDICT in _filled_columns(rows) else [NOTHING]
    lines += [OF_MEANS] if any(o.run.variability.specimens > 1 and o.summary["comparison"] for o in outcomes) else []
    for outcome in outcomes:
        if fields := assumed_inputs(outcome.summary, _result_rows(outcome)):
            lines.append(f"assumed inputs behind these results, {_run_label(outcome)}: {', '.join(fields)}")
    lines += dict.fromkeys(line for outcome in outcomes if (line := band_line(outcome)))
    lines += error_lines(outcomes)
    for outcome in outcomes:
        if rest := outcome.summary.get("rest"):
            lines.append(f"relaxed fabric, {_run_label(outcome)}: {equilibrium_line(unfold_results(rest))}")
    for outcome in outcomes:
        lines += [*map(curve_line, outcome.curves), *quality_lines(outcome)]
    return [*lines, *(f"run folder: {shorten_path(outcome.folder)}" for outcome in outcomes), *_report_lines(outcomes)]


def _filled_columns(rows: Sequence[tuple[str, ...]]) -> list[int]:
    """Columns of :data:`HEADER` that are not empty, or without a reference, in all of ``rows``."""
    empty = {VERDICT: NO_REFERENCE}
    return [k for k in range(len(HEADER)) if k < min(EMPTY) or any(row[k] != empty.get(k, "-") for row in rows)]


def _tables(
    rows: Sequence[tuple[str, ...]], width: int | None
) -> Iterator[tuple[list[list[str]], Sequence[tuple[str, ...]]]]:
    """Lines of the table of ``rows`` (a head and results) with the results; beyond ``width`` a table for each run."""
    header, rows = rows[0], rows[1:]
    names = list(dict.fromkeys(row[0] for row in rows))
    right = [column for column, name in enumerate(header) if name in _NUMBERS]
    whole = table([header, *rows], None, right)
    if width is None or (len(names) > 1 and max(len(line) for row in whole for line in row) <= width):
        yield whole, rows
        return
    for name in names:
        own = [row for row in rows if row[0] == name]
        head = (f"{name}: {header[1]}" if len(names) > 1 else header[1], *header[2:])
        yield table([head, *(row[1:] for row in own)], width, [column - 1 for column in right]), own


def _print_coloured(table_lines: Sequence[Sequence[str]], rows: Sequence[tuple[str, ...]], stream: TextIO) -> None:
    from rich.console import Console
    from rich.text import Text

    console = Console(file=stream, highlight=False, markup=False)
    start = table_lines[0][0].rindex(HEADER[VERDICT])
    styles = ["bold", *(STYLES.get(row[-1], "red") for row in rows)]
    for lines, style in zip(table_lines, styles, strict=True):
        for line in lines:
            text = Text(line, style="bold" if lines is table_lines[0] else "")
            text.stylize(style, start)
            console.print(text, soft_wrap=True)


def _can_encode(text: str, stream: TextIO) -> bool:
    try:
        text.encode(getattr(stream, "encoding", None) or "utf-8")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


@contextmanager
def _ignore_broken_pipe(stream: TextIO) -> Iterator[None]:
    """Ignore a broken pipe and point the stream at nothing, so that the interpreter's last flush works as well."""
    try:
        yield
    except BrokenPipeError:
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)
