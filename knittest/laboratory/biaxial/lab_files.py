"""Files of biaxial tests as ``knittest data`` takes them: force of one direction over its strain, at a ratio."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from knittest.experiment.lab_checks import common, digests
from knittest.experiment.lab_conditions import GAUGE, RATIO, WIDTH, needed
from knittest.experiment.lab_folder import DIRECTIONS, folder_name
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_results import Curves, Results
from knittest.experiment.lab_strips import one_series, per_width, read_tabled
from knittest.experiment.lab_tests import LabTest, Rigs
from knittest.experiment.lab_units import plain
from knittest.experiment.statistics import Specimen, corridor, peaks

NAME = "biaxial"
UNITS = {"biaxial_force_n_per_mm": "N/mm", "biaxial_strain_pct": "%"}


@dataclass(frozen=True)
class Stretched(Specimen):
    """A specimen, and the strain of its other system over that of the direction."""

    ratio: float = 1.0


def read_stretched(path: Path, given: Given) -> list[Stretched]:
    """Specimens in one export; raises :class:`InputError` where the ratio of the strains is not known."""
    return [
        Stretched(**vars(strip), ratio=needed([RATIO], table, path, given.sizes)[0])
        for strip, table in read_tabled(path, given)
    ]


def stretched_results(specimens: Sequence[Stretched], direction: str, files: Sequence[str]) -> Results:
    """Largest force per width and strain at it; raises :class:`InputError` where they are not of one series."""
    ratio = common(RATIO, [s.ratio for s in specimens], [s.path for s in specimens])
    strips, sizes = one_series(specimens)
    narrow = per_width(strips)
    force, strain = peaks(narrow)
    conditions = [(what, sizes[what.key]) for what in (WIDTH, GAUGE) if what.key in sizes]
    return Results(
        NAME, direction, dict(zip(UNITS, (force, strain), strict=True)), UNITS, [*conditions, (RATIO, ratio)],
        ("square", f"of {sizes[WIDTH.key]:g} mm, the other strain {ratio:g} times"), files,
        digests(specimens, [(s.strain, s.force) for s in specimens]), [s.name for s in specimens],
        [("max. force [N/mm]", ".4g", force), ("strain at it [%]", ".3f", strain)],
        curves=Curves(
            [(s.strain, s.force) for s in narrow], corridor(narrow),
            ("strain_pct", "force_n_per_mm", "force_sd_n_per_mm"), ("strain [%]", "force per width [N/mm]"),
        ),
    )  # fmt: skip


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """The ratio, by direction where both were tested."""
    names = {d: folder_name(NAME, d) for d in DIRECTIONS}
    found = {d: {"ratio": plain(tests[name]["conditions"][RATIO.key])} for d, name in names.items() if name in tests}
    if not found:
        return {}
    return {NAME: dict(found) if len(found) > 1 else next(iter(found.values()))}


LAB = LabTest(read_stretched, stretched_results, (WIDTH, GAUGE, RATIO), ("sign",), rigs=_rigs)
