"""Results of imports: printed as tables, and written into the folder of an experiment."""

import json
import math
import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from knittest.base.errors import InputError, ResourceError
from knittest.base.files import COLUMNS, write_atomic
from knittest.base.kinds import DEFAULT, kinds, test_names
from knittest.config.templates import FABRIC
from knittest.experiment.lab_conditions import Condition
from knittest.experiment.statistics import Array, Corridor, mean_sd

#: columns of a table that is shown: head, format and values
TableColumns = Sequence[tuple[str, str, Array]]
#: statistics of the imports of an experiment by their folders
Tests = Mapping[str, dict[str, Any]]

STATISTICS, SOURCE_FILE, TENSION, SHEAR = "statistics.json", "SOURCE.md", "tension.csv", "shear.csv"
DIRECTIONS = ("warp", "weft")
SOURCE = """# Source

Tests imported with `knittest data import`; write here who tested what, where and how.

"""
ITEMS = (
    "{tables}: mean and standard deviation of the results, and the test conditions. kind: measured.",
    "`warp/`, `weft/` ({default}), {folders}: curves of the specimens; `corridor.csv`: their mean and standard "
    "deviation; `statistics.json`: values and files. `tension.csv` and `shear.csv` are curves for a fabric file: they "
    "start at the origin and rise.",
    "`fabric.yaml`: all fabric data of these tests; `knittest new NAME --from` this folder creates a fabric from it.",
)
_OWN_INSIDE = re.compile(r"specimen-\d+\.csv|corridor\.csv|tension\.csv|shear\.csv|statistics\.json|curves\.png")


@dataclass(frozen=True)
class Curves:
    """Curves (x, y) of the specimens, their corridor, column names of x, y and its sd, and labels of axes.

    ``more`` are further files by name, with columns and lines of their heads; ``head`` are those of the corridor.
    """

    each: Sequence[tuple[Array, Array]]
    band: Corridor
    names: tuple[str, str, str]
    labels: tuple[str, str]
    more: Mapping[str, tuple[Mapping[str, Array], Sequence[str]]] = field(default_factory=dict)
    head: Sequence[str] = ()


@dataclass(frozen=True)
class Results:
    """Values (n,) of each quantity with its unit, the conditions and the origin.

    ``what`` describes the specimens, such as ``strips of 50 mm``; ``digests`` identify their curves; ``remarks`` follow
    the columns ``shown``. ``direction`` is empty for a test without one.
    """

    found: Mapping[str, Array]
    units: Mapping[str, str]
    conditions: Sequence[tuple[Condition, float]]
    what: tuple[str, str]
    digests: Sequence[str]
    shown: TableColumns = ()
    remarks: Sequence[str] = ()
    curves: Curves | None = None
    test: str = ""
    direction: str = ""
    files: Sequence[str] = ()
    names: Sequence[str] = ()

    def source(self, out: Path) -> str:
        """Citation of the results."""
        specimens = f"{count_text(len(next(iter(self.found.values()))), self.what[0])} {self.what[1]}"
        return ", ".join(filter(None, (out.resolve().name, specimens.strip(), self.direction)))

    def notes(self, out: Path) -> list[str]:
        """Lines for the head of a curve: source, test, direction and conditions."""
        stated = {"source": self.source(out), "test": self.test, "direction": self.direction}
        stated |= {what.key: f"{value:g}" for what, value in self.conditions}
        return [f"# {name}: {value}" for name, value in stated.items() if value]

    def lines(self) -> list[str]:
        """Lines of the table with mean and sd, remarks and conditions."""
        conditions = [f"{what.name}: {value:.6g} {what.unit}".removesuffix(" 1") for what, value in self.conditions]
        return [*table_lines(self.names, self.shown), *self.remarks, *conditions]

    def statistics(self) -> dict[str, Any]:
        """Content of the file of an import: mean, sd and values of each quantity, conditions, files and digests."""
        conditions = {what.key: value for what, value in self.conditions}
        known: dict[str, Any] = {"kind": "measured", "test": self.test, "direction": self.direction}
        known |= {"conditions": conditions, "sources": list(self.files), "digests": list(self.digests)}
        for name, found in self.found.items():
            mean, sd = mean_sd(found)
            scatter = None if math.isnan(sd) else sd
            known[name] = {"mean": mean, "sd": scatter, "n": len(found), "values": found.tolist()}
        return known


