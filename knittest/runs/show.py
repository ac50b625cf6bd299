"""The table a user sees at the end: simulated beside measured, the quality gates, and where the files are."""

import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Protocol, TextIO

from knittest.base.history import Quality, rest_line, unjudged_note
from knittest.base.kinds import kinds
from knittest.base.layout import nearest, table, width_of, wrapped
from knittest.base.result_rows import (
    FEW,
    GIVEN,
    KINDS,
    NO_REFERENCE,
    NOTHING,
    OF_MEANS,
    UNRESOLVED,
    UNSCATTERED,
    assumed_inputs,
    result_rows,
    unfolded,
)
from knittest.base.summary import Limit, Summary
from knittest.config.gates import LOOSER
from knittest.config.run import Run
from knittest.experiment.compare import ERRORS, UNITS
from knittest.experiment.tables import shear_bands
from knittest.export.files import json_text
from knittest.laboratory.numerical_error import error_notes
from knittest.report_page.folders import HEADER as LISTED
from knittest.report_page.folders import Listed
from knittest.report_page.page import page_of

HEADER = ("direction", "quantity", "simulated", "experiment", "deviation", "kind", "verdict")
_NUMBERS = ("simulated", "experiment", "deviation")  # columns aligned to the right
#: columns that are left out where they say nothing
VERDICT = 6
EMPTY = (3, 4, 5, VERDICT)
#: colours of verdicts; of any other red
STYLES = {
    "within 1 sd": "green",
    NO_REFERENCE: "yellow",
    UNRESOLVED: "yellow",
    FEW: "yellow",
    UNSCATTERED: "yellow",
    GIVEN: "yellow",
}
#: part of the metrics of curves, and the place in it, that each of their errors is of
COMPARED = {
    "peak_error_pct": ("peak", 1), "fracture_strain_error_pct": ("peak", 0),
    "static_error_pct": ("levels", 0), "kinetic_error_pct": ("levels", 1),
}  # fmt: skip
#: most warnings below the table, and the words of those that ask for nothing
MOST_WARNINGS, PASSED_NEAR = 3, "is more than half of its limit"
#: results that only summary.json shows
_LEFT_OUT = ("force_per_yarn_n", "peak_force_n_per_mm", "peak_time_error_pct")


class Outcome(Protocol):
    """One finished run: its ``summary.json``, its gates with their reasons, and its folder."""

    @property
    def run(self) -> Run:
        """Config of it."""

    @property
    def summary(self) -> Summary:
        """Contents of ``summary.json``."""

    @property
    def quality(self) -> Quality:
        """The gates of its worst specimen."""

    @property
    def curves(self) -> Sequence[Mapping[str, object]]:
        """Metrics against the user's own curves."""

    @property
    def folder(self) -> Path:
        """Folder of its files."""


def results_table(outcomes: Sequence[Outcome], plus_minus: str = "±") -> list[tuple[str, ...]]:
    """Rows in the order of :data:`HEADER`, one a direction and quantity; nothing is left to colour."""
    return [
        (_name(outcome), row.label, row.simulated, row.experiment, row.deviation, row.kind_told, row.verdict)
        for outcome in outcomes
        for row in result_rows(outcome.summary, plus_minus, refused=bool(outcome.quality.failures))
        if row.quantity not in _LEFT_OUT
    ]


def _name(outcome: Outcome) -> str:
    """Direction of a strip, else the test."""
    return str(outcome.summary["direction"] or outcome.summary["rig"])


def quality_lines(outcome: Outcome) -> list[str]:
    """The gates of a run in one line, then one line a failure or warning."""
    quality = outcome.quality
    numbers = (
        ("kinetic energy/work", quality.ke_over_ie_max * 100),
        ("energy error", quality.energy_error_max * 100),
        ("damping/work", quality.damping_over_work_max * 100),
        ("penetration/radius", quality.penetration_over_radius_max * 100),
        ("added mass", quality.added_mass_pct),
    )
    text = ", ".join(f"{name} {value:.2g} %" for name, value in numbers if math.isfinite(value))
    loosened = [reason for reason in quality.failures if LOOSER in reason]
    verdict = "FAILED, comparison refused" if quality.failures else "passed"
    if loosened and len(loosened) == len(quality.failures):
        verdict = "passed as loosened; comparison refused: limit loosened"
    lines = [f"quality gates, {_name(outcome)}: {verdict} ({text})"]
    lines += [f"  {_looser(limit)}" for limit in outcome.summary.get("limits", [])]
    lines += [f"  {note}" for note in [unjudged_note(outcome.summary.get("unjudged"))] if note]
    lines += [f"  failed: {reason}" for reason in quality.failures]
    return lines + [f"  warning: {reason}" for reason in quality.warnings]


