"""Files of biaxial tests as ``knittest data`` takes them: force of one direction over its strain, at a ratio."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from knittest.base.atomic import write_atomic
from knittest.experiment.lab_checks import common, digest, one_series, per_width
from knittest.experiment.lab_conditions import GAUGE, RATIO, WIDTH, needed
from knittest.experiment.lab_csv import Specimen, read_lab
from knittest.experiment.lab_direction import refuse_other
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import DIRECTIONS, curve_text, folder_name
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_kind import LabTest, Rigs
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_numbers import plain
from knittest.experiment.lab_picture import plot
from knittest.experiment.lab_rows import read_rows
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.statistics import corridor, peaks

NAME = "biaxial"
STRAIN, FORCE, FORCE_SD = "strain_pct", "force_n_per_mm", "force_sd_n_per_mm"
UNITS = {"biaxial_force_n_per_mm": "N/mm", "biaxial_strain_pct": "%"}
_BIAXIAL = re.compile(r"bi-?axial", re.I)


@dataclass(frozen=True)
class Stretched:
    """One specimen, and the strain of its other system over that of the direction."""

    strip: Specimen
    ratio: float


def _read(path: Path, given: Given) -> list[Stretched]:
    sizes, mark = given.sizes, given.decimal or "."
    ratio = needed(RATIO, path, read_rows(path, given.delimiter), mark, sizes)
    strips = read_lab(path, sizes.get(GAUGE.key), given.decimal, given.delimiter, sizes.get(WIDTH.key), given.sign)
    return [Stretched(strip, ratio) for strip in strips]


def _results(specimens: Sequence[Stretched], direction: str, files: Sequence[str]) -> tuple[Results, list[Specimen]]:
    """Largest force per width and strain at it, and the specimens per width; raises :class:`InputError` where they are
    not of one series.
    """
    given = [s.strip for s in specimens]
    ratio = common(RATIO, [s.ratio for s in specimens], [s.path for s in given])
    strips, sizes = one_series(given)
    narrow = per_width(strips)
    conditions = [(what, sizes[what.key]) for what in (WIDTH, GAUGE) if what.key in sizes]
    results = Results(
        NAME, direction, dict(zip(UNITS, peaks(narrow), strict=True)), UNITS, [*conditions, (RATIO, ratio)],
        ("square", f"of {sizes[WIDTH.key]:g} mm, the other strain {ratio:g} times"), files,
        [digest(s.strain, s.force) for s in given],
    )  # fmt: skip
    return results, narrow


def _lines(specimens: Sequence[Stretched]) -> list[str]:
    """Table of the largest force per width and the strain at it, with mean and sd, and what they hang on."""
    results, narrow = _results(specimens, "", [])
    force, strain = results.found.values()
    rows = [(s.name, (f, e)) for s, f, e in zip(narrow, force, strain, strict=True)]
    lines = table_lines([("max. force [N/mm]", ".4g"), ("strain at it [%]", ".3f")], rows)
    return lines + [f"{what.name}: {value:g} {what.unit}".removesuffix(" 1") for what, value in results.conditions]


def _write(
    specimens: Sequence[Stretched], out: Path, direction: str, files: Sequence[str], trusted: bool = False
) -> str:
    """Write a table and a folder ``biaxial-<direction>`` into the experiment ``out``; returns its variant."""
    if not trusted:
        refuse_other([s.strip.said for s in specimens], direction)
    results, narrow = _results(specimens, direction, files)
    inner, notes = write_results(out, results), results.notes(out)
    for number, s in enumerate(narrow, 1):
        text = curve_text([f"# specimen: {s.name}", *notes[1:]], {STRAIN: s.strain, FORCE: s.force})
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    band = corridor(narrow)
    write_atomic(inner / "corridor.csv", curve_text(notes, {STRAIN: band.strain, FORCE: band.mean, FORCE_SD: band.sd}))
    labels = ("strain [%]", "force per width [N/mm]")
    plot([(s.strain, s.force) for s in narrow], band, labels, inner / "curves.png")
    finish(out)
    return out.resolve().name


def _looks(cells: Sequence[str]) -> bool:
    return any(_BIAXIAL.search(cell) or RATIO.names(cell, 0) for cell in cells)


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """The ratio, by direction where both were tested."""
    names = {d: folder_name(NAME, d) for d in DIRECTIONS}
    found = {d: {"ratio": plain(tests[name]["conditions"][RATIO.key])} for d, name in names.items() if name in tests}
    if not found:
        return {}
    return {NAME: dict(found) if len(found) > 1 else next(iter(found.values()))}


LAB = LabTest(_read, _lines, _write, (WIDTH, GAUGE, RATIO), ("sign",), _looks, _BIAXIAL, _rigs)
