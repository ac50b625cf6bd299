"""The folder of an experiment: what imports write there, and what they leave alone."""

import json
import re
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError, ResourceError
from knittest.base.kinds import DEFAULT, kinds, names
from knittest.config.starting import FABRIC

STATISTICS, SOURCE_FILE = "statistics.json", "SOURCE.md"
TENSION, SHEAR = "tension.csv", "shear.csv"
DIRECTIONS = ("warp", "weft")
SOURCE = """# Source

Tests imported with `knittest data import`; write here who tested what, where and how.

"""
ITEMS = (
    "{tables}: mean and sd of the results, and the conditions that they hang on. kind: measured.",
    "`warp/`, `weft/` ({default}), {folders}: the specimens; `corridor.csv`, their mean and sd; `statistics.json`, "
    "values and files. `tension.csv` and `shear.csv` are curves for a fabric file, from the origin on and rising.",
    "`fabric.yaml`: what all of it says of the fabric; `knittest new NAME --from` this folder starts from it.",
)
_OWN_INSIDE = re.compile(r"specimen-\d+\.csv|corridor\.csv|tension\.csv|shear\.csv|statistics\.json|curves\.png")
#: statistics of the imports of an experiment by their folders
Tests = Mapping[str, dict[str, Any]]


def table_name(test: str, direction: str) -> str:
    """Name of the tidy table of an import."""
    return f"{test}-{direction}.csv" if direction else f"{test}.csv"


def folder_name(test: str, direction: str) -> str:
    """Name of the folder of an import; that of the default test is the direction alone."""
    return direction if test == DEFAULT else f"{test}-{direction}".removesuffix("-")


def of_directions(tests: Tests, test: str) -> dict[str, dict[str, Any]]:
    """Statistics of ``test`` by the directions that were tested."""
    return {d: tests[name] for d in DIRECTIONS if (name := folder_name(test, d)) in tests}


def _imports() -> list[tuple[str, str]]:
    """Test and direction of all imports that there may be."""
    return [(test, d) for test in names("laboratory") for d in (DIRECTIONS if kinds()[test].directional else ("",))]


def source_text() -> str:
    """Text of a SOURCE.md to fill in, with the names that imports of all tests have."""
    parts = {test: "*" if kinds()[test].directional else "" for test in names("laboratory")}
    tables = ", ".join(f"`{table_name(test, part)}`" for test, part in parts.items())
    folders = ", ".join(f"`{folder_name(test, part)}/`" for test, part in parts.items() if test != DEFAULT)
    items = [f"- {item.format(tables=tables, default=DEFAULT, folders=folders)}" for item in ITEMS]
    return SOURCE + "".join(f"{textwrap.fill(item, 116, subsequent_indent='  ')}\n" for item in items)


def prepared(out: Path, test: str, direction: str) -> Path:
    """The folder of this import in the experiment ``out``, without an earlier one's specimens.

    Raises :class:`InputError` unless both folders are new, empty or an earlier import's.
    """
    inner = out / folder_name(test, direction)
    own = {SOURCE_FILE, FABRIC, *(name(t, d) for t, d in _imports() for name in (folder_name, table_name))}
    for folder in (out, inner):
        if folder.exists() and not folder.is_dir():
            raise InputError(f"--out {out}: {folder} is a file: choose a new or empty folder")
    outside, inside = (sorted(path.name for path in f.iterdir()) if f.exists() else [] for f in (out, inner))
    strange = [name for name in outside if name not in own]
    strange += [f"{inner.name}/{n}" for n in inside if not _OWN_INSIDE.fullmatch(n) or STATISTICS not in inside]
    if strange:
        raise InputError(
            f"--out {out}: holds {strange[0]}, which knittest data import did not write: choose a new or empty folder"
        )
    try:
        inner.mkdir(parents=True, exist_ok=True)
        for old in inner.glob("specimen-*.csv"):
            old.unlink()
    except OSError as error:
        raise ResourceError(f"{inner}: cannot be written: {error.strerror}") from None
    return inner


def counted(n: int, what: str) -> str:
    """``n`` of ``what`` in words: 1 strip, 5 strips."""
    return f"{n} {what}{'s' if n > 1 else ''}"


def quantity(found: dict[str, Any], source: str, ref: str) -> dict[str, Any]:
    """A field of a fabric file, with the standard deviation where one is known."""
    scatter = {} if found["sd"] is None else {"sd": float(f"{found['sd']:.6g}")}
    return {"value": float(f"{found['mean']:.6g}"), **scatter, "source": source, "ref": ref}


def read_statistics(out: Path) -> dict[str, dict[str, Any]]:
    """Statistics of the imports in ``out`` by folder; raises :class:`InputError` for one that cannot be read."""
    found = {}
    for name in (folder_name(test, direction) for test, direction in _imports()):
        path = out / name / STATISTICS
        if not path.is_file():
            continue
        try:
            read = json.loads(path.read_text(encoding="utf-8"))
            read["conditions"], read["test"]
        except (OSError, ValueError, KeyError, TypeError):
            raise InputError(f"{path}: not what knittest data import writes now: import those files anew") from None
        found[name] = read
    return found