def assumed_line(outcome: Outcome) -> str:
    """The assumed inputs that decide the compared rows of a run, empty if there are none."""
    rows = result_rows(outcome.summary, refused=bool(outcome.quality.failures))
    fields = assumed_inputs(outcome.summary, rows)
    return f"assumed inputs that decide these rows, {_name(outcome)}: {', '.join(fields)}" if fields else ""


def band_line(outcome: Outcome) -> str:
    """Bands of the shear of this fabric over the prior of what nobody measured, where the test shears it."""
    run = outcome.run
    bands = shear_bands(run.fabric.name) if kinds()[run.rig.kind].shears else []
    told = ", ".join(f"{b.low:.2g} to {b.high:.2g} at {b.angle:g} deg" for b in bands)
    return f"shear of this fabric over what is assumed of its yarns, 5 to 95 % [N/mm]: {told}" if told else ""


def _of_means(outcome: Outcome) -> bool:
    """Tell whether means of several specimens were compared."""
    return outcome.run.variability.specimens > 1 and bool(outcome.summary["comparison"])


def rest_told(outcome: Outcome) -> str:
    """The state of rest that yarns started from, in a line short enough for a terminal; empty of shells."""
    numbers = outcome.summary.get("rest")
    return f"yarns at rest, {_name(outcome)}: {rest_line(unfolded(numbers))}" if numbers else ""


def error_lines(outcomes: Sequence[Outcome]) -> list[str]:
    """Lines on how the numerical errors were found."""
    return _each_once(outcomes, lambda outcome: error_notes(outcome.summary))


def _each_once(outcomes: Sequence[Outcome], of: Callable[[Outcome], Iterable[str]]) -> list[str]:
    """Lines ``of`` each outcome, those that all have once, others with the name of the run where there are several."""
    told = [(_name(outcome), line) for outcome in outcomes for line in of(outcome)]
    common = {line for _, line in told if sum(line == other for _, other in told) == len(outcomes)}
    lines = [line if len(outcomes) == 1 or line in common else f"{name}: {line}" for name, line in told]
    return list(dict.fromkeys(lines))


def _looser(limit: Limit) -> str:
    taken = "accepted" if limit["accepted"] else "not accepted"
    return f"looser than the preset: {limit['name']} = {limit['value']}, preset {limit['preset']}; {taken}"


def curve_lines(outcome: Outcome) -> list[str]:
    """Metrics of the user's own curves in comparison.json, one line a curve."""
    return [curve_line(metrics) for metrics in outcome.curves]


def curve_line(metrics: Mapping[str, object]) -> str:
    """A comparison of curves: against what, how it was scaled, its errors, and the rating or why there is none."""
    return f"{_reference(metrics)}: {_metrics(metrics)}"


def curve_table(metrics: Mapping[str, Any], width: int | None = None) -> list[str]:
    """The same as a table of both curves, within ``width``, below what it is against and above the rating."""
    if not metrics["comparable"]:
        return [curve_line(metrics)]
    rows = [("quantity", "run", "reference", "error"), *_both(metrics), _rmse(metrics)]
    lines = [line for row in table(rows, width, right=(1, 2, 3)) for line in row]
    return [_reference(metrics), "", *lines, "", _rating(metrics)]


