"""Results of one import: shown as a table, written as an experiment that a fabric file can name."""

import csv
import io
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.base.tidy_tables import COLUMNS
from knittest.experiment.lab_conditions import Condition
from knittest.experiment.lab_folder import STATISTICS, counted, folder_name, prepared, read_statistics, table_name
from knittest.experiment.statistics import Corridor, mean_sd

Array = NDArray[np.float64]
#: columns of a table that is shown: head, format and values
Shown = Sequence[tuple[str, str, Array]]


@dataclass(frozen=True)
class Curves:
    """Curves (x, y) of the specimens, their corridor, what x, y and its sd are called in files, and axes in pictures.

    ``more`` are further files by name, with their columns and further lines of their heads; ``head`` are such lines of
    the corridor.
    """

    each: Sequence[tuple[Array, Array]]
    band: Corridor
    names: tuple[str, str, str]
    labels: tuple[str, str]
    more: Mapping[str, tuple[Mapping[str, Array], Sequence[str]]] = field(default_factory=dict)
    head: Sequence[str] = ()


@dataclass(frozen=True)
class Results:
    """Values (n,) of each quantity with its unit, the conditions that they hang on, and where they come from.

    ``what`` describes the specimens, such as ``strips of 50 mm``; ``digests`` tell their curves from those of other
    imports; ``remarks`` stand below the columns ``shown``. ``direction`` is empty for a test without one.
    """

    found: Mapping[str, Array]
    units: Mapping[str, str]
    conditions: Sequence[tuple[Condition, float]]
    what: tuple[str, str]
    digests: Sequence[str]
    shown: Shown = ()
    remarks: Sequence[str] = ()
    curves: Curves | None = None
    test: str = ""
    direction: str = ""
    files: Sequence[str] = ()
    names: Sequence[str] = ()

    def source(self, out: Path) -> str:
        """The citation that a reader is shown."""
        specimens = f"{counted(len(next(iter(self.found.values()))), self.what[0])} {self.what[1]}"
        return ", ".join(filter(None, (out.resolve().name, specimens.strip(), self.direction)))

    def notes(self, out: Path) -> list[str]:
        """Lines for the head of a curve: source, test, direction and conditions."""
        stated = {"source": self.source(out), "test": self.test, "direction": self.direction}
        stated |= {what.key: f"{value:g}" for what, value in self.conditions}
        return [f"# {name}: {value}" for name, value in stated.items() if value]

    def lines(self) -> list[str]:
        """The table with mean and sd, remarks and conditions."""
        conditions = [f"{what.name}: {value:.6g} {what.unit}".removesuffix(" 1") for what, value in self.conditions]
        return [*table_lines(self.names, self.shown), *self.remarks, *conditions]


def table_lines(names: Sequence[str], shown: Shown) -> list[str]:
    """Specimens, then mean and sd of their columns; a standard deviation that one specimen has none of is a dash."""
    first = max(len("specimen"), *map(len, names))
    rows = [f"{name:<{first}}" for name in ("specimen", *names, "mean", "sd")]
    for head, form, values in shown:
        cells = [f"{v:>{len(head)}{form}}" if np.isfinite(v) else "-" for v in (*values, *mean_sd(values))]
        rows = [f"{row}  {cell:>{len(head)}}" for row, cell in zip(rows, [head, *cells], strict=True)]
    return rows


def write_results(out: Path, results: Results) -> str:
    """Write table, statistics and curves of ``results`` into the experiment ``out``; returns its variant.

    Raises :class:`InputError` when ``out`` holds what no import wrote, or these curves as of the other direction.
    """
    _refuse_other_way(out, results)
    inner, notes = prepared(out, results.test, results.direction), results.notes(out)
    write_atomic(inner / STATISTICS, _statistics(results))
    write_atomic(out / table_name(results.test, results.direction), _table(out, results))
    if curves := results.curves:
        band, files = curves.band, dict(curves.more)
        files["corridor.csv"] = (
            dict(zip(curves.names, (band.strain, band.mean, band.sd), strict=True)), curves.head
        )  # fmt: skip
        for file, (columns, head) in files.items():
            write_atomic(inner / file, _curve([*notes, *head], columns))
        for number, (name, columns_) in enumerate(zip(results.names, curves.each, strict=True), 1):
            text = _curve([f"# specimen: {name}", *notes[1:]], dict(zip(curves.names, columns_, strict=False)))
            write_atomic(inner / f"specimen-{number:02d}.csv", text)
        _plot(curves, inner / "curves.png")
    return out.resolve().name


def _refuse_other_way(out: Path, results: Results) -> None:
    """Raise for curves that were imported for the other direction."""
    other = {"warp": "weft", "weft": "warp"}.get(results.direction)
    folder = folder_name(results.test, other or "")
    if other and set(results.digests) & set(read_statistics(out).get(folder, {}).get("digests", ())):
        raise InputError(
            f"--direction {results.direction}: these curves stand in {out / folder} already, imported as {other}: of "
            f"which direction are they? Remove that folder if they are of the {results.direction}"
        )


def _statistics(results: Results) -> str:
    known: dict[str, Any] = {
        "kind": "measured", "test": results.test, "direction": results.direction,
        "conditions": {what.key: value for what, value in results.conditions},
        "sources": list(results.files), "digests": list(results.digests),
    }  # fmt: skip
    for name, found in results.found.items():
        mean, sd = mean_sd(found)
        known[name] = {"mean": mean, "sd": None if math.isnan(sd) else sd, "n": len(found), "values": found.tolist()}
    return json.dumps(known, indent=2, ensure_ascii=False) + "\n"


def _table(out: Path, results: Results) -> str:
    """Tidy rows as :func:`knittest.experiment.tables.published` reads them."""
    rows: list[tuple[str, float, object, object, str]] = []
    for name, values in results.found.items():
        mean, sd = mean_sd(values)
        rows.append((name, mean, "" if math.isnan(sd) else f"{sd:.6g}", len(values), results.units[name]))
    rows += [(what.key, value, "", "", what.unit) for what, value in results.conditions]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for name, mean, *more in rows:
        writer.writerow([out.resolve().name, results.direction, name, f"{mean:.6g}", *more, results.source(out)])
    return text.getvalue()


def _curve(notes: Sequence[str], columns: Mapping[str, Array]) -> str:
    """A curve as :func:`knittest.experiment.curves.load_curve` reads it, without a column of NaN (no scatter known)."""
    kept = {name: values for name, values in columns.items() if not np.isnan(values).all()}
    rows = [",".join(f"{v:.6g}" for v in row) for row in zip(*kept.values(), strict=True)]
    return "\n".join(["# kind: measured", *notes, ",".join(kept), *rows]) + "\n"


def _plot(curves: Curves, path: Path) -> None:
    from knittest.base.figure import BLUE, dress, new_figure, save

    band = curves.band
    figure = new_figure(7.0, 5.0)
    axes = figure.add_axes((0.12, 0.13, 0.84, 0.8))
    dress(axes)
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
