"""Sections of a report on several runs: overview, results side by side, curves in one picture, differences."""

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from pathlib import Path

from knittest.base.figure import save
from knittest.base.result_rows import SIZED, ResultRow
from knittest.report_page.blocks import Block, Cell, Gallery, Picture, Section, Table, Text, Tone
from knittest.report_page.curves import overlay_blocks, overlay_figure, sizes_differ
from knittest.report_page.loaded_run import LoadedRun
from knittest.report_page.parameters import (
    format_quantity,
    format_value,
    plain_settings,
    quantities_with_sources,
    unit_of,
)
from knittest.report_page.pictures import CAPTIONS, fields, fields_figure_of, picture
from knittest.report_page.results import rows_of

#: columns of runs that fit a sheet of paper
RUNS_ABREAST = 4
#: factor above which a change in percent is left out
LARGEST_RATIO = 10.0
#: instead of a change of force between specimens of different size
OTHER_SIZE = "different size"
#: pictures of several runs that are shown next to each other
ABREAST_PICTURES = ("deformed.png", "shear-angle.png", "zones.png", "wrinkles.png", "draw-in.png")


def overview(runs: Sequence[LoadedRun], notes: Sequence[str]) -> Section:
    """Section with a row for each run and its state, linked to its part of the page."""
    rows = []
    for run in runs:
        text, tone = _state(run)
        preset, chosen = run.setting("model", "preset"), run.setting("parameters")
        what = " / ".join(str(part) for part in (preset, chosen) if part)
        title = Cell(run.title, note=run.name, href=f"#run-{run.number}")
        rows.append((Cell(str(run.number)), title, Cell(what), Cell(text, tone=tone)))
    table = Table(f"{len(runs)} runs", ("run", "test", "preset / parameters", "state"), rows)
    return Section("overview", "Runs", [table, *(Text(note, "warn") for note in notes)], level=2)


def results_side_by_side(runs: Sequence[LoadedRun]) -> Section:
    """Section with the results of each test in columns, the change against the first run, and the curves."""
    blocks: list[Block] = []
    for rig, group in group_by_test(runs):
        for start in range(0, len(group), RUNS_ABREAST):
            table = _results(rig, group[start : start + RUNS_ABREAST], group[0])
            blocks += [table] if table else []
        blocks += overlay_blocks(group)
        blocks += fields(group)
        blocks += _pictures(group)
    return Section("comparison", "Side by side", blocks, level=2)


def differences(runs: Sequence[LoadedRun]) -> Section:
    """Section with the parameters and settings that differ between runs of a test, and differing provenance."""
    blocks: list[Block] = []
    for rig, group in group_by_test(runs):
        if len(group) > 1:
            blocks += _difference_table(
                f"{rig or 'test not stated'}: parameters and settings that differ", group, _settings
            )
    blocks += _difference_table("Provenance that differs", runs, lambda run: run.manifest.facts())
    return Section("differences", "What differs", blocks, level=2)


def print_pictures(runs: Sequence[LoadedRun], page: Path) -> list[Path]:
    """Write curves and fields of the runs of each test next to ``page``; returns the PNG files."""
    written = []
    for rig, group in group_by_test(runs):
        for what, figure in (("curve", overlay_figure(group)), ("shear-field", fields_figure_of(group)[0])):
            if figure is not None:
                written.append(page.with_name(f"{page.stem}-{rig}-{what}.png"))
                save(figure, written[-1])
    return written


def _difference_table(
    caption: str, runs: Sequence[LoadedRun], facts: Callable[[LoadedRun], dict[str, str]]
) -> list[Block]:
    columns = [facts(run) for run in runs]
    names = dict.fromkeys(name for column in columns for name in column)
    rows = {name: [column.get(name, "-") for column in columns] for name in names}
    rows = {name: values for name, values in rows.items() if len(set(values)) > 1}
    if not rows:
        return [Text(f"{caption}: none.")]
    blocks: list[Block] = []
    for start in range(0, len(runs), RUNS_ABREAST):
        here = slice(start, start + RUNS_ABREAST)
        cells = [(Cell(name), *map(Cell, values[here])) for name, values in rows.items()]
        blocks.append(Table(caption, ("field", *map(_column_head, runs[here])), cells))
    return blocks


