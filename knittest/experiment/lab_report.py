"""Writes what a laboratory import yields: a folder that a fabric file can name as its experiment."""

import csv
import io
import json
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from knittest.errors import InputError, ResourceError
from knittest.experiment.lab_csv import Specimen
from knittest.experiment.statistics import Corridor, corridor, mean_sd, peaks, tension_curve
from knittest.experiment.tables import COLUMNS, TENSILE
from knittest.export.atomic import write_atomic
from knittest.export.figure import BLUE, dress, new_figure, save

DIRECTIONS = ("warp", "weft")
UNITS = {"peak_force_n": "N", "fracture_strain_pct": "%"}
STATISTICS = "statistics.json"
RISING = "# from the origin and rising; preload and noise are taken out"
SOURCE = """# Source

Tensile tests imported with `knittest data import`; write here who tested what, where and how.

- `tensile-warp.csv`, `tensile-weft.csv`: mean and sd of maximum force and of the strain at it. kind: measured.
- `warp/`, `weft/`: the specimens; `corridor.csv`, their mean and sd up to the first maximum; `tension.csv`, their mean
  up to the mean maximum, from the origin on and rising, for `macro.tension`; `statistics.json`, values and files.
"""
_OWN = {"SOURCE.md", *DIRECTIONS, *(f"tensile-{d}.csv" for d in DIRECTIONS)}
_OWN_INSIDE = re.compile(r"specimen-\d+\.csv|corridor\.csv|tension\.csv|statistics\.json|curves\.png")


def summary_lines(specimens: Sequence[Specimen]) -> list[str]:
    """Table of maximum force [N] and strain at it [%], with mean and sd."""
    force, strain = peaks(specimens)
    width = max(len("specimen"), *(len(s.name) for s in specimens))
    lines = [f"{'specimen':<{width}}  max. force [N]  strain at it [%]"]
    lines += [f"{s.name:<{width}}  {f:14.1f}  {e:16.3f}" for s, f, e in zip(specimens, force, strain, strict=True)]
    for name, k in (("mean", 0), ("sd", 1)):
        lines.append(f"{name:<{width}}  {mean_sd(force)[k]:14.1f}  {mean_sd(strain)[k]:16.3f}")
    return lines


def write_import(specimens: Sequence[Specimen], out: Path, direction: str, sources: Sequence[str]) -> str:
    """Write the experiment folder ``out``, or replace one ``direction`` of it; returns the variant in its table.

    ``SOURCE.md``, ``tensile-<direction>.csv`` (tidy), and in ``<direction>/`` the curves, statistics.json, curves.png.
    Raises :class:`InputError` when ``out`` holds what no import wrote.
    """
    variant = out.resolve().name
    band, inner = corridor(specimens), out / direction
    _refuse_foreign(out, inner)
    try:
        inner.mkdir(parents=True, exist_ok=True)
        for old in inner.glob("specimen-*.csv"):
            old.unlink()
    except OSError as error:
        raise ResourceError(f"{inner}: cannot be written: {error.strerror}") from None
    force, strain = peaks(specimens)
    found = dict(zip(TENSILE, (force, strain), strict=True))
    write_atomic(inner / STATISTICS, _statistics(found, sources))
    if not (out / "SOURCE.md").exists():
        write_atomic(out / "SOURCE.md", SOURCE)
    write_atomic(out / f"tensile-{direction}.csv", _table(variant, direction, found))
    for number, s in enumerate(specimens, 1):
        write_atomic(inner / f"specimen-{number:02d}.csv", _curve([f"# specimen: {s.name}"], s.strain, s.force))
    notes = [f"# source: {variant}, {direction}, mean of {len(specimens)}", *_peak_notes(found)]
    write_atomic(inner / "corridor.csv", _curve(notes, band.strain, band.mean, band.sd))
    write_atomic(inner / "tension.csv", _curve([*notes, RISING], *tension_curve(specimens)))
    _plot(specimens, band, inner / "curves.png")
    return variant


def _refuse_foreign(out: Path, inner: Path) -> None:
    """Raise unless both folders are new, empty or an earlier import's."""
    for folder in (out, inner):
        if folder.exists() and not folder.is_dir():
            raise InputError(f"--out {out}: {folder} is a file: choose a new or empty folder")
    strange = [name for name in _names(out) if name not in _OWN]
    inside = _names(inner)
    strange += [f"{inner.name}/{n}" for n in inside if not _OWN_INSIDE.fullmatch(n) or STATISTICS not in inside]
    if strange:
        raise InputError(
            f"--out {out}: holds {strange[0]}, which knittest data import did not write: choose a new or empty folder"
        )


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir()) if folder.exists() else []


def _statistics(found: dict[str, np.ndarray], sources: Sequence[str]) -> str:
    results = {}
    for name, values in found.items():
        mean, sd = mean_sd(values)
        results[name] = {"mean": mean, "sd": sd, "n": len(values), "values": [float(v) for v in values]}
    return json.dumps({"kind": "measured", "sources": list(sources), **results}, indent=2) + "\n"


def _table(variant: str, direction: str, found: dict[str, np.ndarray]) -> str:
    """Tidy rows as :func:`knittest.experiment.tables.published` reads them."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for name, values in found.items():
        mean, sd = (f"{v:.6g}" for v in mean_sd(values))
        writer.writerow([variant, direction, name, mean, sd, len(values), UNITS[name], f"{direction}/{STATISTICS}"])
    return text.getvalue()


def _peak_notes(found: dict[str, np.ndarray]) -> list[str]:
    return [f"# {name}: {mean_sd(values)[0]:.6g}" for name, values in found.items()]


def _curve(notes: list[str], *columns: np.ndarray) -> str:
    """A curve as :func:`knittest.experiment.curves.load_curve` reads it."""
    header = ",".join(["strain_pct", "force_n", "force_sd_n"][: len(columns)])
    rows = [",".join(f"{v:.6g}" for v in row) for row in zip(*columns, strict=True)]
    return "\n".join(["# kind: measured", *notes, header, *rows]) + "\n"


def _plot(specimens: Sequence[Specimen], band: Corridor, path: Path) -> None:
    figure = new_figure(7.0, 5.0)
    axes = figure.add_axes((0.12, 0.13, 0.84, 0.8))
    dress(axes)
    for s in specimens:
        axes.plot(s.strain, s.force, color="0.6", linewidth=0.8)
    axes.fill_between(band.strain, band.mean - band.sd, band.mean + band.sd, color=BLUE, alpha=0.25, label="mean ± sd")
    axes.plot(band.strain, band.mean, color=BLUE, linewidth=2.0, label=f"mean of {band.n}")
    axes.set(xlabel="strain [%]", ylabel="force [N]")
    axes.legend(frameon=False)
    save(figure, path)
