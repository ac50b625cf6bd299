"""Writes what a tensile import yields: a folder that a fabric file can name as its experiment."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from knittest.base.atomic import write_atomic
from knittest.experiment.lab_checks import digest, one_series, per_width
from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_csv import Specimen
from knittest.experiment.lab_direction import refuse_other
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import TENSION, curve_text
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_picture import plot
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.statistics import Corridor, corridor, mean_sd, peaks, tension_curve
from knittest.experiment.tables import TENSILE

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
    rows = [(s.name, (f, e)) for s, f, e in zip(specimens, force, strain, strict=True)]
    lines = table_lines([("max. force [N]", ".1f"), ("strain at it [%]", ".3f")], rows)
    for what, found in (("strip width", {s.width for s in specimens}), ("gauge length", {s.gauge for s in specimens})):
        sizes = ["not stated" if v is None else f"{v:g} mm" for v in sorted(found, key=lambda v: v or 0.0)]
        lines.append(f"{what}: {', '.join(sizes)}")
    return lines


def write_import(
    specimens: Sequence[Specimen], out: Path, direction: str, sources: Sequence[str], trusted: bool = False
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
    narrow = per_width(strips)
    series = _Series(narrow, corridor(narrow), tension_curve(narrow))
    results = Results(
        "tensile", direction, dict(zip(TENSILE, peaks(strips), strict=True)), UNITS,
        [(what, conditions[what.key]) for what in (WIDTH, GAUGE) if what.key in conditions],
        ("strip", f"of {conditions[WIDTH.key]:g} mm"), sources, [digest(s.strain, s.force) for s in specimens],
    )  # fmt: skip
    inner, notes = write_results(out, results), results.notes(out)
    means = [f"# {name}: {mean_sd(values)[0]:.6g}" for name, values in results.found.items()]
    _write_curves(inner, series, notes, means)
    finish(out)
    return out.resolve().name


def _write_curves(inner: Path, series: _Series, notes: Sequence[str], means: Sequence[str]) -> None:
    for number, s in enumerate(series.strips, 1):
        text = curve_text([f"# specimen: {s.name}", *notes[1:]], {STRAIN: s.strain, FORCE: s.force})
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    band = series.band
    write_atomic(
        inner / "corridor.csv", curve_text([*notes, *means], {STRAIN: band.strain, FORCE: band.mean, FORCE_SD: band.sd})
    )
    tension = dict(zip((STRAIN, FORCE), series.tension, strict=True))
    write_atomic(inner / TENSION, curve_text([*notes, *means, RISING], tension))
    labels = ("strain [%]", "force per width [N/mm]")
    plot([(s.strain, s.force) for s in series.strips], band, labels, inner / "curves.png")
