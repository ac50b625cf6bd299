"""Files of biaxial tests as ``knittest data`` takes them: force of one direction over its strain, at a ratio."""

from collections.abc import Sequence
from dataclasses import dataclass

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import GAUGE, RATIO, WIDTH, common_value
from knittest.experiment.lab_recording import Recording
from knittest.experiment.lab_results import Results
from knittest.experiment.lab_shear import digests
from knittest.experiment.lab_strips import make_series, read_strip, strip_curves, strip_reader
from knittest.experiment.lab_tests import LabTest
from knittest.experiment.statistics import Specimen, peaks

NAME = "biaxial"
UNITS = {"biaxial_force_n_per_mm": "N/mm", "biaxial_strain_pct": "%"}


@dataclass(frozen=True)
class BiaxialSpecimen(Specimen):
    """A specimen, and the strain of its other system over that of the direction."""

    ratio: float = 1.0


def _read_specimen(r: Recording) -> BiaxialSpecimen:
    axes = [r.table.names[k] for k in r.table.columns_of_roles("force") if r.is_kind(k, "axis")]
    if len(axes) > 1:
        raise InputError(
            f"{r.table.header_place}: columns {axes[0]!r} and {axes[1]!r} are of two directions; name force and travel "
            f'of the tested direction, such as --column force="{axes[0]}"'
        )
    return BiaxialSpecimen(**vars(read_strip(r)), ratio=r.require(RATIO)[0])


def _results(specimens: Sequence[BiaxialSpecimen]) -> Results:
    ratio = common_value(RATIO, [s.ratio for s in specimens], specimens)
    _, narrow, sizes = make_series(specimens)
    force, strain = peaks(narrow)
    return Results(
        dict(zip(UNITS, (force, strain), strict=True)), UNITS, [*sizes.items(), (RATIO, ratio)],
        ("square", f"of {sizes[WIDTH]:g} mm, the other strain {ratio:g} times"),
        digests(specimens, [(s.strain, s.force) for s in specimens]),
        [("max. force [N/mm]", ".4g", force), ("strain at it [%]", ".3f", strain)], curves=strip_curves(narrow),
    )  # fmt: skip


LAB = LabTest(
    NAME, strip_reader(_read_specimen), _results, (WIDTH, GAUGE, RATIO), ("sign",),
    lambda test: {"ratio": test["conditions"][RATIO.key]},
)  # fmt: skip
