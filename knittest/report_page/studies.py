"""Knowledge of a test beside the run: what half its speed does, what the test itself shows; parts of pages on
trials.
"""

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from knittest.base.kinds import kinds
from knittest.base.result_rows import LABELS
from knittest.experiment.tables import SpeedRow, shear_bands, speed_rows
from knittest.laboratory.halving import LIMIT, change
from knittest.laboratory.records import Study
from knittest.report_page.blocks import Block, Cell, Code, Section, Table, Text
from knittest.report_page.files import Manifest, Reader
from knittest.report_page.loading import LoadedRun
from knittest.report_page.pictures import data_uri

NOT_STUDIED = (
    "What speed does to this test was not studied with this fabric. Repeat the run with --verify, or study it: "
    "knittest check {} --convergence with the fabric {} and the settings of this run."
)
SPEED_HEAD = ("result", "as set", "at half", "change")
SHEAR_HEAD = ("shear angle", "5 %", "50 %", "95 %", "points that ran")
SHEAR_NOTE = (
    "Bending, set, tension, friction and patches of these yarns are assumed: forces of shear, of the stamp too, are "
    "known no better than this band. knittest uncertainty configs/uncertainty/shear-order.yaml repeats it."
)


def studies(run: LoadedRun) -> list[Section]:
    """One section; of a fabric or test that was not studied it says how to do so, of what is not known nothing."""
    blocks: list[Block] = [*_own(run), *_speed(run)]
    if not blocks and run.run is not None:
        blocks.append(Text(NOT_STUDIED.format(run.rig, run.run.fabric.name)))
    blocks += _shear(run)
    return [Section(f"run-{run.number}-studies", "Studies of the model", blocks)] if blocks else []


def _speed(run: LoadedRun) -> list[Block]:
    scale, fabric = str(run.setting("model", "scale") or run.summary.scale), run.setting("fabric", "name")
    rows = speed_rows(run.rig, scale, str(fabric))
    if not rows:
        return []
    first = rows[0]
    unit = "" if first.unit == "-" else f" {first.unit}"
    caption = (
        f"{first.setting} halved from {first.value:g}{unit}: shipped study on variant {first.variant}, preset "
        f"{first.preset}, not this run; knittest speed-study repeats it"
    )
    return [Table(caption, SPEED_HEAD, [_speed_row(row) for row in rows], (1, 2, 3))]


def _shear(run: LoadedRun) -> list[Block]:
    """Bands of the fabric's shear, where the test shears it."""
    kind = kinds().get(run.rig)
    bands = shear_bands(str(run.setting("fabric", "name"))) if kind is not None and kind.shears else []
    if not bands:
        return []
    rows = [
        (
            Cell(f"{band.angle:g} deg", band.angle),
            *(Cell(f"{value:.4f}", value) for value in (band.low, band.middle, band.high)),
            Cell(f"{band.count} of {band.points}"),
        )
        for band in bands
    ]
    caption = "Shear of a cell of yarns [N/mm] over the prior of what nobody measured: shipped study, not this run"
    return [Table(caption, SHEAR_HEAD, rows, (0, 1, 2, 3)), Text(SHEAR_NOTE)]


def _speed_row(row: SpeedRow) -> tuple[Cell, ...]:
    label, form = LABELS.get(row.quantity, (row.quantity.replace("_", " "), "{:.4g}"))
    share = change(row.result, row.half)
    if math.isnan(share):
        told = Cell("-")
    else:
        held = abs(share) < LIMIT
        text = f"{100.0 * share:+.2f} %" if math.isfinite(share) else "from 0"
        told = Cell(text, share, tone="good" if held else "warn", note="" if held else f"above {100.0 * LIMIT:g} %")
    return Cell(label), _number(row.result, form), _number(row.half, form), told


def _number(value: float, form: str) -> Cell:
    return Cell(form.format(value), value) if math.isfinite(value) else Cell("-")


