"""The table a user sees at the end: simulated beside measured, the quality gates, and where the files are."""

import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TextIO

from knittest.export.jsonfile import json_text
from knittest.history import Quality

if TYPE_CHECKING:
    from rich.console import Console

HEADER = ("direction", "quantity", "simulated", "experiment", "deviation", "kind", "verdict")
#: label and format of a result; an empty label leaves it to summary.json
_QUANTITIES = {
    "peak_force_n": ("peak force [N]", "{:.0f}"),
    "fracture_strain_pct": ("fracture strain [%]", "{:.2f}"),
    "force_per_yarn_n": ("", ""),
    "pull_force_kinetic_n": ("pull force, kinetic [N]", "{:.1f}"),
    "pull_force_static_n": ("pull force, largest [N]", "{:.1f}"),
    "mu_paper": ("F_R/F_N, two faces [-]", "{:.4f}"),
    "mu_per_face": ("F_R/(2 F_N), a face [-]", "{:.4f}"),
    "normal_force_n": ("normal force [N]", "{:.1f}"),
    "normal_force_error_pct": ("largest normal force error [%]", "{:.2f}"),
    "compression_mm": ("plates closed by [mm]", "{:.3f}"),
    "chord_angle_deg": ("chord angle [deg]", "{:.2f}"),
    "overhang_mm": ("overhang [mm]", "{:.1f}"),
    "bending_stiffness_mncm2": ("B by Eq. 2, 50 mm strip [mN cm2]", "{:.0f}"),
    "bending_stiffness_n_mm_per_width": ("B, root moment/curvature [N mm]", "{:.2f}"),
    "moment_error_pct": ("root moment off weight [%]", "{:.2f}"),
    "shear_force_n_at_10deg": ("shear force at 10 deg [N]", "{:.2f}"),
    "shear_force_n_at_20deg": ("shear force at 20 deg [N]", "{:.2f}"),
    "shear_force_n_at_30deg": ("shear force at 30 deg [N]", "{:.2f}"),
    "shear_force_n_at_40deg": ("shear force at 40 deg [N]", "{:.2f}"),
    "wrinkle_onset_deg": ("wrinkle onset [deg]", "{:.1f}"),
    "wrinkle_amplitude_mm_at_40deg": ("wrinkle amplitude at 40 deg [mm]", "{:.2f}"),
    "wrinkle_count_at_40deg": ("wrinkles at 40 deg", "{:.0f}"),
}
_NUMBERS = (2, 3, 4)  # columns aligned to the right
_KINDS = {
    "tuned": "tuned: a parameter was fitted to this row, which therefore proves nothing by itself",
    "input": "input: the model was given this row and returns it",
}


class Outcome(Protocol):
    """One finished run: its ``summary.json``, its gates with their reasons, and its folder."""

    @property
    def summary(self) -> Mapping[str, Any]:
        """What ``summary.json`` holds."""

    @property
    def quality(self) -> Quality:
        """The gates of its worst specimen."""

    @property
    def folder(self) -> Path:
        """Where its files are."""


def results_table(outcomes: Sequence[Outcome], plus_minus: str = "±") -> list[tuple[str, ...]]:
    """Rows in the order of :data:`HEADER`, one a direction and quantity; nothing is left to colour."""
    rows: list[tuple[str, ...]] = []
    for outcome in outcomes:
        compared = {row["quantity"]: row for row in outcome.summary["comparison"]}
        for quantity, value in outcome.summary["results"].items():
            label, form = _QUANTITIES.get(quantity, (quantity.replace("_", " "), "{:.4g}"))
            if label:
                tail = _judged(compared.get(quantity), form, plus_minus, refused=bool(outcome.quality.failures))
                rows.append((_name(outcome), label, _simulated(value, form, plus_minus), *tail))
    return rows


def _name(outcome: Outcome) -> str:
    """Direction of a strip, else the test."""
    return str(outcome.summary["direction"] or outcome.summary["rig"])