def group_by_test(runs: Sequence[LoadedRun]) -> Iterator[tuple[str, list[LoadedRun]]]:
    """Runs of each test in the order of their names."""
    for rig, group in groupby(sorted(runs, key=lambda r: r.rig), key=lambda r: r.rig):
        yield rig, list(group)


def _results(rig: str, runs: Sequence[LoadedRun], first: LoadedRun) -> Table | None:
    """Table with a row for each quantity: result, change against ``first``, deviation and kind."""
    columns = {run.number: {row.quantity: row for row in rows_of(run)} for run in runs}
    base = {row.quantity: row for row in rows_of(first)}
    sized = {run.number: SIZED if sizes_differ([first, run]) is not False else {} for run in runs}
    labels = {row.quantity: row.label for column in columns.values() for row in column.values()}
    refused = {run.number: bool(run.summary.refused) for run in runs}
    rows = [
        (Cell(label), *(_result(columns[n].get(q), base.get(q), q in sized[n], refused[n]) for n in columns))
        for q, label in labels.items()
    ]
    if not rows:
        return None
    header = ("quantity", *(_column_head(run) for run in runs))
    caption = f"{rig or 'test not stated'}: results; small print: change against run {first.number}, deviation, kind"
    return Table(caption, header, rows, tuple(range(1, len(header))))


def shared_pictures(runs: Sequence[LoadedRun]) -> frozenset[str]:
    """Names of the pictures shown next to each other for ``runs`` of one test."""
    return frozenset(ABREAST_PICTURES if len(runs) > 1 else ())


def _pictures(runs: Sequence[LoadedRun]) -> list[Block]:
    blocks: list[Block] = []
    for name in filter(shared_pictures(runs).__contains__, ABREAST_PICTURES):
        found = [
            picture(run.path / name, f"Run {run.number}: {CAPTIONS[name].lower()}")
            for run in runs
            if (run.path / name).is_file()
        ]
        shown = [block for block in found if isinstance(block, Picture)]
        blocks += [block for block in found if not isinstance(block, Picture)]
        blocks += [Gallery(shown)] if shown else []
    return blocks


def _result(row: ResultRow | None, base: ResultRow | None, other_size: bool, refused: bool) -> Cell:
    """Cell of a result with its change against ``base``, except for a force of a specimen of another size."""
    if row is None:
        return Cell("-")
    change = OTHER_SIZE if other_size else _change(row.value, None if base is None else base.value)
    parts = [change] if base is not None and base is not row else []
    parts += [part for part in (row.deviation, row.kind_text) if part != "-"]
    parts += [row.verdict] if refused else []
    return Cell(row.simulated, row.value, note=", ".join(part for part in parts if part))


def _change(value: float | None, base: float | None) -> str:
    """Change in percent; empty where it is unknown, zero or too large."""
    if value is None or base is None or base == 0.0 or value == base or abs(value / base) > LARGEST_RATIO:
        return ""
    return f"{round(100.0 * (value / base - 1.0), 1) + 0.0:+} %"  # no -0.0


def _settings(run: LoadedRun) -> dict[str, str]:
    fabric = {
        ".".join(path): f"{format_quantity(q)}{unit_of(path, run.rig)} ({q['source']})"
        for path, q in quantities_with_sources(run)
    }
    plain = {
        ".".join(path): format_value(value) + (unit_of(path, run.rig) if isinstance(value, int | float) else "")
        for path, value in plain_settings(run.config)
    }
    return plain | fabric


def _column_head(run: LoadedRun) -> str:
    direction = run.summary.direction or run.setting("rig", "direction")
    return f"run {run.number}" + (f" ({direction})" if direction else "")


def _state(run: LoadedRun) -> tuple[str, Tone]:
    if run.summary.refused:
        return "not compared with the experiment", "bad"
    status = run.manifest.status or "not known"
    if status == "completed" and run.summary.warnings:
        return f"completed, {(n := len(run.summary.warnings))} warning{'s' if n > 1 else ''}", "warn"
    return status, "good" if status == "completed" else "bad" if status == "failed" else "warn"