def _own(run: LoadedRun) -> list[Block]:
    """Study that the test itself shows beside the run."""
    kind = kinds().get(run.rig)
    if run.run is None or kind is None or not kind.study:
        return []
    found: Study | None = kind.load("study")(run.run, run.summary.results)
    if found is None:
        return []
    rows = [(Cell(label), *(_number(number, found.form) for number in numbers)) for label, numbers in found.rows]
    return [Table(found.caption, found.head, rows, tuple(range(1, len(found.head)))), Text(found.note)]


#: columns of a table beside those that name the row
BESIDE = 6
#: folders whose manifests are read
MOST_MANIFESTS = 300
_INSIDE = re.compile(r"trials/\w{1,64}")


@dataclass(frozen=True)
class Column:
    """A column of a table; ``numeric`` ones align to the right."""

    name: str
    cells: Sequence[Cell]
    numeric: bool = False


def wide(caption: str, naming: Sequence[Column], columns: Sequence[Column]) -> list[Block]:
    """``columns`` in tables of :data:`BESIDE` at most, each with the ``naming`` ones in front."""
    tables: list[Block] = []
    for start in range(0, max(len(columns), 1), BESIDE):
        part = [*naming, *columns[start : start + BESIDE]]
        rows = list(zip(*(column.cells for column in part), strict=True))
        numeric = tuple(k for k, column in enumerate(part) if column.numeric)
        more = f", columns {start + 1} to {start + len(part) - len(naming)}" if len(columns) > BESIDE else ""
        tables.append(Table(caption + more, tuple(column.name for column in part), rows, numeric))
    return tables


def link(folder: Path, trial: str, at: Path) -> str:
    """Relative path from the folder ``at`` to the page, else the folder, of ``trial`` in ``folder``.

    Empty for anything that is no folder of a trial there.
    """
    place = folder / trial
    if not _INSIDE.fullmatch(trial) or not place.is_dir():
        return ""
    page = place / "report.html"
    target = os.path.relpath(page if page.is_file() else place, at)
    return quote(target if page.is_file() else f"{target}/")


def problems(reader: Reader) -> list[Block]:
    """Warning of what could not be read; nothing where all could."""
    return [Text("Missing or not readable: " + "; ".join(reader.problems), "warn")] if reader.problems else []


def file_to_save(reader: Reader, name: str, caption: str, limit: int = 1_000_000) -> list[Block]:
    """The YAML file ``name`` to read and to save; nothing if it cannot be read, which is a problem of ``reader``."""
    raw = reader.raw(name, limit)
    if raw is None:
        return []
    uri = data_uri(raw, "text/yaml;charset=utf-8")
    return [Code(raw.decode("utf-8", errors="replace"), caption, (name, uri))]


def provenance(folder: Path, trials: Sequence[str]) -> list[Block]:
    """Versions, commits, processors and data of the ``trials`` in ``folder``, and how many have which."""
    said: dict[str, dict[str, int]] = {}
    manifests = 0
    for trial in trials[:MOST_MANIFESTS]:
        if not link(folder, trial, folder):
            continue
        manifest = Reader(folder / trial).model("manifest.json", Manifest)
        manifests += 1
        for name, value in _facts(manifest).items():
            counts = said.setdefault(name, {})
            counts[value] = counts.get(value, 0) + 1
    if not said:
        return [Text("No trial left a manifest.", "warn")]
    rows = [
        (Cell(name), Cell("; ".join(v if len(counts) == 1 else f"{v} ({n} runs)" for v, n in counts.items())))
        for name, counts in said.items()
    ]
    blocks: list[Block] = [Table(f"Provenance of {manifests} run folders", (), rows)]
    if any(len(said.get(name, ())) > 1 for name in ("knittest", "commit")):
        blocks.append(Text("The runs are not of one version of the code.", "warn"))
    return blocks


def _facts(manifest: Manifest) -> dict[str, str]:
    facts = {
        "knittest": manifest.version,
        "commit": manifest.git_commit,
        "processor": manifest.cpu,
        "threads": manifest.threads,
        **{f"{name}, SHA-256": digest for name, digest in manifest.data_sha256.items()},
        **manifest.libraries,
    }
    return {name: str(value) for name, value in facts.items() if value not in (None, "")}