def quality_lines(outcome: Outcome) -> list[str]:
    """The gates of a run in one line, then one line a failure or warning."""
    quality = outcome.quality
    numbers = (
        ("kinetic energy/work", quality.ke_over_ie_max * 100),
        ("energy error", quality.energy_error_max * 100),
        ("penetration/radius", quality.penetration_over_radius_max * 100),
        ("added mass", quality.added_mass_pct),
    )
    text = ", ".join(f"{name} {value:.2g} %" for name, value in numbers if math.isfinite(value))
    verdict = "FAILED, comparison refused" if quality.failures else "passed"
    lines = [f"quality gates, {_name(outcome)}: {verdict} ({text})"]
    lines += [f"  failed: {reason}" for reason in quality.failures]
    return lines + [f"  warning: {reason}" for reason in quality.warnings]


def print_results(outcomes: Sequence[Outcome], stream: TextIO | None = None) -> None:
    """Print table, notes, gates and run folders on ``stream`` (standard output); a closed pipe is harmless."""
    stream = stream or sys.stdout
    with _pipe_may_close(stream):
        _print(outcomes, stream)
        stream.flush()


def print_refused(outcomes: Sequence[Outcome], stream: TextIO | None = None) -> None:
    """Say on ``stream`` (standard error) why a run was refused; for a quiet user, who sees no table."""
    stream = stream or sys.stderr
    with _pipe_may_close(stream):
        for outcome in outcomes:
            if outcome.quality.failures:
                reasons = "; ".join(outcome.quality.failures)
                stream.write(f"knittest: {outcome.folder}: comparison refused: {reasons}\n")
        stream.flush()


def print_json(payload: Mapping[str, Any], stream: TextIO | None = None) -> None:
    """Print one JSON object on ``stream`` (standard output); NaN becomes null, a closed pipe is harmless."""
    stream = stream or sys.stdout
    with _pipe_may_close(stream):
        stream.write(json_text(payload))
        stream.flush()


def _print(outcomes: Sequence[Outcome], stream: TextIO) -> None:
    rows = results_table(outcomes, "±" if _can_encode("±", stream) else "+-")
    kinds = {row[HEADER.index("kind")] for row in rows}
    notes = [text for kind, text in _KINDS.items() if kind in kinds]
    lines = [*notes, *(line for outcome in outcomes for line in quality_lines(outcome))]
    lines += [f"run folder: {outcome.folder}" for outcome in outcomes]
    if stream.isatty():
        from rich.console import Console

        console = Console(file=stream, highlight=False, markup=False)
        _rich_table(console, rows)
        for line in lines:
            console.print(line, soft_wrap=True)
    else:
        stream.write("\n".join([*aligned([HEADER, *rows]), "", *lines]) + "\n")


def aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Rows as lines of aligned columns, numbers to the right."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join(
            cell.rjust(width) if column in _NUMBERS else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _rich_table(console: "Console", rows: Sequence[tuple[str, ...]]) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD)
    for column, name in enumerate(HEADER):
        table.add_column(name, justify="right" if column in _NUMBERS else "left")
    for row in rows:
        style = "green" if row[-1].startswith("within") else "yellow" if row[-1] == "no reference" else "red"
        table.add_row(*(Text(cell) for cell in row[:-1]), Text(row[-1], style=style))
    console.print(table)


def _simulated(value: Any, form: str, plus_minus: str) -> str:
    """A number, or mean, sd and count of an ensemble."""
    if isinstance(value, Mapping):
        mean, sd = _number(value["mean"], form), _number(value["sd"], form)
        return f"{mean} {plus_minus} {sd} (n {len(value['values'])})"
    return _number(value, form)


def _judged(row: Mapping[str, Any] | None, form: str, plus_minus: str, *, refused: bool) -> tuple[str, str, str, str]:
    """Experiment, deviation, kind and verdict of one row."""
    if refused:
        return "-", "-", "-", "refused"
    if row is None:
        return "-", "-", "-", "no reference"
    experiment = f"{_number(row['experiment_mean'], form)} {plus_minus} {_number(row['experiment_sd'], form)}"
    deviation = row["deviation_sd"]
    if deviation is None or not math.isfinite(deviation):
        return experiment, "-", row["kind"], "not comparable"
    verdict = "within 1 sd" if abs(deviation) <= 1.0 else "outside 1 sd"
    return experiment, f"{deviation:+.2f} sd", row["kind"], verdict


def _number(value: float | None, form: str) -> str:
    return form.format(value) if value is not None and math.isfinite(value) else "-"


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
