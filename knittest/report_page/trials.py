"""Parts of pages on many trials: links to their folders, wide tables in pieces, the place where they ran."""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from knittest.report_page.blocks import Block, Cell, Code, Table, Text
from knittest.report_page.files import Manifest, Reader
from knittest.report_page.pictures import data_uri

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