def _both(metrics: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """A row a quantity that both curves have: peaks, levels, or forces at angles."""
    for key, (part, k) in COMPARED.items():
        if metrics.get(key) is not None:
            (name, one), (_, other) = (list(metrics[f"{who}_{part}"].items())[k] for who in ("simulated", "reference"))
            yield f"{ERRORS[key]} [{UNITS.get(name, 'N')}]", f"{one:.4g}", f"{other:.4g}", f"{metrics[key]:+.1f} %"
    for name, values in metrics.items():
        for angle, found in values.items() if name.endswith("_at_deg") else ():
            error = "-" if found["error_pct"] is None else f"{found['error_pct']:+.1f} %"
            unit = UNITS.get(name.removesuffix("_at_deg"), "N")
            yield f"force at {angle} deg [{unit}]", f"{found['simulated']:.4g}", f"{found['reference']:.4g}", error


def _rmse(metrics: Mapping[str, Any]) -> tuple[str, ...]:
    covered = next(name for name in metrics if name.startswith("range_"))
    low, high = metrics[covered]
    unit = UNITS.get(covered.removeprefix("range_"), "mm")
    return f"rms error, {low:.4g} to {high:.4g} {unit}", "", "", f"{metrics['rmse_pct_of_peak']:.1f} % of peak"


def _reference(metrics: Mapping[str, object]) -> str:
    note = f"; {metrics['note']}" if metrics.get("note") else ""
    return f"against {metrics['judged_against']} ({metrics['reference_kind']}{note})"


def _rating(metrics: Mapping[str, Any]) -> str:
    rating = metrics["rating"]
    return f"rating {rating['overall']:.2f} ({rating['grade']})" if rating else f"no rating: {metrics['no_rating']}"


def _metrics(metrics: Mapping[str, Any]) -> str:
    if not metrics["comparable"]:
        return f"not comparable: {metrics['reason']}"
    angles = next((value for name, value in metrics.items() if name.endswith("_at_deg")), None)
    if angles is None:
        errors = ((what, metrics[key]) for key, what in ERRORS.items() if metrics.get(key) is not None)
        found = [f"{what} {value:+.1f} %" for what, value in errors]
    else:
        found = [f"{a['error_pct']:+.0f} % at {d} deg" for d, a in angles.items() if a["error_pct"] is not None]
    found.append(f"rmse {metrics['rmse_pct_of_peak']:.1f} % of its peak")
    return ", ".join([*found, _rating(metrics)])


def print_results(outcomes: Sequence[Outcome], stream: TextIO | None = None, details: bool = True) -> None:
    """Print table, checks, run folder and report on ``stream`` (standard output), and all notes if ``details`` are
    wanted; a closed pipe is harmless.
    """
    stream = stream or sys.stdout
    with _pipe_may_close(stream):
        _print(outcomes, stream, details)
        stream.flush()


def print_refused(outcomes: Sequence[Outcome], stream: TextIO | None = None) -> None:
    """Say on ``stream`` (standard error) why a run was refused; for a quiet user, who sees no table."""
    stream = stream or sys.stderr
    with _pipe_may_close(stream):
        for outcome in outcomes:
            if outcome.quality.failures:
                reasons = "; ".join(outcome.quality.failures)
                line = f"knittest: {nearest(outcome.folder)}: comparison refused: {reasons}"
                stream.write("\n".join(wrapped(line, width_of(stream))) + "\n")
        stream.flush()


def open_page(page: Path) -> None:
    """Open ``page`` in a browser, or say on standard error that there is none."""
    import webbrowser

    if not webbrowser.open(page.resolve().as_uri()):
        print_text([f"knittest: no browser was found to open {nearest(page)}"], sys.stderr)


def print_runs(runs: Sequence[Listed], folder: Path, stream: TextIO | None = None) -> None:
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
    with _pipe_may_close(stream):
        stream.write(json_text(payload))
        stream.flush()


def print_text(lines: Iterable[str], stream: TextIO | None = None) -> None:
    """Print ``lines`` on ``stream`` (standard output), wrapped on a terminal; it need not know the sign ±, and a closed
    pipe is harmless.
    """
    stream = stream or sys.stdout
    text = "".join(f"{part}\n" for line in lines for part in wrapped(line, width_of(stream)))
    with _pipe_may_close(stream):
        stream.write(text if _can_encode("±", stream) else text.replace("±", "+-"))
        stream.flush()


def _print(outcomes: Sequence[Outcome], stream: TextIO, details: bool) -> None:
    rows, width = results_table(outcomes, "±" if _can_encode("±", stream) else "+-"), width_of(stream)
    shown = _saying(rows)
    lines = _detailed(outcomes, rows) if details else _brief(outcomes)
    for told, styled in _tables([tuple(row[k] for k in shown) for row in [HEADER, *rows]], width):
        if stream.isatty() and VERDICT in shown:
            _print_coloured(told, styled, stream)
        else:
            stream.write("\n".join(line for row in told for line in row) + "\n")
    stream.write("\n".join(["", *(part for line in lines for part in wrapped(line, width))]) + "\n")


def _brief(outcomes: Sequence[Outcome]) -> list[str]:
    """The checks, at most :data:`MOST_WARNINGS` warnings that ask for something, the folder and the report."""
    lines = [line for outcome in outcomes for line in curve_lines(outcome)]
    failed = [outcome for outcome in outcomes if outcome.quality.failures]
    if not failed:
        lines.append("quality checks: passed; --details shows their numbers, assumptions and notes")
    for outcome in failed:
        lines.append(f"quality checks, {_name(outcome)}: FAILED, comparison refused")
        lines += [f"  {reason}" for reason in outcome.quality.failures]
    lines += [f"  {_looser(limit)}" for outcome in outcomes for limit in outcome.summary.get("limits", [])]
    warnings = _each_once(outcomes, lambda outcome: [w for w in outcome.quality.warnings if PASSED_NEAR not in w])
    lines += [f"warning: {text}" for text in warnings[:MOST_WARNINGS]]
    left = len(warnings) - MOST_WARNINGS
    if left > 0:
        lines.append(f"{left} more warning{'s' * (left > 1)}: --details or the report")
    folders = [outcome.folder for outcome in outcomes]
    lines.append(f"run folder: {nearest(folders[0] if len(folders) == 1 else folders[0].parent)}")
    pages = (page_of(folder) for folder in folders)
    return [*lines, *dict.fromkeys(f"report: {nearest(page)}" for page in pages if page)]


def _detailed(outcomes: Sequence[Outcome], rows: Sequence[tuple[str, ...]]) -> list[str]:
    """All that is known of the rows: kinds, assumptions, numerical errors, state of rest, checks, folders, report."""
    kinds, shown = {row[HEADER.index("kind")] for row in rows}, _saying(rows)
    notes = [text for kind, text in KINDS.items() if kind in kinds] + ([] if VERDICT in shown else [NOTHING])
    notes += [OF_MEANS] if any(_of_means(outcome) for outcome in outcomes) else []
    notes += [line for outcome in outcomes if (line := assumed_line(outcome))]
    notes += dict.fromkeys(line for outcome in outcomes if (line := band_line(outcome)))
    lines = [*notes, *error_lines(outcomes), *(line for outcome in outcomes if (line := rest_told(outcome)))]
    lines += [line for outcome in outcomes for line in (*curve_lines(outcome), *quality_lines(outcome))]
    lines += [f"run folder: {nearest(outcome.folder)}" for outcome in outcomes]
    pages = (page_of(outcome.folder) for outcome in outcomes)
    lines += dict.fromkeys(f"report: {nearest(page)}" for page in pages if page)
    return lines


def _saying(rows: Sequence[tuple[str, ...]]) -> list[int]:
    """Columns of :data:`HEADER` that say something of ``rows``: not that there is nothing, or no reference, in each."""
    empty = {VERDICT: NO_REFERENCE}
    return [k for k in range(len(HEADER)) if k < min(EMPTY) or any(row[k] != empty.get(k, "-") for row in rows)]


def _tables(
    rows: Sequence[tuple[str, ...]], width: int | None
) -> Iterator[tuple[list[list[str]], Sequence[tuple[str, ...]]]]:
    """Lines of the table of ``rows``, a head and results, with the results; within a ``width`` a table of its own for
    each run unless all fit one.
    """
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


def _print_coloured(told: Sequence[Sequence[str]], rows: Sequence[tuple[str, ...]], stream: TextIO) -> None:
    """Print the lines of a head and of each of ``rows``, the verdict in its colour."""
    from rich.console import Console
    from rich.text import Text

    console = Console(file=stream, highlight=False, markup=False)
    start = told[0][0].rindex(HEADER[VERDICT])
    styles = ["bold", *(STYLES.get(row[-1], "red") for row in rows)]
    for lines, style in zip(told, styles, strict=True):
        for line in lines:
            text = Text(line, style="bold" if lines is told[0] else "")
            text.stylize(style, start)
            console.print(text, soft_wrap=True)


def _can_encode(text: str, stream: TextIO) -> bool:
    try:
        text.encode(getattr(stream, "encoding", None) or "utf-8")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


@contextmanager
def _pipe_may_close(stream: TextIO) -> Iterator[None]:
    """Swallow a broken pipe and point the stream at nothing, so that the interpreter's last flush works as well."""
    try:
        yield
    except BrokenPipeError:
        with suppress(OSError, ValueError):
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, stream.fileno())
            os.close(null)