def table_lines(names: Sequence[str], shown: TableColumns) -> list[str]:
    """Write a table of specimens, mean and sd; an unknown standard deviation is a dash."""
    first = max(len("specimen"), *map(len, names))
    rows = [f"{name:<{first}}" for name in ("specimen", *names, "mean", "sd")]
    for head, form, values in shown:
        cells = [f"{v:>{len(head)}{form}}" if np.isfinite(v) else "-" for v in (*values, *mean_sd(values))]
        rows = [f"{row}  {cell:>{len(head)}}" for row, cell in zip(rows, [head, *cells], strict=True)]
    return rows


def table_name(test: str, direction: str) -> str:
    """Name of the tidy table of an import."""
    return f"{test}-{direction}.csv" if direction else f"{test}.csv"


def folder_name(test: str, direction: str) -> str:
    """Name of the folder of an import; that of the default test is the direction alone."""
    return direction if test == DEFAULT else f"{test}-{direction}".removesuffix("-")


def statistics_by_direction(tests: Tests, test: str) -> dict[str, dict[str, Any]]:
    """Statistics of ``test`` by the directions that were tested, of which some tests have none."""
    return {d: tests[name] for d in (*DIRECTIONS, "") if (name := folder_name(test, d)) in tests}


def count_text(n: int, what: str) -> str:
    """Count in words: 1 strip, 5 strips."""
    return f"{n} {what}{'s' if n > 1 else ''}"


def quantity_entry(found: dict[str, Any], source: str, ref: str) -> dict[str, Any]:
    """Field of a fabric file, with the standard deviation if it is known."""
    scatter = {} if found["sd"] is None else {"sd": float(f"{found['sd']:.6g}")}
    return {"value": float(f"{found['mean']:.6g}"), **scatter, "source": source, "ref": ref}


def _possible_imports() -> list[tuple[str, str]]:
    """Test and direction of all possible imports."""
    return [
        (test, d) for test in test_names("laboratory") for d in (DIRECTIONS if kinds()[test].directional else ("",))
    ]


def source_text() -> str:
    """Text of a SOURCE.md to fill in, with the names of the files of all tests."""
    parts = {test: "*" if kinds()[test].directional else "" for test in test_names("laboratory")}
    tables = ", ".join(f"`{table_name(test, part)}`" for test, part in parts.items())
    folders = ", ".join(f"`{folder_name(test, part)}/`" for test, part in parts.items() if test != DEFAULT)
    items = [f"- {item.format(tables=tables, default=DEFAULT, folders=folders)}" for item in ITEMS]
    return SOURCE + "".join(f"{textwrap.fill(item, 116, subsequent_indent='  ')}\n" for item in items)


def read_statistics(out: Path) -> dict[str, dict[str, Any]]:
    """Read the statistics of the imports in ``out`` by folder; raises :class:`InputError` for a damaged file."""
    found = {}
    for name in (folder_name(*one) for one in _possible_imports()):
        path = out / name / STATISTICS
        if path.is_file():
            try:
                found[name] = json.loads(path.read_text(encoding="utf-8"))
                found[name]["conditions"], found[name]["test"]
            except (OSError, ValueError, KeyError, TypeError):
                raise InputError(f"{path}: not written by this version of knittest; import the files again") from None
    return found


