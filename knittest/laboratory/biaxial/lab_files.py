"""Files of biaxial tests as ``knittest data`` takes them: force of one direction over its strain, at a ratio."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from knittest.base.errors import InputError
from knittest.experiment import lab_names
from knittest.experiment.lab_checks import common, digests
from knittest.experiment.lab_conditions import GAUGE, RATIO, WIDTH, needed
from knittest.experiment.lab_folder import Tests, of_directions
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_results import Results
from knittest.experiment.lab_strips import one_series, read_tabled, strip_curves
from knittest.experiment.lab_tests import LabTest, Rigs
from knittest.experiment.lab_units import plain
from knittest.experiment.statistics import Specimen, peaks

NAME = "biaxial"
UNITS = {"biaxial_force_n_per_mm": "N/mm", "biaxial_strain_pct": "%"}


@dataclass(frozen=True)
class Stretched(Specimen):
    """A specimen, and the strain of its other system over that of the direction."""

    ratio: float = 1.0


def _read(path: Path, given: Given) -> list[Stretched]:
    found = read_tabled(path, given)
    for _, table in found:
        axes = [table.names[k] for k in table.having("force") if lab_names.is_kind("axis", table.names[k])]
        if len(axes) > 1:
            raise InputError(
                f"{table.where}: columns {axes[0]!r} and {axes[1]!r} are of two directions: name the force and the "
                f'travel of the direction tested, such as --column force="{axes[0]}"'
            )
    return [Stretched(**vars(strip), ratio=needed([RATIO], table, path, given.sizes)[0]) for strip, table in found]


def _results(specimens: Sequence[Stretched]) -> Results:
    """Largest force per width and strain at it."""
    ratio = common(RATIO, [s.ratio for s in specimens], specimens)
    _, narrow, sizes = one_series(specimens)
    force, strain = peaks(narrow)
    return Results(
        dict(zip(UNITS, (force, strain), strict=True)), UNITS, [*sizes.items(), (RATIO, ratio)],
        ("square", f"of {sizes[WIDTH]:g} mm, the other strain {ratio:g} times"),
        digests(specimens, [(s.strain, s.force) for s in specimens]),
        [("max. force [N/mm]", ".4g", force), ("strain at it [%]", ".3f", strain)], curves=strip_curves(narrow),
    )  # fmt: skip


def _rigs(tests: Tests) -> Rigs:
    """The ratio, by direction where both were tested."""
    found = {d: {"ratio": plain(test["conditions"][RATIO.key])} for d, test in of_directions(tests, NAME).items()}
    return {NAME: dict(found) if len(found) > 1 else next(iter(found.values()))} if found else {}


LAB = LabTest(NAME, _read, _results, (WIDTH, GAUGE, RATIO), ("sign",), _rigs)
