"""Writes what a tensile import yields: a folder that a fabric file can name as its experiment."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from knittest.config.fabric import Direction
from knittest.errors import InputError
from knittest.experiment.lab_checks import digest, known_elsewhere, one_series, per_width
from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_csv import Specimen
from knittest.experiment.lab_direction import refuse_other
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import (
    DIRECTIONS,
    STATISTICS,
    counted,
    curve_text,
    folder_name,
    prepared,
    read_statistics,
    statistics_text,
    table_name,
    table_text,
)
from knittest.experiment.lab_picture import plot
from knittest.experiment.statistics import Corridor, corridor, mean_sd, peaks, tension_curve
from knittest.experiment.tables import TENSILE
from knittest.export.atomic import write_atomic

UNITS = {"peak_force_n": "N", "fracture_strain_pct": "%"}
STRAIN, FORCE, FORCE_SD = "strain_pct", "force_n_per_mm", "force_sd_n_per_mm"
RISING = "# from the origin and rising; preload and noise are taken out"


class _Series(NamedTuple):
    """Strips with forces per width, their corridor and the curve for a material."""

    strips: Sequence[Specimen]
    band: Corridor
    tension: tuple[np.ndarray, np.ndarray]


def summary_lines(specimens: Sequence[Specimen]) -> list[str]:
    """Table of maximum force [N] and strain at it [%], with mean and sd, and of the strips' sizes."""
    force, strain = peaks(specimens)
    width = max(len("specimen"), *(len(s.name) for s in specimens))
    lines = [f"{'specimen':<{width}}  max. force [N]  strain at it [%]"]
    lines += [f"{s.name:<{width}}  {f:14.1f}  {e:16.3f}" for s, f, e in zip(specimens, force, strain, strict=True)]
    for name, k in (("mean", 0), ("sd", 1)):
        cells = [mean_sd(values)[k] for values in (force, strain)]
        shown = [
            f"{v:{form}}" if np.isfinite(v) else f"{'-':>{form[:2]}}"
            for v, form in zip(cells, ("14.1f", "16.3f"), strict=True)
        ]
        lines.append(f"{name:<{width}}  {'  '.join(shown)}")
    for what, found in (("strip width", {s.width for s in specimens}), ("gauge length", {s.gauge for s in specimens})):
        sizes = ["not stated" if v is None else f"{v:g} mm" for v in sorted(found, key=lambda v: v or 0.0)]
        lines.append(f"{what}: {', '.join(sizes)}")
    return lines


def write_import(
    specimens: Sequence[Specimen], out: Path, direction: Direction, sources: Sequence[str], trusted: bool = False
) -> str:
    """Write the experiment folder ``out``, or replace one ``direction`` of it; returns the variant in its table.

    ``SOURCE.md``, ``tensile-<direction>.csv`` (tidy), ``fabric.yaml``, and in ``<direction>/`` the curves per width,
    statistics.json, curves.png. Raises :class:`InputError` when ``out`` holds what no import wrote, for what
    :func:`one_series` refuses, and for files of the other direction: by what they say, unless ``direction`` is
    ``trusted``, or by their numbers.
    """
    if not trusted:
        refuse_other([s.said for s in specimens], direction)
    strips, conditions = one_series(specimens)
    digests = [digest(s.strain, s.force) for s in specimens]
    _refuse_other_way(out, direction, digests)
    narrow = per_width(strips)
    series = _Series(narrow, corridor(narrow), tension_curve(narrow))
    inner = prepared(out, "tensile", direction)
    found = dict(zip(TENSILE, peaks(strips), strict=True))
    variant, said = out.resolve().name, [(w, conditions[w.key]) for w in (WIDTH, GAUGE) if w.key in conditions]
    source = f"{variant}, {counted(len(strips), 'strip')} of {conditions[WIDTH.key]:g} mm, {direction}"
    record = statistics_text("tensile", direction, found, conditions, sources=list(sources), digests=digests)
    write_atomic(inner / STATISTICS, record)
    write_atomic(out / table_name("tensile", direction), table_text(variant, direction, found, UNITS, said, source))
    means = [f"# {name}: {mean_sd(values)[0]:.6g}" for name, values in found.items()]
    sizes = [f"# {what.key}: {value:g}" for what, value in said]
    tested = ["# test: tensile", f"# direction: {direction}"]
    _write_curves(inner, series, sizes, [f"# source: {source}", *tested, *sizes, *means])
    finish(out)
    return variant


def _write_curves(inner: Path, series: _Series, sizes: Sequence[str], notes: Sequence[str]) -> None:
    for number, s in enumerate(series.strips, 1):
        text = curve_text([f"# specimen: {s.name}", *sizes], {STRAIN: s.strain, FORCE: s.force})
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    band = series.band
    write_atomic(inner / "corridor.csv", curve_text(notes, {STRAIN: band.strain, FORCE: band.mean, FORCE_SD: band.sd}))
    tension = dict(zip((STRAIN, FORCE), series.tension, strict=True))
    write_atomic(inner / "tension.csv", curve_text([*notes, RISING], tension))
    labels = ("strain [%]", "force per width [N/mm]")
    plot([(s.strain, s.force) for s in series.strips], band, labels, inner / "curves.png")


def _refuse_other_way(out: Path, direction: Direction, digests: Sequence[str]) -> None:
    """Raise for curves that were imported for the other direction."""
    other = next(d for d in DIRECTIONS if d != direction)
    folder = out / folder_name("tensile", other)
    if known_elsewhere(read_statistics(out).get(folder.name, {}), digests):
        raise InputError(
            f"--direction {direction}: these curves stand in {folder} already, imported as {other}: of which direction "
            f"are they? Remove that folder if they are of the {direction}"
        )