def write_results(out: Path, results: Results) -> str:
    """Write table, statistics and curves of ``results`` into the experiment ``out``; returns its variant."""
    other = {"warp": "weft", "weft": "warp"}.get(results.direction, "")
    folder = folder_name(results.test, other)
    if other and set(results.digests) & set(read_statistics(out).get(folder, {}).get("digests", ())):
        raise InputError(
            f"--direction {results.direction}: {out / folder} has the same curves, imported as {other}; remove that "
            f"folder if they are {results.direction} tests"
        )
    inner, notes = _make_folder(out, results.test, results.direction), results.notes(out)
    known = results.statistics()
    write_atomic(inner / STATISTICS, json.dumps(known, indent=2, ensure_ascii=False) + "\n")
    write_atomic(out / table_name(results.test, results.direction), _table_text(out, results, known))
    if curves := results.curves:
        band, files = curves.band, dict(curves.more)
        files["corridor.csv"] = dict(zip(curves.names, (band.strain, band.mean, band.sd), strict=True)), curves.head
        for file, (columns, head) in files.items():
            write_atomic(inner / file, _curve_text([*notes, *head], columns))
        for number, (name, xy) in enumerate(zip(results.names, curves.each, strict=True), 1):
            text = _curve_text([f"# specimen: {name}", *notes[1:]], dict(zip(curves.names, xy, strict=False)))
            write_atomic(inner / f"specimen-{number:02d}.csv", text)
        _plot(curves, inner / "curves.png")
    return out.resolve().name


def _make_folder(out: Path, test: str, direction: str) -> Path:
    """Make the folder of this import, without earlier specimens; raises :class:`InputError` for other files in it."""
    inner = out / folder_name(test, direction)
    own = {SOURCE_FILE, FABRIC, *(name(*one) for one in _possible_imports() for name in (folder_name, table_name))}
    for folder in (out, inner):
        if folder.exists() and not folder.is_dir():
            raise InputError(f"--out {out}: {folder} is a file; choose a new or empty folder")
    outside, inside = (sorted(path.name for path in f.iterdir()) if f.exists() else [] for f in (out, inner))
    strange = [name for name in outside if name not in own]
    strange += [f"{inner.name}/{n}" for n in inside if not _OWN_INSIDE.fullmatch(n) or STATISTICS not in inside]
    if strange:
        raise InputError(f"--out {out}: {strange[0]} is not written by knittest data import; choose another folder")
    try:
        inner.mkdir(parents=True, exist_ok=True)
        for old in inner.glob("specimen-*.csv"):
            old.unlink()
    except OSError as error:
        raise ResourceError(f"{inner}: cannot be written: {error.strerror}") from None
    return inner


def _table_text(out: Path, results: Results, known: Mapping[str, Any]) -> str:
    """Tidy rows as :func:`knittest.experiment.tables.published_rows` reads them."""
    import pandas as pd

    rows: list[tuple[object, ...]] = []
    for name in results.found:
        mean, sd, n = (known[name][key] for key in ("mean", "sd", "n"))
        rows.append((name, f"{mean:.6g}", "" if sd is None else f"{sd:.6g}", n, results.units[name]))
    rows += [(what.key, f"{value:.6g}", "", "", what.unit) for what, value in results.conditions]
    whose, source = (out.resolve().name, results.direction), results.source(out)
    table = pd.DataFrame([(*whose, *row, source) for row in rows], columns=list(COLUMNS))
    return str(table.to_csv(index=False, lineterminator="\n"))


def _curve_text(notes: Sequence[str], columns: Mapping[str, Array]) -> str:
    """Curve as :func:`knittest.experiment.curves.load_curve` reads it, without columns of NaN (unknown scatter)."""
    import pandas as pd

    table = pd.DataFrame(columns).dropna(axis=1, how="all")
    text = table.to_csv(index=False, lineterminator="\n", float_format="%.6g", na_rep="nan")
    return "\n".join(["# kind: measured", *notes, text])


def _plot(curves: Curves, path: Path) -> None:
    from knittest.base.figure import BLUE, new_figure, save, style_axes

    band = curves.band
    figure = new_figure(7.0, 5.0)
    axes = figure.add_axes((0.12, 0.13, 0.84, 0.8))
    style_axes(axes)
    for x, y in curves.each:
        axes.plot(x, y, color="0.6", linewidth=0.8)
    if band.n > 1:
        low, high = band.mean - band.sd, band.mean + band.sd
        axes.fill_between(band.strain, low, high, color=BLUE, alpha=0.25, label="mean ± sd")
    label = f"mean of {band.n}" if band.n > 1 else "one specimen"
    axes.plot(band.strain, band.mean, color=BLUE, linewidth=2.0, label=label)
    axes.set(xlabel=curves.labels[0], ylabel=curves.labels[1])
    axes.legend(frameon=False)
    save(figure, path)
