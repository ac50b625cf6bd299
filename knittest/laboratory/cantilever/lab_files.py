"""Files of overhangs as ``knittest data`` takes them."""

import re
from collections.abc import Sequence

from knittest.experiment.lab_conditions import AREA_MASS, PLANE_ANGLE, WIDTH
from knittest.experiment.lab_kind import LabTest
from knittest.laboratory.cantilever.lab_fabric import fabric_of
from knittest.laboratory.cantilever.lab_overhangs import cantilever_lines, read_overhangs, write_cantilever

_BENT = re.compile(r"over ?hang|überhang|ueberhang|bending[ _-]*length|biege ?länge", re.I)
_NAMED = re.compile(r"cantilever|overhang|überhang|ueberhang|biege|biegung", re.I)


def _looks(cells: Sequence[str]) -> bool:
    return any(_BENT.search(cell) for cell in cells)


LAB = LabTest(
    read_overhangs,
    cantilever_lines,
    write_cantilever,
    (AREA_MASS, PLANE_ANGLE, WIDTH),
    looks=_looks,
    named=_NAMED,
    fabric=fabric_of,
)
