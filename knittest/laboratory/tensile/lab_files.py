"""Files of tensile tests as ``knittest data`` takes them."""

from collections.abc import Sequence
from pathlib import Path

from knittest.experiment.lab_checks import plausible_strips
from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_csv import Specimen, read_lab
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_kind import LabTest
from knittest.laboratory.tensile.lab_fabric import fabric_of
from knittest.laboratory.tensile.lab_report import summary_lines, write_import


def _read(path: Path, given: Given) -> list[Specimen]:
    sizes = given.sizes
    return read_lab(path, sizes.get(GAUGE.key), given.decimal, given.delimiter, sizes.get(WIDTH.key), given.sign)


def _lines(specimens: Sequence[Specimen]) -> list[str]:
    plausible_strips(specimens)
    return summary_lines(specimens)


LAB = LabTest(_read, _lines, write_import, (WIDTH, GAUGE), ("sign",), fabric=fabric_of)
