"""Section of a report on studies of a test: half speed, shear bands, the test's own study; parts of study pages."""

import math
import os
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from knittest.base.kinds import kinds
from knittest.base.result_rows import LABELS
from knittest.experiment.tables import SpeedRow, shear_bands, speed_rows
from knittest.laboratory.halved_setting import LIMIT, change
from knittest.laboratory.records import Study
from knittest.report_page.blocks import Block, Cell, Code, Section, Table, Text
from knittest.report_page.files import Manifest, Reader
from knittest.report_page.loaded_run import LoadedRun
from knittest.report_page.pictures import data_uri

NOT_STUDIED = (
    "The effect of the speed on this test was not studied for this fabric. Repeat the run with --verify, or run "
    "knittest check {} --convergence for the fabric {} with the settings of this run."
)
SPEED_HEAD = ("result", "as set", "at half", "change")
SHEAR_HEAD = ("shear angle", "5 %", "50 %", "95 %", "completed runs")
SHEAR_NOTE = (
    "Bending stiffness, degree of set, loop tension, friction and contact patches of these yarns are assumed. Shear "
    "forces, and the force of the stamp, are known only within this band. To repeat the study: knittest uncertainty "
    "configs/uncertainty/shear-order.yaml."
)


def studies(run: LoadedRun) -> list[Section]:
    """Section with all studies of the test, or with the way to study the speed; none for an unknown test."""
    scale, fabric = str(run.setting("model", "scale") or run.summary.scale), str(run.setting("fabric", "name"))
    kind, blocks = kinds().get(run.rig), list[Block]()
    if run.run is not None and kind is not None and kind.study:
        found: Study | None = kind.load("study")(run.run, run.summary.results)
        if found is not None:
            form, numeric = found.form, tuple(range(1, len(found.head)))
            rows = [(Cell(label), *(_number(number, form) for number in numbers)) for label, numbers in found.rows]
            blocks += [Table(found.caption, found.head, rows, numeric), Text(found.note)]
    if speeds := speed_rows(run.rig, scale, fabric):
        first = speeds[0]
        unit = "" if first.unit == "-" else f" {first.unit}"
        caption = (
            f"{first.setting} halved from {first.value:g}{unit}: shipped study of variant {first.variant}, preset "
            f"{first.preset}, not this run; knittest speed-study repeats it"
        )
        blocks.append(Table(caption, SPEED_HEAD, [_speed_row(row) for row in speeds], (1, 2, 3)))
    if not blocks and run.run is not None:
        blocks.append(Text(NOT_STUDIED.format(run.rig, run.run.fabric.name)))
    if bands := shear_bands(fabric) if kind is not None and kind.shears else []:
        shear = [
            (
                Cell(f"{band.angle:g} deg", band.angle),
                *(Cell(f"{value:.4f}", value) for value in (band.low, band.middle, band.high)),
                Cell(f"{band.count} of {band.points}"),
            )
            for band in bands
        ]
        caption = "Shear force of a meso cell [N/mm] over the assumed yarn parameters: shipped study, not this run"
        blocks += [Table(caption, SHEAR_HEAD, shear, (0, 1, 2, 3)), Text(SHEAR_NOTE)]
    return [Section(f"run-{run.number}-studies", "Studies of the model", blocks)] if blocks else []


def _speed_row(row: SpeedRow) -> tuple[Cell, ...]:
    label, form = LABELS.get(row.quantity, (row.quantity.replace("_", " "), "{:.4g}"))
    share = change(row.result, row.half)
    if math.isnan(share):
        return Cell(label), _number(row.result, form), _number(row.half, form), Cell("-")
    held = abs(share) < LIMIT
    text = f"{100.0 * share:+.2f} %" if math.isfinite(share) else "from 0"
    note = "" if held else f"above {100.0 * LIMIT:g} %"
    changed = Cell(text, share, tone="good" if held else "warn", note=note)
    return Cell(label), _number(row.result, form), _number(row.half, form), changed


def _number(value: float, form: str) -> Cell:
    return Cell(form.format(value), value) if math.isfinite(value) else Cell("-")


#: columns of a table besides those that name the row
COLUMNS_ABREAST = 6
#: folders whose manifests are read
MOST_MANIFESTS = 300
_TRIAL_PATH = re.compile(r"trials/\w{1,64}")


@dataclass(frozen=True)
class Column:
    """A column of a table; ``numeric`` ones align to the right."""

    name: str
    cells: Sequence[Cell]
    numeric: bool = False


def split_table(caption: str, naming: Sequence[Column], columns: Sequence[Column]) -> list[Block]:
    """``columns`` in tables of :data:`BESIDE` at most, each with the ``naming`` ones in front."""
    tables: list[Block] = []
    for start in range(0, max(len(columns), 1), COLUMNS_ABREAST):
        part = [*naming, *columns[start : start + COLUMNS_ABREAST]]
        rows = list(zip(*(column.cells for column in part), strict=True))
        numeric = tuple(k for k, column in enumerate(part) if column.numeric)
        more = f", columns {start + 1} to {start + len(part) - len(naming)}" if len(columns) > COLUMNS_ABREAST else ""
        tables.append(Table(caption + more, tuple(column.name for column in part), rows, numeric))
    return tables


def link(folder: Path, trial: str, at: Path) -> str:
    """Relative path from ``at`` to the page, else the folder, of ``trial`` in ``folder``; empty for other names."""
    place = folder / trial
    if not _TRIAL_PATH.fullmatch(trial) or not place.is_dir():
        return ""
    page = place / "report.html"
    target = os.path.relpath(page if page.is_file() else place, at)
    return quote(target if page.is_file() else f"{target}/")


def problems(reader: Reader) -> list[Block]:
    """Warning of files that could not be read."""
    return [Text("Missing or not readable: " + "; ".join(reader.problems), "warn")] if reader.problems else []


def file_to_save(reader: Reader, name: str, caption: str, limit: int = 1_000_000) -> list[Block]:
    """The YAML file ``name`` to read and to save; nothing, and a problem of ``reader``, if it cannot be read."""
    raw = reader.raw(name, limit)
    if raw is None:
        return []
    uri = data_uri(raw, "text/yaml;charset=utf-8")
    return [Code(raw.decode("utf-8", errors="replace"), caption, (name, uri))]


def provenance(folder: Path, trials: Sequence[str]) -> list[Block]:
    """Versions, commits, processors and data of the ``trials`` in ``folder``, with the number of runs of each."""
    counts: dict[str, Counter[str]] = {}
    manifests = 0
    for trial in trials[:MOST_MANIFESTS]:
        if link(folder, trial, folder):
            manifests += 1
            for name, value in Reader(folder / trial).model("manifest.json", Manifest).facts().items():
                counts.setdefault(name, Counter())[value] += 1
    if not counts:
        return [Text("No trial has a manifest.", "warn")]
    rows = [
        (Cell(name), Cell("; ".join(v if len(found) == 1 else f"{v} ({n} runs)" for v, n in found.items())))
        for name, found in counts.items()
    ]
    blocks: list[Block] = [Table(f"Provenance of {manifests} run folders", (), rows)]
    if any(len(counts.get(name, ())) > 1 for name in ("knittest", "commit")):
        blocks.append(Text("The runs used different versions of the code.", "warn"))
    return blocks
