"""Writes what a laboratory import yields: specimens, corridor, statistics, plot."""

import json
from collections.abc import Sequence
from pathlib import Path

from knittest.errors import ResourceError
from knittest.experiment.lab_csv import Specimen
from knittest.experiment.statistics import Corridor, corridor, mean_sd, peaks
from knittest.export.atomic import write_atomic
from knittest.export.figure import BLUE, dress, new_figure, save


def summary_lines(specimens: Sequence[Specimen]) -> list[str]:
    """Table of maximum force [N] and strain at it [%], with mean and sd."""
    force, strain = peaks(specimens)
    width = max(len("specimen"), *(len(s.name) for s in specimens))
    lines = [f"{'specimen':<{width}}  max. force [N]  strain at it [%]"]
    lines += [f"{s.name:<{width}}  {f:14.1f}  {e:16.3f}" for s, f, e in zip(specimens, force, strain, strict=True)]
    for name, k in (("mean", 0), ("sd", 1)):
        lines.append(f"{name:<{width}}  {mean_sd(force)[k]:14.1f}  {mean_sd(strain)[k]:16.3f}")
    return lines


def write_import(specimens: Sequence[Specimen], out: Path, sources: Sequence[str]) -> None:
    """Write ``specimen-*.csv``, ``corridor.csv`` (kind: measured), ``statistics.json``, ``curves.png`` to ``out``."""
    band = corridor(specimens)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResourceError(f"{out}: cannot be made: {error.strerror}") from None
    for number, s in enumerate(specimens, 1):
        rows = [f"{e:.6g},{f:.6g}" for e, f in zip(s.strain, s.force, strict=True)]
        write_atomic(out / f"specimen-{number:02d}.csv", _curve([f"# specimen: {s.name}"], "strain_pct,force_n", rows))
    rows = [f"{e:.6g},{m:.6g},{d:.6g}" for e, m, d in zip(band.strain, band.mean, band.sd, strict=True)]
    notes = [f"# source: {', '.join(sources)}", f"# specimens: {band.n}"]
    write_atomic(out / "corridor.csv", _curve(notes, "strain_pct,force_n,force_sd_n", rows))
    force, strain = peaks(specimens)
    results = {}
    for name, values in (("peak_force_n", force), ("fracture_strain_pct", strain)):
        mean, sd = mean_sd(values)
        results[name] = {"mean": mean, "sd": sd, "n": len(values), "values": [float(v) for v in values]}
    write_atomic(
        out / "statistics.json", json.dumps({"kind": "measured", "sources": list(sources), **results}, indent=2)
    )
    _plot(specimens, band, out / "curves.png")


def _curve(notes: list[str], header: str, rows: list[str]) -> str:
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
